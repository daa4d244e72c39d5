"""A board at work beside a loop: a thread of its own asks it and lights it, so no frame waits."""

from __future__ import annotations

import threading

from rig.usb.board import UsbBoard

PAUSE = 0.02  # s from one request to the next: a press is noted before the next frame
ROUND = 2**32  # at which the board begins to count anew


class BoardLink:
    """Use it as a context.

    Parameters
    ----------
    board : UsbBoard
    lamp : int or None
        Output that `light` sets; None for none.
    switch : int or None
        Input of a foot switch; None for none.

    Attributes
    ----------
    trouble : str
        Why the board does not work any more, as a sentence; empty while it does.

    Raises
    ------
    OSError
        If the board has no such input.
    """

    def __init__(self, board: UsbBoard, lamp: int | None = None, switch: int | None = None):
        self.trouble = ""
        self._board, self._lamp, self._switch = board, lamp, switch
        self._wanted = self._lit = 0.0
        self._counted = 0 if switch is None else board.presses(switch)
        self._taken = self._counted
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._work, name="board", daemon=True)

    def __enter__(self) -> BoardLink:
        """Work while the block runs, where there is something to do."""
        if self._lamp is not None or self._switch is not None:
            self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        """End the thread; the request that is under way ends first."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()

    def light(self, level: float) -> None:
        """Light the lamp from 0 to 1, at once; the newest wish counts."""
        self._wanted = level

    def pressed(self) -> int:
        """Give how often the switch was pressed since this was last asked."""
        counted = self._counted
        new = (counted - self._taken) % ROUND
        self._taken = counted
        return new

    def _work(self) -> None:
        """Body of the thread: ends with the block, or when the board has gone."""
        try:
            while not self._ending.wait(PAUSE):
                wanted = self._wanted
                if self._lamp is not None and wanted != self._lit:
                    self._board.light(self._lamp, wanted)
                    self._lit = wanted
                if self._switch is not None:
                    self._counted = self._board.presses(self._switch)
        except OSError as error:
            self.trouble = str(error)
