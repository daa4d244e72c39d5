"""Against getting slower: run times over those of peers in the same run, never times alone.

Parts: correlation, solver. Each ratio is of medians of CPU time on one thread; the error of both
stands beside it.
"""

import time
from collections.abc import Callable, Iterator

import cv2
import numpy as np
from scipy.optimize import least_squares

import dic
import models
from models import CandidateGrid
from rig.report.figure import Figure, at_most
from rig.studies.correlation.images import eight_bit, speckle
from rig.studies.correlation.peers import pyramid, pyvale_field
from rig.studies.study import cpu_seconds, line, run
from rig.studies.touches.strain import INFLUENCE, UNIT, Touches, draw
from rig.system.arrays import F64, AnyArray

TABLE = "Run time over that of a peer, one thread, same run"
SHIFT = (0.4, 0.2)  # px
NOISE = 2.0  # grey levels
SUBSET = 31
STRAIN_NOISE = 0.01 * UNIT
SCENES = 60


def correlation() -> Iterator[Figure]:
    """Compare tracked points with the pyramid of Lucas and Kanade, a full field with pyvale."""
    cv2.setNumThreads(1)
    rng = np.random.default_rng(3)
    first, second = (eight_bit(speckle(1024, s), NOISE, rng) for s in ((0.0, 0.0), SHIFT))
    places = rng.uniform(40, 984, (400, 2))
    for count in (72, 400):
        ref = dic.prepare(first, SUBSET, points=places[:count])
        last = dic.correlate(ref, second, guess=np.tile(SHIFT, (count, 1)))
        ours = seconds(lambda r=ref, g=last: dic.correlate(r, second, guess=g), 31)
        theirs = seconds(lambda n=count: pyramid(first, second, places[:n]), 31)
        off = float(np.std(last.u - SHIFT[0]))
        other = float(np.std(pyramid(first, second, places[:count])[:, 0] - SHIFT[0]))
        name = f"{count} points tracked, 1024², subset {SUBSET}: OpenCV's PyrLK"
        yield from beside(name, (ours, theirs), 0.6, (1e3 * off, 1e3 * other), "mpx")
    first, second = (eight_bit(speckle(512, s), NOISE, rng) for s in ((0.0, 0.0), SHIFT))
    for order in (1, 2):
        yield from full_field(first, second, order)


def full_field(first: AnyArray, second: AnyArray, order: int) -> Iterator[Figure]:
    """Compare a full field of 512², preparation included, with pyvale."""

    def whole() -> dic.DisplacementField:
        return dic.correlate(dic.prepare(first, order=order), second)

    peer = pyvale_field(first, second, order)
    further = ", order 2" if order == 2 else ""
    yield from beside(
        f"full field, 512², subset 21, step 5{further}: pyvale",
        (seconds(whole, 9), peer and peer.seconds),
        1 / 25,
        (1e3 * float(np.nanstd(whole().u)), peer and 1e3 * float(np.nanstd(peer.moved[:, 0]))),
        "mpx",
    )


def solver() -> Iterator[Figure]:
    """Compare a tracked frame of 72 gauges with SciPy's least squares on the same model."""
    forward = models.gauge_forward(INFLUENCE, STRAIN_NOISE)
    search = models.prepare_candidates(forward)
    for count in (1, 4):
        rng = np.random.default_rng(count)
        spent: tuple[list[float], list[float]] = ([], [])
        errors: tuple[list[float], list[float]] = ([], [])
        for scene in range(SCENES):
            touches = draw(rng, count)
            exact = forward.read(touches)[0]
            white = exact + rng.normal(size=exact.shape)
            start = touches + rng.normal(0, (0.3, 0.3, 0.05), touches.shape)
            for k, solve in enumerate((by_us, by_scipy)):
                began = time.perf_counter()
                found = solve(white, start, search)
                if scene >= 5:
                    spent[k].append(time.perf_counter() - began)
                    off = np.linalg.norm(found[:, :2] - touches[:, :2], axis=1)
                    errors[k].append(float(off.max()))
        mine, theirs = (float(np.median(part)) for part in spent)
        off, other = (float(np.median(part)) for part in errors)
        name = f"{count} touches tracked, 72 gauges: scipy.optimize.least_squares"
        yield from beside(name, (mine, theirs), 1.0, (off, other), "mm")


def by_us(white: F64, start: Touches, search: CandidateGrid) -> Touches:
    """Solve as the loop does."""
    found = models.find(white, search, start=start, count=len(start))
    order = np.linalg.norm(start[:, None, :2] - found.xy[None], axis=2).argmin(axis=1)
    return np.column_stack([found.xy, found.force])[order]


def by_scipy(white: F64, start: Touches, search: CandidateGrid) -> Touches:
    """Solve with the same model and derivatives by Levenberg and Marquardt of MINPACK."""

    def residual(unknowns: F64) -> F64:
        return search.forward.read(unknowns.reshape(-1, 3))[0] - white

    def jacobian(unknowns: F64) -> F64:
        return search.forward.read(unknowns.reshape(-1, 3))[1].T

    found = least_squares(residual, start.ravel(), jacobian, method="lm")  # pyright: ignore[reportArgumentType]
    return found.x.reshape(-1, 3)


def seconds(work: Callable[[], object], repeats: int) -> float:
    """Median CPU time after one warm-up, s."""
    work()
    return cpu_seconds(work, repeats)


def beside(
    name: str,
    times: tuple[float, float | None],
    longest: float,
    errors: tuple[float, float | None],
    unit: str,
) -> Iterator[Figure]:
    """Make the line of one comparison: ours and theirs, times in s; None where not installed."""
    ours, theirs = times
    return line(
        TABLE,
        name,
        ratio=(theirs and ours / theirs, "", at_most(longest)),
        ours=(1e3 * ours, "ms"),
        theirs=(theirs and 1e3 * theirs, "ms"),
        our_error=(errors[0], unit),
        their_error=(errors[1], unit),
    )


PARTS = {"correlation": correlation, "solver": solver}

if __name__ == "__main__":
    run(PARTS, __doc__)
