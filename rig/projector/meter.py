"""The interference meter: measures in frames what is left of the projector's light, once a second.

It works in a thread of its own, and never holds the loop.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np

from rig.live.beside import failure
from rig.live.chain import Chain
from rig.live.snapshot import Snapshot
from rig.projector.content import Content, draw
from rig.projector.interference import interference, leftover
from rig.projector.light_map import prepare_light_map
from rig.projector.markers import Screen

PAUSE = 1.0  # s


class Meter:
    """Feed it with snapshots; read `sentence`. Use it as a context.

    Parameters
    ----------
    screen : Screen
    black : float, grey levels
        What a pixel of the camera reads without any light.

    Attributes
    ----------
    sentence : str
        What the light does to the touches, for the user; empty where it does no harm.
    """

    def __init__(self, screen: Screen, black: float = 0.0):
        self.sentence = ""
        self._screen, self._black = screen, black
        self._pool = ThreadPoolExecutor(1, "meter")
        self._due = -np.inf
        self._work: Future[str] | None = None

    def __enter__(self) -> Meter:
        """Measure while the block runs."""
        return self

    def __exit__(self, *error: object) -> None:
        """End the thread."""
        self._pool.shutdown(cancel_futures=True)

    def measure(self, snapshot: Snapshot, shown: Content, chain: Chain) -> None:
        """Take a snapshot to measure, if the last one is done with and a second is over.

        Parameters
        ----------
        snapshot : Snapshot
        shown : Content
            What the projector showed meanwhile.
        chain : Chain
        """
        if self._work and self._work.done():
            self._say(self._work)
            self._work = None
        if self._work or snapshot.captured < self._due or not snapshot.fresh:
            return
        self._due = snapshot.captured + PAUSE
        self._work = self._pool.submit(self._sentence, snapshot, shown, chain)

    def _say(self, work: Future[str]) -> None:
        """Take what was measured; after a failure nothing more is."""
        if why := failure("the interference meter", work):
            self.sentence, self._due = f"the projector's light is no longer measured: {why}", np.inf
        else:
            self.sentence = work.result()

    def _sentence(self, snapshot: Snapshot, shown: Content, chain: Chain) -> str:
        if shown == () or not snapshot.touches:
            return ""
        height, width = snapshot.image.shape
        whole = prepare_light_map(
            self._screen, snapshot.T_px_plate.astype(np.float64), (width, height), 1.0
        )
        light = whole.on_camera(draw(shown, self._screen)) - 1
        left = leftover(snapshot.image, chain.reference.image, light, self._black)
        found = interference(chain, 1 + left * light, self._black, snapshot.touches)
        return found.sentence
