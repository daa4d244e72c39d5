"""The touch net beside the solver: on whole frames, on drawn measurements, in time, and as a start.

Parts: frames (rendered images of the shipped twin, 1 to 4 touches drawn anywhere, however close),
shell (frames of the shell under one and two light touches),
ranks (measurements drawn from what the net takes for likely, on the bench of its scene and on
benches that it has not seen), layers (what the steps of Gauss and Newton within it do), time, and
start (cold frames with 4 touches). Bounds are Cramér and Rao's of every pixel, with the noise of
the reference.
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from dataclasses import replace
from functools import cache, partial

import numpy as np

import fe
import models
import rig
from models import Forward, LinearForward, TouchReader
from rig.live.baseline import average_reference
from rig.live.bench import Bench, build_bench
from rig.live.chain import Chain, ChainState, at_rest
from rig.live.frame_estimate import FrameEstimate, estimate_frame
from rig.live.registration import Registered, register
from rig.report.figure import Bar, Figure, at_least, at_most
from rig.scene import parse_overrides
from rig.sources.twin import Twin, build_twin
from rig.studies.study import Cell, line, part, run, timed, times
from rig.studies.touches.limit import REFERENCE, every_pixel
from rig.studies.touches.strain import over_bounds
from rig.system.arrays import F64, AnyArray
from rig.system.timing import Stopwatch
from rig.training.touch_net_score import (
    TouchReading,
    draw_readings,
    flat,
    forward_of,
    number_ranks,
    pair_places,
    place_bound,
    place_errors,
    ranks,
    read,
)
from rig.training.touch_nets import MAX_TOUCHES, described_bench

FRAMES = 75  # of each number of touches
SHELL, LIGHT = 10, (0.5, 1.0)  # frames of each number; N
COLD = 30  # frames with 4 touches
DRAWN = 650  # measurements of each number of touches, none among them
BENCHES = 4  # that the net has not seen
TIMED = 200
OVER, RIGHT, FLAT, QUICK, COLDER = (
    at_most(1.15),
    at_least(98.0),
    at_least(0.01),
    at_most(0.3),
    at_most(2.0),
)
TITLE = "Touch net: "


@cache
def bench() -> tuple[Bench, Twin, Chain]:
    """Build the shipped twin for four touches and the net of the package, with a reference."""
    four = ["touches.max_touches=4", 'estimator.start="net"', "touches.force=[0.5, 4]"]
    scene = rig.load("twin", parse_overrides(four))
    made, twin = build_bench(scene, lambda done, total: None), build_twin(scene)
    zero = average_reference([twin.frame(n, ()) for n in range(REFERENCE)])
    return made, twin, made.prepare(zero)[0]


@cache
def pixels() -> Forward:
    """Use every pixel of the twin."""
    return every_pixel()


def reader() -> TouchReader:
    """Put the net of the package before the twin."""
    return part(bench()[2].start).reader


def frames() -> Iterator[Figure]:
    """Read rendered frames of 1 to 4 touches: no solver, and the solver beside it."""
    every: list[TouchReading] = []
    for number in range(1, MAX_TOUCHES + 1):
        found = [_seen(number, k) for k in range(FRAMES)]
        every += found
        yield from line(f"{TITLE}whole frames", f"{number} touches, net", **_cells(found, "net"))
        yield from line(
            f"{TITLE}whole frames", f"{number} touches, solver", **_cells(found, "solver")
        )
    bars = OVER, RIGHT
    yield from line(f"{TITLE}whole frames", "1 to 4 touches, net", **_cells(every, "net", bars))
    yield from line(f"{TITLE}whole frames", "1 to 4 touches, solver", **_cells(every, "solver"))
    apart = [each for each in every if _nearest(each.truth) > 40.0]
    table = f"{TITLE}whole frames, touches more than 40 mm apart"
    yield from line(table, "1 to 4 touches, net", **_cells(apart, "net"))
    yield from line(table, "1 to 4 touches, solver", **_cells(apart, "solver"))


def shell() -> Iterator[Figure]:
    """Read frames whose plate is a shell, pressed so lightly that linear theory is near it."""
    made, twin, _ = bench()
    mesh = fe.grid(made.plate, 40)
    for number in (1, 2):
        found: list[TouchReading] = []
        for k in range(SHELL):
            truth = _drawn(number, 800 + k)
            truth[:, 2] = np.random.default_rng((9, number, k)).uniform(*LIGHT, number)
            touches = tuple(fe.Touch(*touch) for touch in truth.tolist())
            moved = fe.solve(made.plate, touches, mesh=mesh).displacement(twin.warper.points)
            noise = np.random.default_rng((10, number, k))
            found.append(_read(truth, twin.warper.render(moved, twin.sensor, noise)))
        table = f"{TITLE}frames of a shell, {LIGHT[0]:g} to {LIGHT[1]:g} N"
        yield from line(table, f"{number} touches, net", **_cells(found, "net"))
        yield from line(table, f"{number} touches, solver", **_cells(found, "solver"))


def _seen(number: int, k: int) -> TouchReading:
    """Render one frame of linear theory, and read it."""
    truth = _drawn(number, k)
    return _read(truth, _image(truth, k))


def _read(truth: F64, image: AnyArray) -> TouchReading:
    """Register a frame from the plate at rest, and read it."""
    chain = bench()[2]
    seen = _registered(chain, image)
    measured = chain.pattern.whiten(seen.right, chain.noise)
    scatter = models.covariance(pixels().read(truth)[1]) * (1 + 1 / REFERENCE)
    return read(reader(), chain.estimator, measured, truth, place_bound(scatter))


def _drawn(number: int, k: int) -> F64:
    return reader().touches.draw(np.random.default_rng((7, number, k)), number)


def _image(truth: F64, k: int) -> AnyArray:
    touches = tuple(fe.Touch(*touch) for touch in truth.tolist())
    return bench()[1].frame(1000 + k, touches)


def _registered(chain: Chain, image: AnyArray) -> Registered:
    return register(chain, image, chain.pattern.still(), Stopwatch(clock.perf_counter))


def _nearest(truth: F64) -> float:
    """Least distance between two touches, mm; infinite for one."""
    apart = np.linalg.norm(truth[:, None, :2] - truth[:, :2], axis=2)
    return float((apart + np.diag(np.full(len(truth), np.inf))).min())


def _cells(
    readings: list[TouchReading], who: str, bars: tuple[Bar | None, Bar | None] = (None, None)
) -> dict[str, Cell]:
    """Make cells of frames of which the number is right; all frames count for that."""
    if who == "net":
        right = [each.known for each in readings]
    else:
        right = [each.solver.count == len(each.truth) for each in readings]
    good = [each for each, fine in zip(readings, right, strict=True) if fine]
    errors, bounds = (np.concatenate(each) for each in place_errors(good, who))
    over = over_bounds([errors], [bounds], None)
    figure = float(np.sqrt(np.mean((errors / bounds) ** 2)))
    return over | {
        "÷_CRB": (figure, "", bars[0], len(good)),
        "count_right": (100 * float(np.mean(right)), "%", bars[1], len(readings)),
        "not_known": (100 * float(np.mean([bool(e.net.reason) for e in readings])), "%"),
    }


def all_ranks() -> Iterator[Figure]:
    """Rank the truth among draws of what is stated, on benches seen and not seen."""
    net = models.shipped_touch_net()
    scene = rig.load("touch-net")
    described, rng = described_bench(scene), np.random.default_rng(99)
    benches: dict[str, list[LinearForward]] = {
        "bench of the scene": [forward_of(scene)],
        f"{BENCHES} other benches": [models.draw_bench(described, rng) for _ in range(BENCHES)],
    }
    for name, forwards in benches.items():
        drawn = DRAWN // len(forwards)
        readings = [
            each
            for seed, forward in enumerate(forwards)
            for number in range(MAX_TOUCHES + 1)
            for each in draw_readings(net, forward, number, drawn, 100 + seed)
        ]
        found = ranks(readings, 1)
        cells: dict[str, Cell] = {
            axis: (flat(column), "p of χ²", FLAT, len(column))
            for axis, column in zip("xyF", found.T, strict=True)
        }
        cells["number"] = (flat(number_ranks(readings, 1)), "p of χ²", FLAT, len(readings))
        yield from line(f"{TITLE}ranks of the truth among {200 - 1} draws", name, **cells)
        for number in range(MAX_TOUCHES + 1):
            some = [each for each in readings if len(each.truth) == number]
            right = 100 * float(np.mean([each.known for each in some]))
            solver = 100 * float(np.mean([each.solver.count == number for each in some]))
            own = ranks(some, 2)
            shown: dict[str, Cell] = {
                axis: (flat(column) if number else None, "p of χ²", None, len(column))
                for axis, column in zip("xyF", own.T, strict=True)
            }
            shown["count_right"] = (right, "%", None, len(some))
            shown["of_the_solver"] = (solver, "%", None, len(some))
            yield from line(f"{TITLE}by number, {name}", f"{number} touches", **shown)


def layers() -> Iterator[Figure]:
    """Compare what the net proposes with what its steps make of it, the number known."""
    own, net = reader(), models.shipped_touch_net()
    for steps in (0, 1, 2, 5, 10, 20):
        for number in range(1, MAX_TOUCHES + 1):
            rng = np.random.default_rng((3, number))
            off: list[F64] = []
            limits: list[F64] = []
            for _ in range(TIMED):
                truth = net.touches.draw(rng, number)
                predicted, jacobian = own.forward.read(truth)
                measured = predicted + rng.standard_normal(len(predicted))
                found = own.after(measured, number, steps)
                here, true = pair_places(found[:, :2], truth[:, :2])
                off.append(np.linalg.norm(found[here, :2] - truth[true, :2], axis=1))
                limits.append(place_bound(models.covariance(jacobian))[true])
            over = np.concatenate(off) / np.concatenate(limits)
            yield from line(
                f"{TITLE}steps of Gauss and Newton within, number known",
                f"{steps} steps, {number} touches",
                median=(float(np.median(np.concatenate(off))), "mm", None, len(over)),
                within_3_CRB=(100 * float(np.mean(over < 3)), "%"),
                **{"median_÷_CRB": float(np.median(over))},
            )


def time() -> Iterator[Figure]:
    """Time of one measurement, on one core."""
    own = reader()
    for number in range(MAX_TOUCHES + 1):
        rng, taken = np.random.default_rng(number), list[float]()
        for _ in range(TIMED):
            truth = own.touches.draw(rng, number)
            predicted = own.forward.read(truth)[0] if number else 0.0
            measured = predicted + rng.standard_normal(len(own.response[0]))
            taken.append(timed(partial(own.read, measured))[1])
        yield from line(f"{TITLE}time", f"{number} touches", **times(taken[5:], QUICK))


def start() -> Iterator[Figure]:
    """Time whole frames with 4 touches: begun cold by search and by net, and tracked."""
    chain = bench()[2]
    search = replace(chain, start=None)
    ways: dict[str, list[tuple[float, float, bool]]] = {
        name: [] for name in ("cold, search", "cold, net", "tracked")
    }
    for k in range(-2, COLD):
        truth = _drawn(MAX_TOUCHES, 500 + k)
        before, image = _image(truth, 2 * k + 10), _image(truth, 2 * k + 11)
        followed = _frame(chain, before, at_rest(chain))[0].state
        for name, way, state in (
            ("cold, search", search, at_rest(chain)),
            ("cold, net", chain, at_rest(chain)),
            ("tracked", chain, followed),
        ):
            found, whole, estimated = _frame(way, image, state)
            if k >= 0:
                ways[name].append((whole, estimated, found.estimate.count == MAX_TOUCHES))
    tracked = float(np.median([whole for whole, *_ in ways["tracked"]]))
    alone = float(np.median([estimated for _, estimated, _ in ways["tracked"]]))
    for name, found in ways.items():
        whole, estimated, right = (np.array(column) for column in zip(*found, strict=True))
        bar = COLDER if name == "cold, net" else None
        yield from line(
            f"{TITLE}as a start, 4 touches, whole frames",
            name,
            frame=(float(np.median(whole)), "ms", None, COLD),
            frame_95_pct=(float(np.percentile(whole, 95)), "ms"),
            over_tracked=(float(np.median(whole)) / tracked, "", bar, COLD),
            touches_alone=(float(np.median(estimated)), "ms"),
            touches_alone_95_pct=(float(np.percentile(estimated, 95)), "ms"),
            touches_alone_over_tracked=(float(np.median(estimated)) / alone, ""),
            count_right=(100 * float(np.mean(right)), "%"),
        )


def _frame(chain: Chain, image: AnyArray, state: ChainState) -> tuple[FrameEstimate, float, float]:
    """Estimate one frame; its time, and that of finding touches, ms of the processor."""
    watch = Stopwatch(clock.thread_time)
    found, whole = timed(lambda: estimate_frame(chain, image, state, watch))
    return found, whole, watch.quantiles("estimate")[0]


PARTS = {
    "frames": frames,
    "shell": shell,
    "ranks": all_ranks,
    "layers": layers,
    "time": time,
    "start": start,
}

if __name__ == "__main__":
    run(PARTS, __doc__)
