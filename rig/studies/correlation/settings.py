"""Error of correlation against its run time, setting by setting, ours and those of its peers.

Peers stand beside ours where they are installed (extra ``peers``: pyvale, al-dic; OpenCV's PyrLK is
always there). CPU times are of one thread and the median of some runs.
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import dic
import synthetic
from rig.studies.correlation.peers import Peer, al_dic_field, pyramid, pyvale_field
from rig.studies.study import cpu_seconds
from synthetic import closed_forms

SIDE, SCALE, NOISE = 512, 0.25, 2.0  # px, mm per px, grey levels
BORDER = 45  # px, kept by every window of subsets
SIZE = (SIDE * SCALE, SIDE * SCALE)
CAMERA = synthetic.telecentric_above(SIZE, (SIDE, SIDE), 0.0)
SHIFT, AMPLITUDE, PERIODS = (0.4, -0.3), (0.5, 0.4), (110.0, 140.0)  # px
MOTIONS = {
    "shift": closed_forms.Polynomial(((SHIFT[0] * SCALE,),), ((SHIFT[1] * SCALE,),)),
    "waves": closed_forms.Wave(
        (AMPLITUDE[0] * SCALE, AMPLITUDE[1] * SCALE),
        (1 / PERIODS[0] / SCALE, 1 / PERIODS[1] / SCALE),
    ),
}
LENGTH = 1 / np.hypot(1 / PERIODS[0], 1 / PERIODS[1])  # px, of the waves
SUBSETS, STEPS = (11, 15, 21, 31, 41), (2, 3, 10, 20)
SMOOTHED = ((11, 9), (15, 7), (15, 9), (15, 11), (21, 9))  # subset, window


@dataclass(frozen=True)
class Line:
    """One setting of one code: times in ms, errors in px (root mean square of both components)."""

    code: str
    subset: int
    step: int
    order: str
    window: str
    interpolation: str
    points: int
    from_nothing: float
    next_frame: float
    shift: float
    waves: float


def pictures() -> dict[str, NDArray]:
    """Take the reference and both motions, exactly rendered."""
    rng, sensor = np.random.default_rng(0), synthetic.Sensor(noise=NOISE)
    pattern = synthetic.speckle(SIZE)
    moved = {"rest": None} | MOTIONS
    return {k: synthetic.render(pattern, CAMERA, m, sensor, rng) for k, m in moved.items()}


def error(name: str, xy: NDArray, moved: NDArray) -> float:
    """Root mean square of what was measured less the truth, px, away from the border."""
    inside = np.all((xy >= BORDER) & (xy <= SIDE - 1 - BORDER), axis=1)
    inside &= np.isfinite(moved).all(axis=1)
    places = CAMERA.on_plate(xy[inside], 0.0)
    truth = synthetic.motion(CAMERA, places, MOTIONS[name](places), 0.0)
    return float(np.sqrt(np.mean((moved[inside] - truth) ** 2)))


def measure(seen: dict[str, NDArray]) -> Iterator[Line]:
    """Run every setting of ours and of the peers."""
    for order in (0, 1, 2):
        for subset in SUBSETS:
            yield ours(seen, subset, 5, order)
    for step in STEPS:
        yield ours(seen, 21, step, 1)
    for subset, window in SMOOTHED:
        yield ours(seen, subset, 5, 1, window)
    for window in (15, 21, 31):
        yield pyrlk(seen, window)
    yield from full_field_peers(seen)


def ours(seen, subset: int, step: int, order: int, window: int | None = None) -> Line:
    """Correlate, and smooth if a window is given."""

    def field(ref, frame, guess=None):
        disp = dic.correlate(ref, frame, guess)
        return disp, disp if window is None else dic.smooth(disp, window)

    ref = dic.prepare(seen["rest"], subset, step, order)
    last, _ = field(ref, seen["waves"])
    errors = []
    for name in MOTIONS:
        _, found = field(ref, seen[name])
        errors.append(error(name, found.xy, np.column_stack([found.u, found.v])))
    first = timed(lambda: field(dic.prepare(seen["rest"], subset, step, order), seen["waves"]))
    further = timed(lambda: field(ref, seen["waves"], last))
    smoothed = "-" if window is None else f"{window}, degree 4"
    setting = "ours", subset, step, str(order), smoothed, "quintic"
    return Line(*setting, len(ref.xy), first, further, *errors)


def pyrlk(seen, window: int) -> Line:
    """OpenCV's tracker at the points of a grid of step 5."""
    xy = dic.prepare(seen["rest"], 21).xy
    errors = [error(name, xy, pyramid(seen["rest"], seen[name], xy, window)) for name in MOTIONS]
    taken = timed(lambda: pyramid(seen["rest"], seen["waves"], xy, window))
    setting = "PyrLK", window, 5, "0", "-", "linear"
    return Line(*setting, len(xy), taken, taken, *errors)


def full_field_peers(seen) -> Iterator[Line]:
    """Run pyvale and al-dic where they are installed; each call does all of the work."""
    codes: tuple[tuple[str, int, int, str, str, Callable[..., Peer | None]], ...] = (
        ("pyvale", 21, 5, "1", "its own", lambda a, b: pyvale_field(a, b, 1)),
        ("pyvale", 21, 5, "2", "its own", lambda a, b: pyvale_field(a, b, 2)),
        ("al-dic, local", 20, 4, "1", "its own", al_dic_field),
    )
    for code, subset, step, order, interpolation, run in codes:
        found = [run(seen["rest"], seen[name]) for name in MOTIONS]
        if found[0] is None:
            continue
        errors = [error(n, f.xy, f.moved) for n, f in zip(MOTIONS, found, strict=True)]
        taken, points = 1e3 * found[-1].timing[0], len(found[0].xy)
        setting = code, subset, step, order, "-", interpolation
        yield Line(*setting, points, taken, taken, *errors)


def timed(work: Callable[[], object]) -> float:
    """Median CPU time of five runs after a first, ms."""
    work()
    return 1e3 * cpu_seconds(work, 5)
