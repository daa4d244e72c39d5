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
from rig.report.figure import Figure
from rig.studies.correlation.images import eight_bit, speckle
from rig.studies.correlation.peers import pyramid, pyvale_field
from rig.studies.study import line, run
from rig.studies.touches.strain import INFLUENCE, UNIT, draw

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
        off = np.std(last.u - SHIFT[0])
        other = np.std(pyramid(first, second, places[:count])[:, 0] - SHIFT[0])
        name = f"{count} points tracked, 1024², subset {SUBSET}: OpenCV's PyrLK"
        yield from beside(name, ours, theirs, 1.0, f"{1e3 * off:.1f}", f"{1e3 * other:.1f}", "mpx")
    first, second = (eight_bit(speckle(512, s), NOISE, rng) for s in ((0.0, 0.0), SHIFT))
    peer = pyvale_field(first, second, 1)
    if peer:
        ours = seconds(lambda: dic.correlate(dic.prepare(first), second), 9)
        off = np.nanstd(dic.correlate(dic.prepare(first), second).u)
        other = np.nanstd(peer.moved[:, 0])
        name = "full field, 512², subset 21, step 5: pyvale"
        limit, errors = 1 / 25, (f"{1e3 * off:.1f}", f"{1e3 * other:.1f}", "mpx")
        yield from beside(name, ours, peer.timing[0], limit, *errors)


def solver() -> Iterator[Figure]:
    """Compare a tracked frame of 72 gauges with SciPy's least squares on the same model."""
    forward = models.gauges(INFLUENCE, STRAIN_NOISE)
    search = models.prepare_search(forward)
    for count in (1, 4):
        rng, spent, errors = np.random.default_rng(count), ([], []), ([], [])
        for scene in range(SCENES):
            touches = draw(rng, count)
            exact = forward.read(touches)[0]
            white = exact + rng.normal(size=exact.shape)
            start = touches + rng.normal(0, (0.3, 0.3, 0.05), touches.shape)
            for k, solve in enumerate((ours, by_scipy)):
                began = time.perf_counter()
                found = solve(white, start, search)
                if scene >= 5:
                    spent[k].append(time.perf_counter() - began)
                    errors[k].append(np.linalg.norm(found[:, :2] - touches[:, :2], axis=1).max())
        mine, theirs = (float(np.median(part)) for part in spent)
        off, other = (float(np.median(part)) for part in errors)
        name = f"{count} touches tracked, 72 gauges: scipy.optimize.least_squares"
        yield from beside(name, mine, theirs, 1.0, f"{off:.4f}", f"{other:.4f}", "mm")


def ours(white, start, search):
    """Solve as the loop does."""
    found = models.find(white, search, start=start, count=len(start))
    order = np.linalg.norm(start[:, None, :2] - found.xy[None], axis=2).argmin(axis=1)
    return np.column_stack([found.xy, found.force])[order]


def by_scipy(white, start, search):
    """Solve with the same model and derivatives by Levenberg and Marquardt of MINPACK."""

    def model(unknowns):
        return search.forward.read(unknowns.reshape(-1, 3))

    found = least_squares(
        lambda x: model(x)[0] - white, start.ravel(), lambda x: model(x)[1].T, method="lm"
    )
    return found.x.reshape(-1, 3)


def seconds(work: Callable[[], object], repeats: int) -> float:
    """Median CPU time after one warm-up, s."""
    work()
    taken = []
    for _ in range(repeats):
        began = time.process_time()
        work()
        taken.append(time.process_time() - began)
    return float(np.median(taken))


def beside(name, mine, theirs, most, error, other, unit) -> Iterator[Figure]:
    """Make the line of one comparison."""
    ratio, *rest = line(
        TABLE,
        name,
        ratio=f"{mine / theirs:.3f}",
        ours=(f"{1e3 * mine:.3g}", "ms"),
        theirs=(f"{1e3 * theirs:.3g}", "ms"),
        our_error=(error, unit),
        their_error=(other, unit),
    )
    yield ratio._replace(bar=f"≤ {most:g}", verdict="met" if mine <= most * theirs else "missed")
    yield from rest


PARTS = {"correlation": correlation, "solver": solver}

if __name__ == "__main__":
    run(PARTS, __doc__)
