"""`touchplate doctor`: findings, remedies and the udev rule, on a machine that the test draws."""

import json
import subprocess
import sys
from collections import namedtuple
from dataclasses import replace
from importlib import metadata

import pytest
from typer.testing import CliRunner

from rig import cli
from rig.doctor import devices, machine
from rig.doctor.finding import FindingState
from rig.usb import UsbDevice

CAMERA = UsbDevice(
    vendor=0x046D, product=0x0825, serial="E7", name="Cam", bus=1, address=3, ports=(2, 3),
    camera=True, nodes=("/dev/video0",),
)  # fmt: skip
BOARD = UsbDevice(0x1209, 1, None, "Light", 1, 9, (4,), camera=False, nodes=())
MOUSE = UsbDevice(0x1234, 5, None, "Mouse", 1, 4, (5,), camera=False, nodes=())


def doctor(*options):
    arguments = ["doctor", *options]
    done = CliRunner().invoke(cli.application(arguments), arguments, catch_exceptions=False)
    assert done.exit_code == 0
    return done.output


def test_one_json_object_says_all():
    said = json.loads(doctor("--json"))
    assert {"ready", "findings", "versions", "usb", "udev_rule", "noise"} == set(said)
    topics = {finding["topic"] for finding in said["findings"]}
    assert {"python", "packages", "computer", "graphics", "disk", "displays"} <= topics
    assert said["versions"]["touchplate"] == metadata.version("touchplate")
    assert said["noise"] is None
    assert said["ready"] == all(finding["state"] != "wrong" for finding in said["findings"])


def test_what_is_wrong_has_a_remedy_and_a_camera_that_is_not_there_is_a_finding():
    said = json.loads(doctor("--json", "--camera", "/dev/video94"))
    (tested,) = [f for f in said["findings"] if f["topic"] == "image"]
    assert tested["state"] == "wrong"
    assert tested["remedy"].startswith("no camera at /dev/video94")
    assert not said["ready"]
    assert all(f["remedy"] for f in said["findings"] if f["state"] == "wrong")


def test_without_a_camera_nothing_heavy_is_imported():
    code = (
        "import sys; sys.argv = ['touchplate', 'doctor', '--json']\n"
        "from rig.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'cv2', 'numba', 'torch', 'pygame', 'uvicorn', 'dic', 'fe'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("\n[]\n")


def test_a_missing_package_is_wrong_and_a_missing_extra_is_absent(monkeypatch):
    there = metadata.version

    def version(name):
        if name in ("numba", "pypylon"):
            raise metadata.PackageNotFoundError(name)
        return there(name)

    monkeypatch.setattr(metadata, "version", version)
    findings = {finding.topic: finding for finding in machine.check_packages()}
    assert findings["packages"].state is FindingState.WRONG
    assert findings["packages"].text == "missing: numba"
    assert findings["extra vision"].state is FindingState.ABSENT
    assert findings["extra vision"].remedy == "pip install 'touchplate[vision]'"


def test_a_disk_that_is_nearly_full_is_wrong(monkeypatch, tmp_path):
    monkeypatch.setattr(machine, "MIN_FREE", 1e9)
    finding = machine.check_disk(tmp_path / "results" / "later")
    assert finding.state is FindingState.WRONG
    assert f"free at {tmp_path}" in finding.text
    monkeypatch.setattr(machine, "MIN_FREE", 0)
    assert machine.check_disk(tmp_path).state is FindingState.GOOD


def test_free_space_is_given_in_minutes_of_recording(monkeypatch, tmp_path):
    disk = namedtuple("Disk", "total used free")(0, 0, 113_246_208_000)
    monkeypatch.setattr(machine.shutil, "disk_usage", lambda place: disk)
    assert "113 GB free" in machine.check_disk(tmp_path).text
    assert "60 minutes of full frames" in machine.check_disk(tmp_path).text


def test_the_memory_is_that_of_its_pages(monkeypatch):
    pages = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 4_000_000}
    monkeypatch.setattr(machine.os, "sysconf", pages.get)
    findings = {finding.topic: finding for finding in machine.check_computer()}
    assert findings["computer"].text.endswith("16 GB of memory")


def test_screens_and_x_servers_are_listed(monkeypatch, tmp_path):
    for name, status in (("card0-HDMI-A-1", "connected"), ("card0-DP-1", "disconnected")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "status").write_text(f"{status}\n")
        (tmp_path / name / "modes").write_text("1280x800\n1024x768\n")
    monkeypatch.setattr(machine, "CONNECTORS", tmp_path)
    monkeypatch.setattr(machine, "X_SOCKETS", tmp_path / "sockets")
    assert machine.check_displays().text == "no X server, 1 screens are plugged in"
    (tmp_path / "sockets").mkdir()
    (tmp_path / "sockets" / "X0").touch()
    assert machine.check_displays().text == "X server :0; screens HDMI-A-1 1280x800"


def test_the_gpu_is_named(monkeypatch, tmp_path):
    (tmp_path / "0000:01:00.0").mkdir()
    (tmp_path / "0000:01:00.0" / "information").write_text("Model: \t Big GPU\nIRQ: 5\n")
    monkeypatch.setattr(machine, "GRAPHICS", tmp_path)
    findings = {finding.topic: finding for finding in machine.check_computer()}
    assert findings["graphics"].text == "Big GPU"


@pytest.fixture
def nodes(monkeypatch, tmp_path):
    """Draw two nodes of one camera: images, and metadata that are left out."""
    for node, index in (("video0", "0"), ("video1", "1")):
        (tmp_path / "sys" / node).mkdir(parents=True)
        (tmp_path / "sys" / node / "name").write_text("Speckle Cam\n")
        (tmp_path / "sys" / node / "index").write_text(f"{index}\n")
        (tmp_path / node).touch()
    monkeypatch.setattr(devices, "VIDEO", tmp_path / "sys")
    monkeypatch.setattr(devices, "DEVICES", tmp_path)
    return tmp_path


def test_a_camera_is_named_and_its_metadata_are_left_out(nodes):
    (finding,) = devices.check_cameras()
    assert finding.state is FindingState.GOOD
    assert finding.text == f"{nodes}/video0 is Speckle Cam"


def test_a_camera_that_another_program_has_open_is_said_with_its_name(nodes):
    holding = f"import sys; f = open({str(nodes / 'video0')!r}); print(1, flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", holding], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None
        other.stdout.readline()
        (finding,) = devices.check_cameras()
        other.communicate(b"\n")
    assert finding.state is FindingState.WRONG
    assert "in use by python" in finding.text
    assert f"(process {other.pid})" in finding.text


def test_a_camera_that_we_may_not_use_says_what_to_do(nodes, monkeypatch):
    monkeypatch.setattr("os.access", lambda path, mode: False)
    (finding,) = devices.check_cameras()
    assert "no permission" in finding.text
    assert "usermod -aG video" in finding.remedy


def test_usb_devices_of_a_bench_are_listed_and_others_are_not(nodes):
    camera, board = devices.check_usb([CAMERA, MOUSE, BOARD])
    assert camera.text == "Cam 046d:0825 at 1-2.3, serial number E7, /dev/video0"
    assert board.text == "Light 1209:0001 at 1-4"
    assert devices.check_usb([MOUSE]).__next__().state is FindingState.ABSENT


def test_the_udev_rule_names_what_we_may_not_use(nodes, monkeypatch):
    (nodes / "bus" / "usb" / "001").mkdir(parents=True)
    (nodes / "bus" / "usb" / "001" / "003").touch()
    monkeypatch.setattr("os.access", lambda path, mode: False)
    camera, board = devices.check_usb([CAMERA, BOARD])  # the board has no node here
    assert camera.state is FindingState.WRONG
    assert camera.remedy == "paste the rule below into /etc/udev/rules.d/60-touchplate.rules"
    assert board.state is FindingState.GOOD
    lines = devices.udev_rule([CAMERA, replace(CAMERA, ports=(7,)), MOUSE]).splitlines()
    assert lines[2:] == [
        'SUBSYSTEM=="usb", ATTR{idVendor}=="046d", ATTR{idProduct}=="0825", GROUP="plugdev",'
        ' MODE="0660", TAG+="uaccess"'
    ]
