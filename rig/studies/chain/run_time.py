"""The whole chain: what is correlated against error in mm and time a frame.

Parts: tiles, some (of the tiles), hand, modes, edge. One touch of 2 to 4 N wanders over the plate
of the shipped twin. Times are of one thread's processor, from an image to its touches, median; the
error is the root mean square of the place.
"""

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

import fe
import rig
from models import Estimate
from rig.live.baseline import average_reference
from rig.live.bench import build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.strain_chain import with_strain
from rig.report.figure import Figure
from rig.sources.twin import build_twin
from rig.studies.study import line, part, rms, run
from rig.system.timing import Stopwatch
from synthetic import Occluder

Path = Callable[[float, tuple[float, float]], fe.Touch]
Cover = Callable[[np.ndarray, fe.Touch], np.ndarray]

Way = Literal["pattern", "strain"]


class Wandered(NamedTuple):
    """Outcome of following a touch.

    Attributes
    ----------
    errors : dict of (n, 3)
        In x and y, mm, and of the force, relative, by way.
    times : dict of float, ms
        Of a frame, median, by way.
    points : int
        Tiles that were correlated.
    frames : int
        In which there was a touch.
    """

    errors: dict[Way, NDArray[np.float64]]
    times: dict[Way, float]
    points: int
    frames: int


FRAMES, REFERENCE = 80, 16
PIXELS, MIDDLE, SCALE = 1024, 127.0, 3.2  # side, px; of the plate, mm; about px per mm
NEAR = 16.0  # mm from an edge
TILES, MODES = (8, 16, 24, 32, 48), (50, 100, 200, 300)
SOME = (16, 32, 48)
TILE, MODE_COUNT = 16, 200
"""As shipped."""


def tiles(sizes: tuple[int, ...], frames: int) -> Iterator[Figure]:
    """From fine to coarse sums, and strain beside that of the default."""
    table = "Size of the tiles, 200 modes"
    for size in sizes:
        wandered, shipped = wander({"dic.tile": size}, frames=frames), size == TILE
        yield from scored(table, f"tiles of {size} px" + " (default)" * shipped, wandered)
        if shipped:
            yield from scored(table, f"strain map, tiles of {size} px", wandered, "strain")


def hand() -> Iterator[Figure]:
    """Press with an arm in the image."""
    for size in (16, 32, 48):
        wandered = wander({"dic.tile": size}, arm)
        name = f"tiles of {size} px" + " (default)" * (size == TILE)
        yield from scored("Size of the tiles, an arm over a tenth of the pattern", name, wandered)


def modes() -> Iterator[Figure]:
    """From few to many modes of the plate."""
    for count in MODES:
        wandered = wander({"estimator.modes": count})
        name = f"{count} modes" + " (default)" * (count == MODE_COUNT)
        yield from scored("Modes of the plate, tiles of 16 px", name, wandered)


def edge() -> Iterator[Figure]:
    """Press along the edges: what the higher modes are for."""
    for count in MODES:
        wandered = wander({"estimator.modes": count}, path=along_edges)
        name = f"{count} modes" + " (default)" * (count == MODE_COUNT)
        yield from scored(f"Modes of the plate, touches {NEAR:g} mm from an edge", name, wandered)


def scored(table: str, name: str, wandered: Wandered, way: Way = "pattern") -> Iterator[Figure]:
    """Make the line of one setting."""
    errors = wandered.errors[way]
    return line(
        table,
        name,
        time=(wandered.times[way], "ms"),
        error=(rms(np.hypot(errors[:, 0], errors[:, 1])), "mm"),
        force=(100 * rms(errors[:, 2]), "%, rms"),
        points=wandered.points,
        found=(100 * len(errors) / wandered.frames, "%", None, wandered.frames),
    )


def wander(
    settings: dict[str, Any],
    cover: Cover = lambda image, touch: image,
    path: Path | None = None,
    frames: int = FRAMES,
) -> Wandered:
    """Follow a touch over the plate."""
    scene = rig.load("twin", settings)
    bench, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    zero = average_reference([twin.frame(n, ()) for n in range(REFERENCE)])
    chain, of_strain = bench.prepare(zero)
    state, watch = at_rest(chain), Stopwatch(time.process_time)
    found: dict[Way, list[tuple[float, float, float]]] = {"pattern": [], "strain": []}
    for n in range(frames):
        touch = (path or wandering)(n / frames, bench.plate.size)
        image = cover(twin.frame(1000 + n, (touch,)), touch)
        with watch.stage("pattern"):
            sensed = estimate_frame(chain, image, state, watch)
        with watch.stage("strain on top"):
            sensed = with_strain(part(of_strain), sensed, watch)
        state = sensed.state
        estimates: dict[Way, Estimate | None] = {
            "pattern": sensed.estimate,
            "strain": sensed.from_strain,
        }
        for way, estimate in estimates.items():
            if estimate is not None and estimate.count == 1:
                x, y = estimate.xy[0]
                found[way].append((x - touch.x, y - touch.y, estimate.force[0] / touch.force - 1))
    whole, more = watch.quantiles("pattern")[0], watch.quantiles("strain on top")[0]
    return Wandered(
        {way: np.array(errors).reshape(-1, 3) for way, errors in found.items()},
        {"pattern": whole, "strain": whole + more},
        len(chain.reference.hessian),
        frames,
    )


def wandering(fraction: float, size: tuple[float, float]) -> fe.Touch:
    """Press on a closed curve through the inner plate."""
    turn = 2 * np.pi * fraction
    x = size[0] * (0.5 + 0.33 * np.sin(2 * turn))
    y = size[1] * (0.5 + 0.33 * np.cos(3 * turn))
    return fe.Touch(x, y, 3.0 + np.sin(5 * turn))


def along_edges(fraction: float, size: tuple[float, float]) -> fe.Touch:
    """Press near each edge in turn."""
    side, along = divmod(4 * fraction, 1)
    x, y = (0.1 + 0.8 * along) * size[0], (0.1 + 0.8 * along) * size[1]
    places = (NEAR, y), (x, size[1] - NEAR), (size[0] - NEAR, y), (x, NEAR)
    return fe.Touch(*places[int(side)], 3.0 + np.sin(10 * np.pi * fraction))


def arm(image: np.ndarray, touch: fe.Touch) -> np.ndarray:
    """Put an arm into the image that ends beside the touch and leaves at the right."""
    finger = PIXELS / 2 + (np.array([touch.x, touch.y]) - MIDDLE) * SCALE
    along, across = np.array([0.94, 0.33]), np.array([-0.33, 0.94])
    near, far = finger + 30.0 * along, finger + 1.5 * PIXELS * along
    corners = near - 40.0 * across, near + 40.0 * across, far + 70.0 * across, far - 70.0 * across
    covered = 255.0 * Occluder(np.array(corners), 0.45).cover(image / 255.0)
    return np.rint(covered).clip(0, 255).astype(np.uint8)


PARTS = {
    "tiles": partial(tiles, TILES, FRAMES),
    "some": partial(tiles, SOME, FRAMES // 2),
    "hand": hand,
    "modes": modes,
    "edge": edge,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
