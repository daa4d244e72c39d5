"""Correlation: subset, step, order and smoothing against error and time, peers beside.

Parts: settings, or some of them. Images of 512², exactly rendered, noise of 2 grey levels in both;
peers stand beside where they are installed (extra ``peers``; OpenCV is always there).
"""

from collections.abc import Callable, Iterator
from functools import partial

import cv2

from rig.report.figure import Figure
from rig.studies.correlation.settings import LENGTH, Images, Measured, every, images, some
from rig.studies.study import line, run

TABLES = {
    "shift": "Correlation of a rigid shift",
    "waves": f"Correlation of waves of {LENGTH:.0f} px, 0.5 px high",
}


def settings(choose: Callable[[Images], Iterator[Measured]]) -> Iterator[Figure]:
    """Measure every setting once, and tell it for both motions."""
    cv2.setNumThreads(1)
    measured = list(choose(images()))
    for motion, table in TABLES.items():
        for one in measured:
            yield from line(
                table,
                one.setting.name,
                time=(1e3 * one.from_nothing, "ms a pair"),
                next_frame=(1e3 * one.next_frame, "ms"),
                error=(1e3 * one.errors[motion], "mpx, rms"),
                points=one.points,
                interpolation=one.setting.interpolation,
            )


PARTS = {"settings": partial(settings, every), "some": partial(settings, some)}

if __name__ == "__main__":
    run(PARTS, __doc__)
