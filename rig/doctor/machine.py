"""The machine: versions, processor, memory, graphics, displays and disk.

Nothing heavy is imported: what is installed is read from its metadata.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

from rig.doctor.finding import Finding, absent, good, wrong

EXTRAS = {
    "v4l2": (("linuxpy",), "frame numbers of V4L2 cameras"),
    "vision": (("harvesters", "pypylon"), "GenICam and Basler cameras"),
    "lsl": (("pylsl",), "touches by the Lab Streaming Layer"),
    "mqtt": (("paho-mqtt",), "touches to an MQTT broker"),
    "ros": (("rclpy",), "touches by a node of ROS 2"),
}
"""Packages of each extra, and what it is for."""
TRAINER = "torch"
GIGA = 1e9
MIN_FREE = 5.0  # GB
FRAME_BYTES, RATE = 1024**2, 30  # what a recording takes: one byte a pixel
GRAPHICS = Path("/proc/driver/nvidia/gpus")
CONNECTORS = Path("/sys/class/drm")
X_SOCKETS = Path("/tmp/.X11-unix")


def versions() -> dict[str, str | None]:
    """Version of this package and of all that it needs; None where one is missing."""
    needed = (re.split(r"[\s<>=!~;\[]", line)[0] for line in _required())
    return {name: _version(name) for name in ("touchplate", *sorted(needed))}


def check_packages() -> Iterator[Finding]:
    """Python, the packages, and the extras."""
    yield good("python", f"{platform.python_version()} on {platform.platform(terse=True)}")
    found = versions()
    missing = sorted(name for name, version in found.items() if version is None)
    if set(missing) - {TRAINER}:
        yield wrong("packages", f"missing: {', '.join(missing)}", "run 'make install'")
    else:
        count = len(found) - 1
        yield good("packages", f"touchplate {found['touchplate']} and {count} that it needs")
        if missing:
            yield absent(TRAINER, "not installed; for training nets", "run 'make torch'")
    for extra, (packages, purpose) in EXTRAS.items():
        if all(map(_version, packages)):
            yield good(f"extra {extra}", f"{' and '.join(packages)} for {purpose}")
        else:
            remedy = f"pip install 'touchplate[{extra}]'"
            yield absent(f"extra {extra}", f"not installed; for {purpose}", remedy)


def check_computer() -> Iterator[Finding]:
    """Processor, memory and graphics."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    memory = ""
    if hasattr(os, "sysconf"):
        size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / GIGA
        memory = f", {size:.0f} GB of memory"
    yield good("computer", f"{cores} cores{memory}")
    names = [_graphics_name(path) for path in sorted(GRAPHICS.glob("*/information"))]
    if names:
        yield good("graphics", ", ".join(names))
    else:
        yield absent("graphics", "no NVIDIA GPU; nets are trained on the processor")


def check_disk(folder: Path) -> Finding:
    """Free space where recordings go."""
    place = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    free = shutil.disk_usage(place).free / GIGA
    minutes = free * GIGA / (FRAME_BYTES * RATE) / 60
    text = f"{free:.0f} GB free at {place}, {minutes:.0f} minutes of full frames at 1024²"
    if free < MIN_FREE:
        return wrong("disk", text, "delete old recordings or record elsewhere")
    return good("disk", text)


def check_displays() -> Finding:
    """Screens that the system sees, for the projector's window."""
    connected = [
        f"{path.parent.name.partition('-')[2]} {_first_line(path.parent / 'modes')}".strip()
        for path in sorted(CONNECTORS.glob("card*-*/status"))
        if _first_line(path) == "connected"
    ]
    servers = sorted(f":{path.name[1:]}" for path in X_SOCKETS.glob("X*"))
    if not servers:
        return absent(
            "displays",
            f"no X server, {len(connected)} screens are plugged in",
            "start a desktop session before the projector's window is wanted",
        )
    screens = f"screens {', '.join(connected)}" if connected else "no screen of its own"
    return good("displays", f"X server {', '.join(servers)}; {screens}")


def _required() -> list[str]:
    """List what this package needs, without what its extras do."""
    try:
        lines = metadata.requires("touchplate") or []
    except metadata.PackageNotFoundError:
        return []
    return [line for line in lines if "extra ==" not in line]


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _graphics_name(path: Path) -> str:
    found = re.search(r"Model:\s*(.+)", path.read_text(encoding="utf-8", errors="replace"))
    return found[1].strip() if found else path.parent.name


def _first_line(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8").partition("\n")[0].strip()
    except OSError:
        return ""
