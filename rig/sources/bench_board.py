"""The USB board of a scene, at work while frames are taken."""

# pyusb has no stubs.
# pyright: reportMissingTypeStubs=false

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rig.scene.board import BoardSection

if TYPE_CHECKING:
    from usb.backend import IBackend

    from rig.usb import UsbDevice
    from rig.usb.link import BoardLink


@contextmanager
def board_at_work(
    section: BoardSection, rate: float, backend: IBackend | None = None
) -> Generator[BoardLink]:
    """Light the lamp and trigger the camera while the block runs; both are off after it.

    A lamp that follows the touches is dark until the link lights it.

    Parameters
    ----------
    section : BoardSection
    rate : float, frames a second
        Of the camera.
    backend : usb.backend.IBackend or None
        None takes libusb.

    Raises
    ------
    OSError
        If the board is not there, may not be used, is none, or has no input for the foot switch.
    ValueError
        If it lacks an output, or a pulse is longer than the time of a frame.
    """
    from rig.usb import list_devices, open_board
    from rig.usb.link import BoardLink

    with open_board(_chosen(list_devices(backend), section.serial), backend) as board:
        follows = section.lamp_follows is not None
        if section.lamp is not None and not follows:
            board.light(section.lamp_output, section.lamp)
        if section.trigger_width is not None:
            board.trigger(section.trigger_output, 1 / rate, section.trigger_width)
        lamp = section.lamp_output if follows else None
        switch = section.foot_switch_input if section.foot_switch else None
        with BoardLink(board, lamp, switch) as link:
            yield link


def _chosen(devices: Sequence[UsbDevice], serial: str | None) -> UsbDevice:
    from rig.usb.board import TRIAL_BOARD

    boards = [one for one in devices if (one.vendor, one.product) == TRIAL_BOARD]
    found = [one for one in boards if serial in (None, one.serial)]
    if len(found) == 1:
        return found[0]
    named = "" if serial is None else f" with serial number {serial!r}"
    there = ", ".join(f"{one.label}, serial number {one.serial}" for one in boards) or "none"
    raise OSError(
        f"{len(found) or 'no'} USB boards{named} are plugged in; plug in one or set board.serial"
        f" (there are: {there})"
    )
