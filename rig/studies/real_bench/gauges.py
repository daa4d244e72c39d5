"""The paper's 72 gauges on a plate that is not as it is said, before and after nine presses.

Parts: gauges. Three seeds with 67 touches each. The gauges stand on the edge, eighteen a side, as
in the paper (see `docs/decisions/0009`), and read small strain of the upper face with a noise of
2 µε a frame. All of the plate is wrong together as in `as_it_is`; strain knows no camera. Truth is
the whole plate of von Kármán on its own mesh of 40 elements; presses are the mean of twelve frames,
and their list errs by 0.2 mm and 0.3 %.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

import fe
import models
from rig.report.figure import Figure
from rig.studies.real_bench.as_it_is import MANY, NONE, ONE, SEEDS, TABLE, Bars, cells
from rig.studies.real_bench.departure import ALL, SAID
from rig.studies.real_bench.score import Score, compared, pooled
from rig.studies.real_bench.session import (
    EVERY,
    FORCES,
    FRAMES,
    LABEL,
    MARGIN,
    Touched,
    nine_places,
)
from rig.studies.real_bench.truth import Truth
from rig.studies.study import line, run
from rig.system.arrays import F64

NOISE = 2e-6
_STATED = np.array([0.3, 0.3, 0.02])  # mm, mm, fraction: σ that a list of presses states


def ring() -> F64:
    """Places of the gauges, (72, 2) mm."""
    return models.gauges_on_edges(SAID.size, SAID.size[0] / 20, SAID.size[0] / 20)


@dataclass(frozen=True, eq=False)
class Gauges:
    """The gauges on a plate in modes; see `models.Look`.

    Attributes
    ----------
    modal : fe.ModalPlate
        That which carries their readings.
    readings : fe.Readings
        Of the plate as it is said.
    """

    modal: fe.ModalPlate
    readings: fe.Readings

    def at(self, values: F64, thicker: float = 0.0, near: models.Seen | None = None) -> models.Seen:
        """Strain by all fields of the plate; no camera takes part."""
        del near  # all of it is quick
        thick = float(np.exp(thicker))
        modes = thick * np.tensordot(self.readings.bent, self.modal.values, ([0, 1], [0, 1]))
        own = np.eye(len(modes))  # details and stretching of a gauge are read by it alone
        bent, stretched = np.hstack([modes, thick * own]), own
        by_camera = np.zeros((len(values), len(own), bent.shape[1] + len(own)))
        by_thickness = np.hstack([bent, np.zeros_like(stretched)])
        return models.Seen(np.hstack([bent, stretched]), by_camera, by_thickness)


@dataclass(frozen=True, eq=False)
class Session:
    """What gauges read of a plate under presses and touches.

    Attributes
    ----------
    truth : Truth
    """

    truth: Truth

    def read(self, touch: F64, frames: int, rng: np.random.Generator) -> F64:
        """Mean strain of some frames of a touch x, y, F, (3 · 72,)."""
        x, y, force = touch.tolist()
        state = self.truth.solved((fe.Touch(x, y, force),))
        strain = self._readings.of(state.values[..., 0], state.plane.values[..., 0])
        return strain + rng.normal(0.0, NOISE / np.sqrt(frames), 3 * len(ring()))

    @cached_property
    def _readings(self) -> fe.Readings:
        return fe.strain_readings(self.truth.karman.mesh, ring(), self.truth.height)

    def presses(self) -> list[models.Press]:
        """Press at the nine places; see `rig.studies.real_bench.session`."""
        rng, made = np.random.default_rng((self.truth.seed, 1)), list[models.Press]()
        for place, force in zip(nine_places(), np.resize(FORCES, 9), strict=True):
            touch, unit = np.array([*place, force]), np.array([1.0, 1.0, force])
            label = touch + rng.normal(0.0, LABEL) * unit
            white = self.read(touch, FRAMES, rng) / NOISE
            made.append(models.Press(white, label, _STATED * unit, 1.0 / np.sqrt(FRAMES)))
        return made

    def touches(self, count: int) -> tuple[list[Touched], list[F64]]:
        """Touch anywhere, and leave the plate alone after every few; readings in units of noise."""
        rng, sides = np.random.default_rng((self.truth.seed, 2)), np.array(SAID.size)
        made, seen = list[Touched](), list[F64]()
        for one in range(count):
            touch = np.array([*rng.uniform(MARGIN, sides - MARGIN), rng.uniform(0.5, 4.0)])
            made.append(Touched(len(seen), touch))
            seen.append(self.read(touch, 1, rng) / NOISE)
            if one % EVERY == EVERY - 1:
                made.append(Touched(len(seen), None))
                seen.append(rng.normal(0.0, 1.0, 3 * len(ring())))
        return made, seen


def gauges() -> Iterator[Figure]:
    """Score touches before and after nine presses."""
    prior = before()
    mesh = fe.even_grid(SAID, 40)
    readings = fe.strain_readings(mesh, ring(), 0.5 * SAID.thickness)
    modal = fe.modal_plate(SAID, mesh=mesh, readings=readings)
    look, plate = Gauges(modal, readings), fe.BenchPlate(modal, fe.bench_values())
    zero = np.zeros(len(models.CAMERA))
    fields = models.BenchFields(plate).whole.through(look.at(zero), zero)
    forward = models.BenchForward(fields, np.eye(3 * len(ring())) / NOISE)
    nominal, after, spent = list[Score](), list[Score](), list[float]()
    for seed in SEEDS:
        session = Session(Truth(replace(ALL, camera=(0.0,) * 9), seed))
        made, seen = session.touches(MANY)
        nominal.append(scored(models.Estimator(forward, bench=prior, max_touches=2), made, seen))
        presses, began = session.presses(), time.process_time()
        found = models.identify(forward, presses, prior, look)
        spent.append(time.process_time() - began)
        on = forward.on(found.values, look.at(zero, found["thickness"][0]))
        after.append(scored(models.Estimator(on, bench=found, max_touches=2), made, seen))
    yield from _lines("nominal scene", nominal, NONE)
    yield from line(TABLE, "72 gauges, after 9 presses", identification=(np.median(spent), "CPU s"))
    yield from _lines("after 9 presses", after, ONE)


def before() -> models.BenchEstimate:
    """State what is known of the plate beforehand; of a camera there is nothing to know."""
    return models.bench_before(SAID, **{name: 0.0 for name, _ in models.CAMERA})


def scored(estimator: models.Estimator, made: list[Touched], seen: list[F64]) -> Score:
    """Estimate each reading by itself and compare it with what was made."""
    found: dict[int, models.Estimate] = {}
    taken: list[float] = []
    for one in made:
        began = time.thread_time()
        found[one.sequence] = estimator.fit_whitened(seen[one.sequence])
        taken.append(time.thread_time() - began)
    return compared(found, made, float(np.median(taken)))


def _lines(when: str, scores: list[Score], bars: Bars) -> Iterator[Figure]:
    yield from line(TABLE, f"72 gauges, {when}", **cells(pooled(scores), bars))


PARTS = {"gauges": gauges}

if __name__ == "__main__":
    run(PARTS, __doc__)
