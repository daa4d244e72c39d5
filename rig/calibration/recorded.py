"""Frames of a recording as measurements, as touches at equilibrium would explain them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from models import Estimate
from rig.calibration.store import Calibration
from rig.live.bench import Bench, build_bench
from rig.live.chain import Chain, at_rest
from rig.live.frame_estimate import estimate_frame
from rig.recording.session import Session, frame
from rig.scene import Scene
from rig.system.arrays import F64
from rig.system.timing import Stopwatch


@dataclass(frozen=True, eq=False)
class Recorded:
    """N frames in which all of the pattern was in view.

    Attributes
    ----------
    bench : Bench
    chain : Chain
    times : (N,) float64, s
        When each was complete.
    measured : (N, m) float64
        In units of the noise.
    estimates : tuple of Estimate
        Touches that explain each if the plate was at equilibrium.
    """

    bench: Bench
    chain: Chain
    times: F64
    measured: F64
    estimates: tuple[Estimate, ...]

    @property
    def strongest(self) -> tuple[int, F64]:
        """Frame that shows the strongest touch, and the place of that, (2,) mm.

        Raises
        ------
        ValueError
            If none shows a touch.
        """
        forces = [one.force.max(initial=0.0) for one in self.estimates]
        if not any(forces):
            raise ValueError(
                f"none of the {len(forces)} frames shows a touch, and one is needed; record the"
                " plate while one finger taps or presses it"
            )
        index = int(np.argmax(forces))
        estimate = self.estimates[index]
        return index, estimate.xy[int(estimate.force.argmax())]

    def shown_at(self, place: F64) -> tuple[F64, float]:
        """Force (N,) that each frame shows at a place (2,) mm where nothing else acts; its σ, N."""
        shape = self.chain.estimator.forward.response(place[None])[0]
        size = float(shape @ shape)
        return self.measured @ shape / size, size**-0.5


def read_recorded(
    session: Session, scene: Scene, calibration: Calibration, report: Callable[[int, int], None]
) -> Recorded:
    """Estimate every frame of a recording by itself, on the bench of a scene as it is known now.

    Frames in which something lies before the pattern are left out.

    Raises
    ------
    ValueError
        If the scene cannot run live, its camera has another size, or the reference was renewed.
    OSError
        If the file is damaged.
    """
    session.require_one_reference()
    elastic = calibration.model_copy(update={"damping": None, "creep": None})
    built = build_bench(scene.model_copy(update={"dynamics": None}), report, elastic)
    bench = replace(built, strain=False, net=None)
    chain, _ = bench.prepare(session.reference)
    state, watch = at_rest(chain), Stopwatch(lambda: 0.0)
    times: list[float] = []
    measured: list[F64] = []
    estimates: list[Estimate] = []
    for index in range(session.frames):
        recorded = frame(session.row(index))
        found = estimate_frame(chain, recorded.image, state, watch)
        state = found.state
        if found.measured is not None and not found.hidden.any():
            times.append(recorded.captured)
            measured.append(found.measured)
            estimates.append(found.estimate)
    shape = len(times), chain.pattern.count
    return Recorded(
        bench, chain, np.array(times), np.array(measured).reshape(shape), tuple(estimates)
    )
