"""Known presses of a recording as a test of a net: pictures that it has never seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from models import Net
from rig.calibration.session import presses
from rig.calibration.store import Calibration
from rig.live import chain as live
from rig.live.bench import MODES, build_bench
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
            return f"the net tells none of {self.presses} presses"
        missed = f", {self.missed} missed" if self.missed else ""
        return f"the net tells {self.presses} presses to {self.place:.2f} mm{missed}"


def score_presses(
    net: Net,
    taught: TrainingPlan,
    scene: Scene,
    calibration: Calibration,
    session: Session,
    report: Callable[[int, int], None],
) -> PressScore:
    """Tell the presses of a recording by a net, each from the mean picture of its still frames.

    Raises
    ------
    ValueError
        If the scene does not suit the recording.
    OSError
        If the recording is damaged.
    """
    if taught.view is None:
        raise ValueError(
            f"scene '{scene.title}' has gauges that no camera reads, and presses are pictures; set"
            " gauges.subset"
        )
    whole = scene.model_copy(update={"estimator": PatternEstimator(kind="pattern", modes=MODES)})
    bench = build_bench(whole, report, calibration)
    chain, _ = bench.prepare(session.zero)
    gauges, margin = taught.gauges.build(taught.plate), taught.training.margin
    plan = NetPlan(net, gauges, taught.view.subset, taught.net.solver_steps, margin)
    ready, watch = prepare_net(plan, chain, session.zero, bench.camera), Stopwatch(lambda: 0.0)
    off, found = [], presses(session)
    for one in found:
        sensed = live.estimate_frame(chain, one.picture, live.at_rest(chain), watch)
        told = ready.tell(chain, one.picture, sensed, watch).estimate
        if told.count:
            off.append(np.hypot(*(told.xy[0] - one.touch[:2])))
    place = float(np.sqrt(np.mean(np.square(off)))) if off else None
    return PressScore(len(found), len(found) - len(off), place)
