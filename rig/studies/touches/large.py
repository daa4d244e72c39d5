"""Large touches in a frame of 1024²: place, force, count, what is stated of them, and time.

Parts: few, some and hundred (5, 20 and 100 scenes a cell: one or two touches of 0.5 to 5 N, on a
plate of 1 mm with four or two clamped edges), edges and edges_few (40 and 4 scenes a cell of one
touch near an edge), and uncertain (a tour of the scene `bench-real`).
Images are rendered from the geometrically exact shell, which no estimator knows; those of the tour
from the whole plate of von Kármán. A tracked frame follows one that was pressed a tenth less and
half a millimetre aside, a cold one follows the plate at rest. Places and forces are medians; times
are of one thread's processor, through all that the live loop does from the image to the touches.
One touch more than there are is looked for. An error over σ is that of frames with the right count
that are FOUND with all places within 10 mm; how many are left out of it is a figure of its own.
Near an edge an interval of force is that of the estimate where it has one, else force ± 2 σ.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np

import fe
import models
import rig
from models import Estimate, Result, covariance, match
from rig.calibration.store import calibration_beside
from rig.live.baseline import ReferenceFrame, average_reference, drift_weight
from rig.live.bench import build_bench
from rig.live.chain import Chain, ChainState, at_rest, prepare_chain
from rig.live.frame_estimate import estimate_frame
from rig.live.reported import reported
from rig.report.figure import Bar, Figure, at_least, at_most
from rig.sources.real_twin import RealTwin
from rig.sources.script import TOUR_LENGTH
from rig.sources.twin import open_play
from rig.studies.real_bench.twin_truth import SCENE
from rig.studies.study import line, rms, run, timed
from rig.studies.touches.pattern import AGAINST, EDGES, FRAMES, MODES, SENSOR, Bench, stand
from rig.system.arrays import F64, AnyArray
from rig.system.timing import Stopwatch

THICKNESS, PIXELS, ELEMENTS = 1.0, 1024, 40
FORCES, INSET, APART = (0.5, 5.0), 30.0, 50.0  # N, mm from an edge, mm between two touches
BEFORE, ASIDE = 0.9, 0.5  # of the force, mm: the frame before
NEAR, NEAR_FORCES = (8.0, 25.0), (2.0, 4.0)  # mm from an edge, N
KNOWN = 0.25  # of a force: the bound up to which it counts
FAR = 10.0  # mm: what is further off is no estimate of a touch
COUNTS = {1: "one touch", 2: "two touches"}
PLACE, FORCE = (at_most(0.15), at_most(0.5)), (at_most(0.5), at_most(1.5))
TRACKED, COLD = (at_most(8.0), at_most(15.0)), at_most(50.0)
WITHIN = Bar(-2.0, 2.0)
TABLE, CELLS = "Large touches", "Large touches by cell"
NEAR_EDGES = "Large touches near an edge"


@dataclass
class Cell:
    """What the frames of a cell have shown: all tracked, or all started cold.

    `left_out` says of each frame whether its errors over σ are left out of `deviations`: of a wrong
    count, of touches that are not FOUND, and of places that are `FAR` off.
    """

    place: list[float] = field(default_factory=list[float])
    force: list[float] = field(default_factory=list[float])
    deviations: list[float] = field(default_factory=list[float])
    right: list[bool] = field(default_factory=list[bool])
    left_out: list[bool] = field(default_factory=list[bool])
    spent: list[float] = field(default_factory=list[float])

    def add(self, estimate: Estimate, spent: float, touches: F64) -> None:
        """Compare an estimate, and the ms that it took, with what presses, (n, 3)."""
        self.spent.append(spent)
        self.right.append(estimate.count == len(touches))
        self.left_out.append(True)
        if not self.right[-1]:
            return
        place, force, true = match(estimate, tuple(fe.Touch(*one) for one in touches.tolist()))
        self.place += place.tolist()
        self.force += (100.0 * np.abs(force / true)).tolist()
        if estimate.result is Result.FOUND and place.max() < FAR:
            self.left_out[-1] = False
            self.deviations += deviations(estimate, touches).tolist()


class Pressed(NamedTuple):
    """A cell of scenes, each looked at twice."""

    tracked: Cell
    cold: Cell


def deviations(estimate: Estimate, touches: F64) -> F64:
    """Errors of x, y, F of touches (n, 3) in standard deviations that are stated, (3n,)."""
    apart = np.linalg.norm(estimate.xy[:, None] - touches[:, :2], axis=2)
    found = np.column_stack([estimate.xy, estimate.force])
    sigma = np.sqrt(np.diag(estimate.covariance)).reshape(-1, 3)
    return ((found - touches[apart.argmin(axis=1)]) / sigma).ravel()


def drawn(rng: np.random.Generator, count: int) -> F64:
    """One touch, or two that are `APART`, (n, 3)."""
    while True:
        first, turn = rng.uniform(INSET, 254.0 - INSET, 2), rng.uniform(0, 2 * np.pi)
        second = first + APART * np.array([np.cos(turn), np.sin(turn)])
        places = np.array([first, second][:count])
        if places.min() > INSET and places.max() < 254.0 - INSET:
            return np.column_stack([places, rng.uniform(*FORCES, count)])


def drawn_near_an_edge(rng: np.random.Generator) -> F64:
    """One touch near an edge, but no corner, (1, 3)."""
    place = np.array([rng.uniform(*NEAR), rng.uniform(INSET, 254.0 - INSET)])
    place = place[:: rng.choice([1, -1])]
    place = np.where(rng.random(2) < 0.5, place, 254.0 - place)
    return np.array([[*place, rng.uniform(*NEAR_FORCES)]])


def after(chain: Chain, touches: F64) -> ChainState:
    """State of the loop after a frame with touches (n, 3)."""
    moved = chain.pattern.still()
    amplitudes = chain.pattern.motions.modal_amplitudes(touches[:, :2], touches[:, 2])
    moved[: chain.pattern.count] = amplitudes
    return replace(at_rest(chain), motion=moved, touches=touches)


def prepared(bench: Bench, max_touches: int) -> Chain:
    """Prepare the live chain of a bench whose plate is as described."""
    plate = models.large_plate(fe.reduced_plate(bench.plate), MODES)
    height, tiles = bench.camera.face_height(THICKNESS), bench.reference.tiles
    motions = models.prepare_motions(plate.modes, bench.camera, height, tiles, plate)
    rest = ReferenceFrame(bench.reference.image, AGAINST, None, FRAMES)
    return prepare_chain(rest, motions, max_touches)


def pressed(bench: Bench, chain: Chain, count: int, scenes: int) -> Pressed:
    """Press so many scenes of a cell."""
    mesh, rng = fe.grid(bench.plate, ELEMENTS), np.random.default_rng(count)
    tracked, cold = Cell(), Cell()
    for number in range(scenes):
        touches = drawn(rng, count)
        truth = tuple(fe.Touch(*touch) for touch in touches.tolist())
        moved = fe.solve(bench.plate, truth, mesh=mesh).displacement(bench.warper.points)
        image = SENSOR.capture(bench.light(moved), rng)
        before = touches * (1.0, 1.0, BEFORE) + rng.normal(0.0, ASIDE, touches.shape) * (1, 1, 0)
        if not number:
            frame(chain, image, at_rest(chain))  # compiles what is not compiled yet
        tracked.add(*frame(chain, image, after(chain, before)), touches)
        cold.add(*frame(chain, image, at_rest(chain)), touches)
    return Pressed(tracked, cold)


def frame(chain: Chain, image: AnyArray, state: ChainState) -> tuple[Estimate, float]:
    """Estimate the touches of a frame; its time, ms."""
    work = partial(estimate_frame, chain, image, state, Stopwatch(time.monotonic))
    found, spent = timed(work)
    return found.estimate, spent


def large(scenes: int) -> Iterator[Figure]:
    """Press so many scenes a cell, and sum up."""
    cells: dict[tuple[str, int], Pressed] = {}
    for edges, clamped in EDGES.items():
        bench = stand(THICKNESS, PIXELS, clamped)
        chain = prepared(bench, max(COUNTS) + 1)
        for count in COUNTS:
            both = cells[edges, count] = pressed(bench, chain, count, scenes)
            name = f"{edges} clamped edges, {COUNTS[count]}"
            yield from _of_cell(f"{name}, tracked", both.tracked)
            yield from _of_cell(f"{name}, cold", both.cold)
    for how in Pressed._fields:
        of_how = {key: getattr(both, how) for key, both in cells.items()}
        for count in COUNTS:
            alike = [cell for (_, number), cell in of_how.items() if number == count]
            yield from _of_count(f"large, {COUNTS[count]}, {how}, {scenes} scenes", count, alike)
        case = f"large, one and two touches, {how}, {scenes} scenes"
        yield from _count_right(case, list(of_how.values()))
        yield from _of_errors(case, list(of_how.values()))
    for count in COUNTS:
        alike = [cell for (_, number), both in cells.items() if number == count for cell in both]
        yield from _of_count(f"large, {COUNTS[count]}, {scenes} scenes", count, alike)
    every = [cell for both in cells.values() for cell in both]
    yield from _count_right(f"large, one and two touches, {scenes} scenes", every)
    yield from _of_errors("large", every)
    for count, bar in zip(COUNTS, TRACKED, strict=True):
        spent = [both.tracked.spent for (_, number), both in cells.items() if number == count]
        yield from _timed(f"large, {COUNTS[count]}, tracked", np.concatenate(spent), bar)
    yield from _timed(
        "large, cold", np.concatenate([one.cold.spent for one in cells.values()]), COLD
    )


def _of_count(case: str, count: int, cells: list[Cell]) -> Iterator[Figure]:
    """Sum up cells of so many touches."""
    place = np.concatenate([cell.place for cell in cells])
    force = np.concatenate([cell.force for cell in cells])
    yield from line(
        TABLE,
        case,
        place=(float(np.median(place)), "mm", PLACE[count - 1], len(place)),
        force=(float(np.median(force)), "%", FORCE[count - 1], len(force)),
    )


def _count_right(case: str, cells: list[Cell]) -> Iterator[Figure]:
    """Count the frames of cells in which as many touches are found as press."""
    right = np.concatenate([cell.right for cell in cells])
    count = 100.0 * float(np.mean(right)), "%", at_least(99.0), len(right)
    yield from line(TABLE, case, count_right=count)


def _of_errors(case: str, cells: list[Cell]) -> Iterator[Figure]:
    """Hold what cells state of errors against these."""
    left_out = np.concatenate([cell.left_out for cell in cells])
    off = np.abs(np.concatenate([cell.deviations for cell in cells]))
    inside = {name: 100.0 * float(np.mean(off < limit)) for limit, name in ((1, "1"), (2, "2"))}
    yield from line(
        TABLE,
        case,
        **{
            "error over stated σ": (rms(off), "", Bar(0.85, 1.2), len(off)),
            "inside 1 σ": (inside["1"], "%", Bar(64.0, 72.0), len(off)),
            "inside 2 σ": (inside["2"], "%", Bar(92.0, 98.0), len(off)),
            "left out of these": (100.0 * float(np.mean(left_out)), "%", None, len(left_out)),
        },
    )


def _timed(case: str, spent: F64, bar: Bar | None) -> Iterator[Figure]:
    late = float(np.percentile(spent, 95))
    yield from line(
        TABLE,
        case,
        time=(float(np.median(spent)), "ms", bar, len(spent)),
        **{"time, p95": (late, "ms")},
    )


def _of_cell(name: str, cell: Cell) -> Iterator[Figure]:
    count = len(cell.right)
    yield from line(
        CELLS,
        name,
        place=(float(np.median(cell.place)), "mm", None, len(cell.place)),
        force=(float(np.median(cell.force)), "%", None, len(cell.force)),
        count_right=(100.0 * float(np.mean(cell.right)), "%", None, count),
        error_over_σ=(rms(cell.deviations), "", None, len(cell.deviations)),
        left_out_of_this=(100.0 * float(np.mean(cell.left_out)), "%", None, count),
        time=(float(np.median(cell.spent)), "ms", None, count),
    )


class Near(NamedTuple):
    """Touches near an edge whose force the bound knows to `KNOWN`, from a plate at rest.

    Of all estimates of one touch, FOUND or not, also beyond that bound, `evenly` says where the
    force lies: -1 below force ± 2 σ, 1 above, else 0; `by_interval` the same of the interval.
    """

    found: int
    looked_for: int
    force: list[float]
    evenly: list[int]
    by_interval: list[int]

    def line(self, case: str, bars: tuple[Bar | None, Bar | None]) -> Iterator[Figure]:
        """Sum up; the error of a force is in parts of it."""
        bias = 100.0 * float(np.mean(self.force)) if self.force else float("nan")
        scatter = 100.0 * float(np.std(self.force)) if self.force else float("nan")
        found = 100.0 * self.found / max(self.looked_for, 1)
        yield from line(
            NEAR_EDGES,
            case,
            found=(found, "%", bars[0], self.looked_for),
            **{
                "bias of the force": (bias, "%", bars[1], len(self.force)),
                "scatter of the force": (scatter, "%", None, len(self.force)),
                **_coverage("± 2 σ", self.evenly),
                **_coverage("interval", self.by_interval),
            },
        )


def _coverage(name: str, where: list[int]) -> dict[str, tuple[float, str, None, int]]:
    """Fractions of forces within some bounds and above them."""
    count, percent = len(where), 100.0 / max(len(where), 1)
    return {
        f"in {name}": (percent * where.count(0), "%", None, count),
        f"above {name}": (percent * where.count(1), "%", None, count),
    }


def beyond(force: float, bounds: tuple[float, float]) -> int:
    """-1 where a force lies below some bounds, 1 above, else 0."""
    return int(force > bounds[1]) - int(force < bounds[0])


def edges(scenes: int) -> Iterator[Figure]:
    """Press so many scenes a cell near an edge."""
    every: list[Near] = []
    for name, clamped in EDGES.items():
        bench = stand(THICKNESS, PIXELS, clamped)
        every.append(pressed_near_an_edge(bench, prepared(bench, 2), scenes))
        yield from every[-1].line(f"{name} clamped edges", (None, None))
    together = Near(
        sum(one.found for one in every),
        sum(one.looked_for for one in every),
        [force for one in every for force in one.force],
        [side for one in every for side in one.evenly],
        [side for one in every for side in one.by_interval],
    )
    yield from together.line("8 to 25 mm from an edge, 2 to 4 N", (at_least(95.0), WITHIN))


def pressed_near_an_edge(bench: Bench, chain: Chain, scenes: int) -> Near:
    """Press near an edge; how many are found and known for sure, of those that could be."""
    mesh, rng = fe.grid(bench.plate, ELEMENTS), np.random.default_rng(8)
    found, looked_for, force = 0, 0, list[float]()
    evenly, by_interval = list[int](), list[int]()
    for _ in range(scenes):
        touches = drawn_near_an_edge(rng)
        truth = (fe.Touch(*touches[0].tolist()),)
        moved = fe.solve(bench.plate, truth, mesh=mesh).displacement(bench.warper.points)
        image = SENSOR.capture(bench.light(moved), rng)
        estimate = bounded(chain, image)
        if estimate.count == 1:
            even, interval = two_sigma(estimate), estimate.force_intervals[0]
            evenly.append(beyond(touches[0, 2], even))
            by_interval.append(beyond(touches[0, 2], interval.level_95 if interval else even))
        bound = covariance(chain.estimator.candidates.forward.read(touches)[1])
        if np.sqrt(bound[2, 2]) > KNOWN * touches[0, 2]:
            continue
        looked_for += 1
        if estimate.count == 1 and estimate.result is Result.FOUND:
            found += 1
            force.append(float(estimate.force[0] / touches[0, 2] - 1.0))
    return Near(found, looked_for, force, evenly, by_interval)


def bounded(chain: Chain, image: AnyArray) -> Estimate:
    """Estimate the touches of a frame from a plate at rest, with the intervals of their forces."""
    found = estimate_frame(chain, image, at_rest(chain), Stopwatch(time.monotonic))
    return reported(chain, found).estimate


def two_sigma(estimate: Estimate) -> tuple[float, float]:
    """Force ± 2 σ of one touch, N."""
    force, spread = float(estimate.force[0]), 2.0 * float(np.sqrt(estimate.covariance[2, 2]))
    return force - spread, force + spread


def uncertain() -> Iterator[Figure]:
    """Follow a tour of the scene `bench-real`, whose estimator knows its bench only so well."""
    scene = rig.load(SCENE)
    bench = build_bench(scene, lambda done, total: None, calibration_beside(SCENE))
    twin = open_play(scene)
    if not isinstance(twin, RealTwin):
        raise ValueError(f"scene '{SCENE}' has no source.departure; write one")
    rest = bench.reference_frames
    twin = replace(twin, rest=rest)
    chain, _ = bench.prepare(average_reference([twin.frame(n, ()).copy() for n in range(rest)]))
    spent: dict[int, list[float]] = {count: [] for count in (0, *COUNTS)}
    state, watch = at_rest(chain), Stopwatch(time.monotonic)
    for number in range(rest, rest + round(TOUR_LENGTH * twin.rate)):
        touches = twin.touches(number)
        image = twin.frame(number, touches)
        work = partial(estimate_frame, chain, image, state, watch, drift_weight(1.0 / twin.rate))
        found, took = timed(work)
        state = found.state
        spent[len(touches)].append(took)
    bars = (None, *TRACKED)
    for count, taken in spent.items():
        name = COUNTS.get(count, "no touch")
        yield from _timed(f"large, {name}, bench-real", np.array(taken), bars[count])


PARTS = {
    "few": partial(large, 5),
    "some": partial(large, 20),
    "hundred": partial(large, 100),
    "edges": partial(edges, 40),
    "edges_few": partial(edges, 4),
    "uncertain": uncertain,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
