"""The whole chain: what is correlated against error in mm and time a frame.

Parts: tiles, modes. The shipped twin, one touch of 2 to 4 N that wanders over the plate. CPU time
of one thread from a picture to its touches, median; the error is the root mean square of the place.
"""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from study import line, run

import fe
import rig
from rig import live
from rig.bench import build_bench
from rig.report.figure import Figure
from rig.stopwatch import Stopwatch
from rig.twin import build_twin
from rig.zero import take_zero

FRAMES, REFERENCE = 80, 16
TILES, MODES = (8, 16, 24, 32, 48), (50, 100, 200, 300)


def tiles() -> Iterator[Figure]:
    """From fine to coarse sums, and strain beside each."""
    for size in TILES:
        name = f"tiles of {size} px"
        yield from chain("Size of the tiles, 200 modes", name, {"dic.tile": size})
    yield from from_strain()


def modes() -> Iterator[Figure]:
    """From few to many modes of the plate."""
    for count in MODES:
        name = f"{count} modes"
        yield from chain("Modes of the plate, tiles of 16 px", name, {"estimator.modes": count})


def chain(table: str, name: str, settings: dict[str, Any]) -> Iterator[Figure]:
    """Time and errors of the whole pattern."""
    wandered = wander(settings)
    shipped = all(value in (16, 200) for value in settings.values())
    return told(table, name + " (default)" * shipped, wandered, "pattern")


def from_strain() -> Iterator[Figure]:
    """Time and errors of strain, which is taken after the whole pattern."""
    wandered = wander({})
    return told("Size of the tiles, 200 modes", "strain map, tiles of 16 px", wandered, "strain")


def told(table: str, name: str, wandered: dict[str, Any], way: str) -> Iterator[Figure]:
    """Make the line of one setting."""
    errors = wandered[way]
    place = np.sqrt(np.mean(np.sum(errors[:, :2] ** 2, axis=1)))
    return line(
        table,
        name,
        time=(f"{wandered[way + ' ms']:.1f}", "ms"),
        error=(f"{place:.3f}", "mm"),
        force=(f"{100 * np.sqrt(np.mean(errors[:, 2] ** 2)):.2f}", "% rms"),
        points=f"{wandered['points']}",
        found=f"{len(errors)} of {FRAMES}",
    )


def wander(settings: dict[str, Any]) -> dict[str, Any]:
    """Follow a touch over the plate; errors (n, 3) in mm and of the force, relative, by way."""
    scene = rig.load("twin", settings)
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    zero = take_zero([twin.frame(n, ()) for n in range(REFERENCE)])
    chain, of_strain = bench.prepare(zero)
    state, watch = live.at_rest(chain), Stopwatch(time.process_time)
    found: dict[str, list] = {"pattern": [], "strain": []}
    for n in range(FRAMES):
        touch = wandering(n / FRAMES, bench.plate.size)
        image = twin.frame(1000 + n, (touch,))
        with watch.stage("pattern"):
            sensed = live.sense(chain, image, state, watch)
        with watch.stage("strain on top"):
            sensed = live.with_strain(of_strain, sensed, watch)
        state = sensed.state
        for way, estimate in (("pattern", sensed.estimate), ("strain", sensed.from_strain)):
            if estimate is not None and estimate.count == 1:
                x, y = estimate.xy[0]
                found[way].append((x - touch.x, y - touch.y, estimate.force[0] / touch.force - 1))
    whole, more = watch.quantiles("pattern")[0], watch.quantiles("strain on top")[0]
    return {
        **{way: np.array(errors).reshape(-1, 3) for way, errors in found.items()},
        "pattern ms": whole,
        "strain ms": whole + more,
        "points": len(chain.reference.hessian),
    }


def wandering(share: float, size: tuple[float, float]) -> fe.Touch:
    """Press on a closed curve through the inner plate."""
    turn = 2 * np.pi * share
    x = size[0] * (0.5 + 0.33 * np.sin(2 * turn))
    y = size[1] * (0.5 + 0.33 * np.cos(3 * turn))
    return fe.Touch(x, y, 3.0 + np.sin(5 * turn))


PARTS = {"tiles": tiles, "modes": modes}

if __name__ == "__main__":
    run(PARTS, __doc__)
