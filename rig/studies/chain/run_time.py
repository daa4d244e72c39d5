"""The whole chain: what is correlated against error in mm and time a frame.

Parts: tiles, hand, modes, edge. One touch of 2 to 4 N wanders over the plate of the shipped twin.
Times are of one thread's processor, from a picture to its touches, median; the error is the root
mean square of the place.
"""

import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import fe
import rig
from rig.live import chain as live
from rig.live.baseline import take_zero
from rig.live.bench import build_bench
from rig.report.figure import Figure
from rig.sources.twin import build_twin
from rig.studies.study import line, run
from rig.system.timing import Stopwatch
from synthetic import Hand

Path = Callable[[float, tuple[float, float]], fe.Touch]
Cover = Callable[[np.ndarray, fe.Touch], np.ndarray]

FRAMES, REFERENCE = 80, 16
PIXELS, MIDDLE, SCALE = 1024, 127.0, 3.2  # side, px; of the plate, mm; about px per mm
NEAR = 16.0  # mm from an edge
TILES, MODES = (8, 16, 24, 32, 48), (50, 100, 200, 300)


def tiles() -> Iterator[Figure]:
    """From fine to coarse sums, and strain beside each."""
    for size in TILES:
        name = f"tiles of {size} px"
        yield from chain("Size of the tiles, 200 modes", name, {"dic.tile": size})
    yield from from_strain()


def hand() -> Iterator[Figure]:
    """Press with an arm in the picture."""
    for size in (16, 32, 48):
        wandered = wander({"dic.tile": size}, arm)
        name = f"tiles of {size} px" + " (default)" * (size == 16)
        yield from told("Size of the tiles, an arm over a tenth of the pattern", name, wandered)


def modes() -> Iterator[Figure]:
    """From few to many modes of the plate."""
    for count in MODES:
        name = f"{count} modes"
        yield from chain("Modes of the plate, tiles of 16 px", name, {"estimator.modes": count})


def edge() -> Iterator[Figure]:
    """Press along the edges: what the higher modes are for."""
    for count in MODES:
        wandered = wander({"estimator.modes": count}, path=along_edges)
        name = f"{count} modes" + " (default)" * (count == 200)
        yield from told(f"Modes of the plate, touches {NEAR:g} mm from an edge", name, wandered)


def chain(table: str, name: str, settings: dict[str, Any]) -> Iterator[Figure]:
    """Time and errors of the whole pattern."""
    wandered = wander(settings)
    shipped = all(value in (16, 200) for value in settings.values())
    return told(table, name + " (default)" * shipped, wandered)


def from_strain() -> Iterator[Figure]:
    """Time and errors of strain, which is taken after the whole pattern."""
    wandered = wander({})
    return told("Size of the tiles, 200 modes", "strain map, tiles of 16 px", wandered, "strain")


def told(table: str, name: str, wandered: dict[str, Any], way: str = "pattern") -> Iterator[Figure]:
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


def wander(
    settings: dict[str, Any], cover: Cover = lambda image, touch: image, path: Path | None = None
) -> dict[str, Any]:
    """Follow a touch over the plate; errors (n, 3) in mm and of the force, relative, by way."""
    scene = rig.load("twin", settings)
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    zero = take_zero([twin.frame(n, ()) for n in range(REFERENCE)])
    chain, of_strain = bench.prepare(zero)
    state, watch = live.at_rest(chain), Stopwatch(time.process_time)
    found: dict[str, list] = {"pattern": [], "strain": []}
    for n in range(FRAMES):
        touch = (path or wandering)(n / FRAMES, bench.plate.size)
        image = cover(twin.frame(1000 + n, (touch,)), touch)
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


def along_edges(share: float, size: tuple[float, float]) -> fe.Touch:
    """Press near each edge in turn."""
    side, part = divmod(4 * share, 1)
    x, y = (0.1 + 0.8 * part) * size[0], (0.1 + 0.8 * part) * size[1]
    places = (NEAR, y), (x, size[1] - NEAR), (size[0] - NEAR, y), (x, NEAR)
    return fe.Touch(*places[int(side)], 3.0 + np.sin(10 * np.pi * share))


def arm(image: np.ndarray, touch: fe.Touch) -> np.ndarray:
    """Put an arm into the picture that ends beside the touch and leaves at the right."""
    finger = PIXELS / 2 + (np.array([touch.x, touch.y]) - MIDDLE) * SCALE
    along, across = np.array([0.94, 0.33]), np.array([-0.33, 0.94])
    near, far = finger + 30.0 * along, finger + 1.5 * PIXELS * along
    corners = near - 40.0 * across, near + 40.0 * across, far + 70.0 * across, far - 70.0 * across
    covered = 255.0 * Hand(np.array(corners), 0.45).cover(image / 255.0)
    return np.rint(covered).clip(0, 255).astype(np.uint8)


PARTS = {"tiles": tiles, "hand": hand, "modes": modes, "edge": edge}

if __name__ == "__main__":
    run(PARTS, __doc__)
