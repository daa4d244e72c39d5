"""Cameras and boards: which are there, whether we may use them, and the rule that lets us."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from rig.camera.reasons import user_of
from rig.doctor.finding import Finding, absent, good, wrong
from rig.usb import UsbDevice
from rig.usb.board import TRIAL_BOARD

VIDEO = Path("/sys/class/video4linux")
DEVICES = Path("/dev")
RULES = "/etc/udev/rules.d/60-touchplate.rules"
INSTALL = f"paste the rule below into {RULES}"
RELOAD = "then run: sudo udevadm control --reload && sudo udevadm trigger"


def camera_nodes() -> list[tuple[Path, str]]:
    """List the video nodes that give images, with what the kernel calls each camera."""
    paths = sorted(path for path in VIDEO.glob("video*") if _read(path / "index") in ("0", ""))
    return [(DEVICES / path.name, _read(path / "name") or "a camera") for path in paths]


def check_cameras() -> Iterator[Finding]:
    """Video nodes of the kernel; those that give no images (metadata) are left out."""
    nodes = camera_nodes()
    if not nodes and sys.platform != "linux":
        remedy = "test one by its number: touchplate doctor --camera 0"
        yield absent("camera", "this system numbers its cameras and does not list them", remedy)
    elif not nodes:
        yield absent("camera", "no /dev/video*: none is plugged in, or the system has no V4L2")
    for node, name in nodes:
        text = f"{node} is {name}"
        holder = user_of(str(node))
        if not os.access(node, os.R_OK | os.W_OK):
            remedy = f"sudo usermod -aG video $USER and log in again, or {INSTALL}"
            yield wrong("camera", f"{text}; no permission to use it", remedy)
        elif holder:
            yield wrong("camera", f"{text}; in use by {holder}", "close that program")
        else:
            yield good("camera", text)


def check_usb(devices: Iterable[UsbDevice]) -> Iterator[Finding]:
    """Cameras and boards on the USB."""
    ours = [device for device in devices if is_ours(device)]
    if not ours:
        yield absent("usb", "neither a camera nor a board is plugged in")
    for device in ours:
        nodes = f", {', '.join(device.nodes)}" if device.nodes else ""
        serial = f", serial number {device.serial}" if device.serial else ""
        text = f"{device.label}{serial}{nodes}"
        if may_use(device):
            yield good("usb", text)
        else:
            yield wrong("usb", f"{text}; no permission to use it", INSTALL)


def is_ours(device: UsbDevice) -> bool:
    """Whether a bench has a use for it."""
    return device.camera or (device.vendor, device.product) == TRIAL_BOARD


def may_use(device: UsbDevice) -> bool:
    """Whether we may send requests to it."""
    node = DEVICES / "bus" / "usb" / f"{device.bus:03d}" / f"{device.address:03d}"
    return not node.exists() or os.access(node, os.R_OK | os.W_OK)


def udev_rule(devices: Iterable[UsbDevice]) -> str:
    """Rule that gives whoever sits at the machine the video nodes and these devices."""
    numbers = sorted({(device.vendor, device.product) for device in devices if is_ours(device)})
    lines = [f"# {RULES}; {RELOAD}", 'SUBSYSTEM=="video4linux", GROUP="video", TAG+="uaccess"']
    lines += [
        f'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{vendor:04x}", ATTR{{idProduct}}=="{product:04x}",'
        ' GROUP="plugdev", MODE="0660", TAG+="uaccess"'
        for vendor, product in numbers or [TRIAL_BOARD]
    ]
    return "\n".join(lines)


def _read(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
