"""`touchplate` with a twin that is pressed or covered as a case of `first_minute` says.

    python rig/studies/start/pressed_twin.py CASE WORD ...
    python rig/studies/start/pressed_twin.py CASE alone FRAMES

The words are those of the command line; *alone* grabs frames and does nothing with them, and prints
how many the twin left out. The twin's process runs this file again, as every process that is
started afresh does, and so has the same case.
"""

import sys
from collections.abc import Iterator
from itertools import islice

import numpy as np
from numpy.typing import NDArray

import fe
from rig.sources import script
from rig.sources.script import STILL
from rig.sources.twin import Twin

PLACES = ((0.31, 0.28), (0.66, 0.71), (0.27, 0.74), (0.72, 0.33))
TOUCHES = {"touch": 1, "two": 2, "four": 4}
FORCE = 2.5  # N, which changes by a half of it
TURN, PAUSE = 3.0, 1.0  # s from one press to the next, and without a touch between
SKIN, WIDE = 90, 0.3  # grey levels of the hand, and its width as a fraction of the image
SWEEP = 8.0  # s that it takes to go over the plate and come again


def pressed(case: str, size: tuple[float, float]) -> script.Script:
    """Press at as many places as the case has, over and over, while they wander."""

    def touches(time: float) -> tuple[fe.Touch, ...]:
        age = time - STILL
        if age < 0 or age % TURN < PAUSE:
            return ()
        way = 0.08 * np.sin(age), 0.08 * np.cos(0.7 * age)
        force = FORCE * (1.0 + 0.5 * np.sin(2.0 * age))
        return tuple(
            fe.Touch(float((x + way[0]) * size[0]), float((y + way[1]) * size[1]), float(force))
            for x, y in PLACES[: TOUCHES.get(case, 0)]
        )

    return touches


class Covered(Twin):
    """A twin before which a hand goes to and fro."""

    def frame(
        self,
        sequence: int,
        touches: tuple[fe.Touch, ...],
        out: NDArray[np.uint8] | None = None,
    ) -> NDArray[np.uint8]:
        """See `Twin.frame`."""
        image = super().frame(sequence, touches, out)
        time = self.time(sequence) - STILL
        if time > 0:
            width = image.shape[1]
            left = int(width * ((time / SWEEP) % 1.0 * (1.0 + WIDE) - WIDE))
            image[:, max(left, 0) : max(left + int(WIDE * width), 0)] = SKIN
        return image


def prepare(case: str) -> None:
    """Put the case in the place of the tour."""
    script.tour = lambda size: pressed(case, size)
    if case == "hand":
        from rig.sources import twin

        twin.Twin = Covered


def numbers() -> Iterator[int]:
    """Grab frame after frame of the twin and give their numbers."""
    import rig
    from rig.sources.twin_source import open_twin

    with open_twin(rig.load("twin")) as source:
        source.begin()
        while True:
            if frame := source.grab(5.0):
                yield frame.sequence


if __name__ in ("__main__", "__mp_main__"):
    prepare(sys.argv[1])

if __name__ == "__main__":
    if sys.argv[2] == "alone":
        grabbed = list(islice(numbers(), int(sys.argv[3])))
        print(grabbed[-1] - grabbed[0] + 1 - len(grabbed))
    else:
        from rig.cli import main

        del sys.argv[1]
        main()
