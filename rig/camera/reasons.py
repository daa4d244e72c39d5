"""Why a camera does not open: one sentence each, with what to do about it."""

from __future__ import annotations

import errno
import os
from pathlib import Path

NODES = Path("/dev")
PROCESSES = Path("/proc")


def refusal(device: str, error: OSError) -> OSError:
    """Error with the sentence for what the system said when `device` was opened or set up."""
    match error.errno:
        case errno.ENOENT | errno.ENODEV | errno.ENXIO:
            text = _absent(device)
        case errno.EACCES | errno.EPERM:
            text = (
                f"no permission to use {device}; add yourself to its group with 'sudo usermod -aG"
                " video $USER' and log in again, or install the rule that 'touchplate doctor'"
                " prints"
            )
        case errno.EBUSY:
            holder = user_of(device)
            by = f" by {holder}" if holder else ""
            text = f"{device} is in use{by}; close the other program"
        case errno.ENOTTY:
            text = f"{device} is no camera; 'touchplate doctor' lists those that are there"
        case _:
            text = f"{device} does not open ({error.strerror or error}); plug it in again"
    return OSError(text)


def unsupported(device: str, wanted: str, offered: str) -> OSError:
    """Error for a size or format that the camera does not have."""
    return OSError(f"{device} has no images of {wanted}; it offers {offered}")


def user_of(device: str) -> str | None:
    """Name and number of another process that has the device open, as far as we may see."""
    if not PROCESSES.is_dir():  # not on Windows and macOS
        return None
    target = os.path.realpath(device)
    for process in PROCESSES.iterdir():
        if not process.name.isdigit() or int(process.name) == os.getpid():
            continue
        try:
            if any(os.path.realpath(link) == target for link in (process / "fd").iterdir()):
                return f"{(process / 'comm').read_text().strip()} (process {process.name})"
        except OSError:  # another user's, or gone meanwhile
            continue
    return None


def _absent(device: str) -> str:
    others = sorted(str(path) for path in NODES.glob("video*"))
    there = f"there are {', '.join(others)}" if others else "there is none at all"
    return f"no camera at {device} ({there}); plug it in or name another"
