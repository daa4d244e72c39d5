"""A board that lights, triggers and has a foot switch, by vendor requests.

Any microcontroller with USB can be one. All requests go to the device itself (recipient 0) on
endpoint 0; numbers are little-endian; an output, or an input, is counted from 0 in wIndex.

| bRequest | way | wValue | data | meaning |
|---|---|---|---|---|
| 1 IDENTIFY | in, 8 | 0 | "TPB", version u8, outputs u8, 3 reserved | what it is |
| 2 LEVEL | out | 0 to 1000 | none | steady light of an output, per mille |
| 3 STROBE | out, 8 | 0 | delay u32 µs, width u32 µs | after each frame trigger; width 0: none |
| 4 TRIGGER | out, 12 | 0 | period u32 µs, width u32 µs, count u32 | pulses; count 0: for ever |
| 5 STATE | in, 12 | 0 | given u32, missed u32, time u32 µs | pulses since IDENTIFY, own clock |
| 6 OFF | out | 0 | none | all outputs dark and still |
| 7 PRESSES | in, 4 | 0 | presses u32 | how often an input's switch was pressed, bounce left out |

The board stalls what it does not know or cannot do, and is off when it loses its supply.
"""

# pyusb has no stubs, and types of its own for little of what it gives.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false

from __future__ import annotations

import struct
from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass

import usb.util
from usb.backend import IBackend

from rig.usb.devices import Opened, UsbDevice, find_device
from rig.usb.faults import faults

IDENTIFY, LEVEL, STROBE, TRIGGER, STATE, OFF, PRESSES = range(1, 8)
OUT, IN = 0x40, 0xC0  # vendor request to the device, from the host and to it
MAGIC, VERSION = b"TPB", 1
TRIAL_BOARD = (0x1209, 0x0001)  # VID and PID that pid.codes gives to all trials
PATIENCE = 500  # ms for an answer
FULL = 1000  # per mille
LONGEST = 2**32 * 1e-6  # s


@dataclass(frozen=True)
class BoardState:
    """Pulses given and missed since the board was opened, and its own clock, s."""

    given: int
    missed: int
    time: float


class UsbBoard:
    """An open board; use `open_board`.

    Attributes
    ----------
    outputs : int
        Number of its outputs.

    Raises
    ------
    OSError
        By each request: if the board was unplugged, does not answer or refuses.
    ValueError
        By each request: if a number does not fit the board.
    """

    def __init__(self, device: Opened, name: str):
        self._device, self._name = device, name
        magic, version, self.outputs = struct.unpack("<3sBB3x", self._ask(IDENTIFY, 8))
        if (magic, version) != (MAGIC, VERSION):
            raise OSError(
                f"{name} is no board of protocol version {VERSION}; flash its firmware or name"
                " another device"
            )

    def light(self, output: int, level: float) -> None:
        """Light an output steadily, from 0 to 1."""
        if not 0 <= level <= 1:
            raise ValueError(f"level must lie in 0..1, got {level:g}; give 1 for full light")
        self._report(LEVEL, output, value=round(level * FULL))

    def strobe(self, output: int, delay: float, width: float) -> None:
        """Give a pulse of `width` s, `delay` s after each frame trigger; width 0 gives none."""
        self._report(STROBE, output, _microseconds(delay=delay, width=width))

    def trigger(self, output: int, period: float, width: float, count: int = 0) -> None:
        """Give `count` pulses of `width` s, one each `period` s; 0 goes on until `off`."""
        if not 0 < width < period:
            raise ValueError(
                f"trigger width must lie between 0 and its period, got {width:g} s of {period:g} s;"
                " a tenth of the period is a fair width"
            )
        if not 0 <= count < 2**32:
            raise ValueError(f"count must lie in 0..4294967295, got {count}; 0 is for ever")
        times = _microseconds(period=period, width=width)
        self._report(TRIGGER, output, times + struct.pack("<I", count))

    def state(self) -> BoardState:
        """Ask how many pulses were given and missed."""
        given, missed, time = struct.unpack("<III", self._ask(STATE, 12))
        return BoardState(given, missed, time * 1e-6)

    def presses(self, switch: int) -> int:
        """Ask how often an input's switch was pressed; after 2³² - 1 the count goes on at 0."""
        (count,) = struct.unpack("<I", self._ask(PRESSES, 4, switch))
        return count

    def off(self) -> None:
        """Make all outputs dark and still."""
        self._report(OFF, 0)

    def _report(self, request: int, output: int, data: bytes = b"", value: int = 0) -> None:
        if not 0 <= output < self.outputs:
            raise ValueError(
                f"output must lie in 0..{self.outputs - 1}, got {output}; the board has"
                f" {self.outputs}"
            )
        with faults(self._name):
            self._device.ctrl_transfer(OUT, request, value, output, data, PATIENCE)

    def _ask(self, request: int, length: int, index: int = 0) -> bytes:
        with faults(self._name):
            answer = bytes(self._device.ctrl_transfer(IN, request, 0, index, length, PATIENCE))
        if len(answer) != length:
            raise OSError(f"{self._name} answered {len(answer)} bytes of {length}; reset it")
        return answer


@contextmanager
def open_board(device: UsbDevice, backend: IBackend | None = None) -> Generator[UsbBoard]:
    """Open a board; its outputs are off when the block ends, where it still listens.

    Raises
    ------
    OSError
        If it is not there, may not be used, or is no such board.
    """
    found = find_device(device, backend)
    try:
        board = UsbBoard(found, device.label)
        try:
            yield board
        finally:
            with suppress(OSError):  # unplugged: it has gone dark by itself
                board.off()
    finally:
        usb.util.dispose_resources(found)


def _microseconds(**times: float) -> bytes:
    """Two durations as the board counts them."""
    for name, time in times.items():
        if not 0 <= time < LONGEST:
            raise ValueError(f"{name} must lie in 0..4294 s, got {time:g} s; give it in seconds")
    return struct.pack("<II", *(round(time * 1e6) for time in times.values()))
