"""Known presses of a recording as a test of a net: images that it has never seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from models import Net
from rig.calibration.session import presses
from rig.calibration.store import Calibration
from rig.live.bench import MODES, build_bench
from rig.live.chain import at_rest
from rig.live.frame_estimate import estimate_frame
from rig.live.net_chain import NetPlan, prepare_net
from rig.recording.session import Session
from rig.scene import Scene
from rig.scene.sensing import PatternEstimator
from rig.system.timing import Stopwatch
from rig.training.plan import TrainingPlan


@dataclass(frozen=True)
class PressScore:
    """What a net makes of known presses.

    Attributes
    ----------
    presses, missed : int
    place : float or None, mm
        Root mean square distance of those found.
    """

    presses: int
    missed: int
    place: float | None

    @property
    def sentence(self) -> str:
        """What is said of it."""
        if self.place is None:
            return f"the net estimates none of {self.presses} presses"
        missed = f", {self.missed} missed" if self.missed else ""
        return f"the net tells {self.presses} presses to {self.place:.2f} mm{missed}"


def score_presses(
    net: Net,
    plan: TrainingPlan,
    scene: Scene,
    calibration: Calibration,
    session: Session,
    report: Callable[[int, int], None],
) -> PressScore:
    """Tell the presses of a recording by a net, each from the mean image of its still frames.

    Raises
    ------
    ValueError
        If the scene does not suit the recording.
    OSError
        If the recording is damaged.
    """
    if plan.view is None:
        raise ValueError(
            f"scene '{scene.title}' has gauges that no camera reads, and presses are images; set"
            " gauges.subset"
        )
    whole = scene.model_copy(update={"estimator": PatternEstimator(kind="pattern", modes=MODES)})
    bench = build_bench(whole, report, calibration)
    chain, _ = bench.prepare(session.reference)
    gauges, margin = plan.gauges.build(plan.plate), plan.training.margin
    net_plan = NetPlan(net, gauges, plan.view.subset, plan.descent.solver_steps, margin)
    ready = prepare_net(net_plan, chain, session.reference, bench.camera)
    watch = Stopwatch(lambda: 0.0)
    off: list[float] = []
    found = presses(session)
    for one in found:
        frame_estimate = estimate_frame(chain, one.image, at_rest(chain), watch)
        found_by_net = ready.estimate(chain, one.image, frame_estimate, watch).estimate
        if found_by_net.count:
            off.append(float(np.hypot(*(found_by_net.xy[0] - one.touch[:2]))))
    place = float(np.sqrt(np.mean(np.square(off)))) if off else None
    return PressScore(len(found), len(found) - len(off), place)
