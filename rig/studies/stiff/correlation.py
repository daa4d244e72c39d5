"""Correlation under bad light, large motion and bad input; `table` runs it."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

import dic
from rig.report.figure import Figure, at_most
from rig.studies.correlation.bars import NOISE, SIDE, SIGMAS, deviations, spoilt_frames
from rig.studies.correlation.images import displacement, eight_bit, speckle
from rig.studies.stiff.case import case, refused
from rig.studies.study import rms

SHIFT = (0.4, 0.2)  # px
BUSY = (100.0, -70.0)  # px
BAR = at_most(SIGMAS)  # of the valid point that is off most


def correlation() -> Iterator[Figure]:
    """Frames that a bench spoils, motion that is large, input that is wrong."""
    rng, plain, moved = np.random.default_rng(106), speckle(SIDE), speckle(SIDE, SHIFT)
    for name, before, after, noise in spoilt_frames(plain, moved):
        first, second = (eight_bit(i, noise, rng) for i in (before, after))
        yield from compared(f"correlation, {name}", first, second, SHIFT)
    far = eight_bit(speckle(SIDE, BUSY), NOISE, rng)
    yield from compared("correlation, shift of 122 px", eight_bit(plain, NOISE, rng), far, BUSY)
    yield from bad_input(plain)


def compared(
    name: str, first: np.ndarray, second: np.ndarray, shift: tuple[float, float]
) -> Iterator[Figure]:
    """Error of the valid points, and what is said of the others."""
    field = dic.correlate(dic.prepare(first), second)
    truth = displacement(SIDE, field.xy, shift)
    off, beyond = deviations(field, truth)
    lost = Counter(dic.Status(s).name.lower().replace("_", " ") for s in field.status)
    lost.pop("ok", None)
    said = ", ".join(f"{count} {status}" for status, count in lost.most_common(3))
    reason, seen = f"{len(field.xy)} points", "none valid"
    if len(off):
        seen = f"{1e3 * rms(off):.1f} mpx rms, {field.valid.mean():.1%} valid"
    worst = float(beyond.max(initial=0.0))
    return case(name, reason, worst, "σ at most", BAR, seen=seen, said=said)


def bad_input(plain: np.ndarray) -> Iterator[Figure]:
    """Give what cannot be correlated: it is refused by a sentence."""
    image = eight_bit(plain)
    holed = image.astype(float)
    holed[100:110, 100:110] = np.nan
    for name, act in (
        ("image without texture", lambda: dic.prepare(np.full((SIDE, SIDE), 128, np.uint8))),
        ("image with NaN", lambda: dic.prepare(holed)),
        ("frame of another size", lambda: dic.correlate(dic.prepare(image), image[:-2])),
        ("even subset", lambda: dic.prepare(image, subset=20)),
        ("ROI that leaves nothing", lambda: dic.prepare(image, roi=np.zeros((SIDE, SIDE), bool))),
    ):
        yield from refused(f"correlation, {name}", "wrong input", act)
