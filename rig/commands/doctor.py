"""`touchplate doctor`: what is there, what is missing, and the remedy."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import emit
from rig.doctor.finding import Finding, FindingState, wrong

if TYPE_CHECKING:
    from rich.console import Group

    from rig.usb import UsbDevice

RESULTS = Path("results")
COLOURS = {FindingState.GOOD: "green", FindingState.ABSENT: "yellow", FindingState.WRONG: "red"}


def doctor(
    camera: Annotated[
        str | None,
        typer.Option(metavar="DEVICE", help="Test the noise of this camera, e.g. /dev/video0."),
    ] = None,
    size: Annotated[
        tuple[int, int], typer.Option(metavar="WIDTH HEIGHT", help="Of its images, px.")
    ] = (640, 480),
    rate: Annotated[float, typer.Option(min=0.1, help="Frames a second that it shall give.")] = 30,
    frames: Annotated[int, typer.Option(min=2, help="Frames of the noise test.")] = 30,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Look at packages, computer, disk, displays, cameras and USB; test a camera if named.

    What is wrong is a finding and no error: the exit code is 0.
    """
    from rig.doctor import devices, machine

    usb, trouble = _list_usb()
    findings = [
        *machine.check_packages(),
        *machine.check_computer(),
        machine.check_disk(RESULTS),
        machine.check_displays(),
        *devices.check_cameras(),
        *(trouble or devices.check_usb(usb)),
    ]
    noise = None
    if camera:
        noise, more = _test(camera, size, rate, frames)
        findings += more
    rule = devices.udev_rule(usb)
    data = {
        "ready": all(finding.state is not FindingState.WRONG for finding in findings),
        "findings": [asdict(finding) for finding in findings],
        "versions": machine.versions(),
        "usb": [asdict(device) for device in usb],
        "udev_rule": rule,
        "noise": noise,
    }
    shown = rule if any(devices.INSTALL in finding.remedy for finding in findings) else None
    emit(_tables(findings, shown), data, as_json)


def _list_usb() -> tuple[tuple[UsbDevice, ...], list[Finding]]:
    from rig.usb import list_devices

    try:
        return list_devices(), []
    except OSError as error:
        return (), [wrong("usb", "the bus cannot be read", str(error))]


def _test(
    camera: str, size: tuple[int, int], rate: float, frames: int
) -> tuple[dict[str, Any] | None, list[Finding]]:
    from rig.doctor.still import examine

    try:
        noise, findings = examine(camera, size, rate, frames)
    except OSError as error:
        return None, [wrong("image", "the camera was not tested", str(error))]
    return asdict(noise), findings


def _tables(findings: list[Finding], rule: str | None) -> Group:
    from rich.box import SIMPLE
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    table = Table("topic", "", "found", "what to do", box=SIMPLE)
    for finding in findings:
        state = Text(finding.state, COLOURS[finding.state])
        table.add_row(finding.topic, state, finding.text, finding.remedy)
    return Group(table, rule) if rule else Group(table)
