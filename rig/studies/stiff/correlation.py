"""Correlation under bad light, large motion and bad input; `study_stiff.py` runs it."""

from collections import Counter
from collections.abc import Iterator

import numpy as np

import dic
from rig.report.figure import Figure
from rig.studies.correlation.bars import NOISE, SIDE, hard_frames
from rig.studies.correlation.images import displacement, eight_bit, speckle
from rig.studies.stiff.case import case, refused

SHIFT = (0.4, 0.2)  # px
BUSY = (100.0, -70.0)  # px
SIGMAS, BAR = 6.0, "no valid point off by more than 6 σ"


def correlation() -> Iterator[Figure]:
    """Frames that a bench spoils, motion that is large, input that is wrong."""
    rng, plain, moved = np.random.default_rng(106), speckle(SIDE), speckle(SIDE, SHIFT)
    for name, before, after, noise in hard_frames(plain, moved, rng):
        first, second = (eight_bit(i, noise, rng) for i in (before, after))
        yield from compared(f"correlation, {name}", first, second, SHIFT)
    far = eight_bit(speckle(SIDE, BUSY), NOISE, rng)
    yield from compared("correlation, shift of 122 px", eight_bit(plain, NOISE, rng), far, BUSY)
    yield from bad_input(plain)


def compared(
    name: str, first: np.ndarray, second: np.ndarray, shift: tuple[float, float]
) -> Iterator[Figure]:
    """Error of the valid points, and what the others are told."""
    field = dic.correlate(dic.prepare(first), second)
    truth = displacement(SIDE, field.xy, shift)
    off = (np.column_stack([field.u, field.v]) - truth)[field.valid]
    sigma = np.column_stack([field.sigma_u, field.sigma_v])[field.valid]
    lost = Counter(dic.Status(s).name.lower().replace("_", " ") for s in field.status)
    lost.pop("ok", None)
    told = ", ".join(f"{count} {status}" for status, count in lost.most_common(3))
    reason = f"{len(field.xy)} points"
    if not len(off):
        return case(name, reason, "none valid", told, bar=BAR, met=True)
    worst = float(np.abs(off / sigma).max())
    right = (
        f"{1e3 * np.sqrt(np.mean(off**2)):.1f} mpx rms, worst {worst:.1f} σ, "
        f"{field.valid.mean():.1%} valid"
    )
    return case(name, reason, right, told, bar=BAR, met=worst <= SIGMAS)


def bad_input(plain: np.ndarray) -> Iterator[Figure]:
    """Give what cannot be correlated: it is refused by a sentence."""
    picture = eight_bit(plain)
    holed = picture.astype(float)
    holed[100:110, 100:110] = np.nan
    for name, act in (
        ("picture without texture", lambda: dic.prepare(np.full((SIDE, SIDE), 128, np.uint8))),
        ("picture with NaN", lambda: dic.prepare(holed)),
        ("frame of another size", lambda: dic.correlate(dic.prepare(picture), picture[:-2])),
        ("even subset", lambda: dic.prepare(picture, subset=20)),
        ("ROI that leaves nothing", lambda: dic.prepare(picture, roi=np.zeros((SIDE, SIDE), bool))),
    ):
        yield from refused(f"correlation, {name}", "wrong input", act)
