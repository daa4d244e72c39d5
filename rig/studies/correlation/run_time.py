"""Correlation: subset, step, order and smoothing against error and time, peers beside.

Parts: settings. Pictures of 512², exactly rendered, noise of 2 grey levels in both; peers stand
beside where they are installed (extra ``peers``; OpenCV is always there).
"""

from collections.abc import Iterator

import cv2

from rig.report.figure import Figure
from rig.studies.correlation import settings as dic_settings
from rig.studies.study import line, run

TABLES = {
    "shift": "Correlation of a rigid shift",
    "waves": f"Correlation of waves of {dic_settings.LENGTH:.0f} px, 0.5 px high",
}


def settings() -> Iterator[Figure]:
    """Measure every setting once, and tell it for both motions."""
    cv2.setNumThreads(1)
    measured = list(dic_settings.measure(dic_settings.pictures()))
    for motion, table in TABLES.items():
        for one in measured:
            yield from line(
                table,
                named(one),
                time=(f"{one.from_nothing:.1f}", "ms a pair"),
                next_frame=(f"{one.next_frame:.1f}", "ms"),
                error=(f"{1e3 * getattr(one, motion):.2f}", "mpx, rms"),
                points=str(one.points),
                interpolation=one.interpolation,
            )


def named(one: dic_settings.Line) -> str:
    """Name a setting."""
    name = f"{one.code} {one.subset}/{one.step}, order {one.order}"
    if one.window != "-":
        name += f", smoothed {one.window}"
    return name + " (default)" * (name == "ours 21/5, order 1")


PARTS = {"settings": settings}

if __name__ == "__main__":
    run(PARTS, __doc__)
