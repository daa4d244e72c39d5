"""Touches by a net, live: the strain that DIC reads at the gauges of a frame, and what a net says.

The whole pattern is followed all the same. It says where each gauge is, what hides it and what the
plate has crept to; the net says where the touch is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt
from pathlib import Path

import numpy as np
from pydantic import ValidationError

import dic
import synthetic
from models import (
    CameraGauges,
    Estimate,
    Net,
    NetTouchEstimator,
    load_net,
    prepare_camera_gauges,
    prepare_net_estimator,
)
from rig.live.baseline import ReferenceFrame
from rig.live.chain import Chain
from rig.live.frame_estimate import NO_ESTIMATE, FrameEstimate
from rig.scene import Scene
from rig.scene.bench import LatticeSection, RingSection
from rig.scene.plate import PlateSection
from rig.scene.sensing import NetEstimator
from rig.scene.theory import Theory
from rig.system.arrays import F64, I64, AnyArray
from rig.system.timing import Stopwatch

SAME = ("plate", "base", "gauges")
"""Sections that must be those of the training; a camera may be calibrated since."""

PLACES = 16  # a side, at which the error of the net itself is measured


@dataclass(frozen=True, eq=False)
class NetPlan:
    """A trained net and the gauges that it reads.

    Attributes
    ----------
    net : Net
    gauges : (M, 2) float64, mm
    subset : int, px
    steps : int
        Of the solver, after the net.
    margin : float, mm
        Distance of its training touches from the edges.
    """

    net: Net
    gauges: F64
    subset: int
    steps: int
    margin: float


@dataclass(frozen=True, eq=False)
class NetChain:
    """Everything that is prepared once for a reference.

    Attributes
    ----------
    reference : dic.Reference
        Of the gauges.
    seen : CameraGauges
    touch : NetTouch
    tiles : (M,) int
        The tile that lies nearest to each gauge.
    """

    reference: dic.Reference
    readings: CameraGauges
    touch: NetTouchEstimator
    tiles: I64

    def estimate(
        self, chain: Chain, image: AnyArray, frame_estimate: FrameEstimate, watch: Stopwatch
    ) -> FrameEstimate:
        """Put what the net finds in the place of what the whole pattern says of a frame.

        No touch is reported while a gauge is hidden: a net reads all of them.
        """
        found = NO_ESTIMATE
        if not frame_estimate.unusable_reason:
            with watch.stage("net"):
                found = self._touches(chain, image, frame_estimate)
        return replace(frame_estimate, estimate=found, from_pattern=frame_estimate.estimate)

    def _touches(self, chain: Chain, image: AnyArray, frame_estimate: FrameEstimate) -> Estimate:
        guess = chain.pattern.motions.flow(frame_estimate.state.motion)[self.tiles]
        field = dic.strain(dic.correlate(self.reference, image, guess))
        if not field.valid.all():
            return NO_ESTIMATE
        crept = self.readings.of_modes @ frame_estimate.state.rest
        return self.touch.fit(np.column_stack([field.exx, field.eyy, field.exy]) - crept)


def plan_net(scene: Scene, theory: Theory) -> NetPlan:
    """Read the net of a scene.

    Raises
    ------
    OSError
        If its file cannot be read.
    ValueError
        If the scene lacks what a net needs live, or the net was trained for another one.
    """
    match scene:
        case Scene(
            plate=PlateSection() as plate,
            gauges=RingSection(subset=int(subset)) | LatticeSection(subset=int(subset)) as gauges,
            estimator=NetEstimator(model=str(model), solver_steps=steps),
        ):
            pass
        case _:
            raise ValueError(
                f"scene '{scene.title}' cannot run its net live; set gauges.subset, by which DIC"
                " reads the gauges, and estimator.model, the file that `touchplate train` writes"
            )
    if theory.name != "linear":
        raise ValueError(
            f"scene '{scene.title}' needs the theory of large deflection, and nets learn the linear"
            " one; expect smaller forces, or set plate.theory to 'linear' and accept the error"
        )
    if scene.touches and scene.touches.max_touches > 1:
        raise ValueError(
            f"scene '{scene.title}' expects up to {scene.touches.max_touches} touches, and its net"
            " tells one; set touches.max_touches to 1"
        )
    if scene.touches and scene.touches.friction:
        raise ValueError(
            f"scene '{scene.title}' expects friction, which nets know nothing of; set"
            " touches.friction to 0, or estimator.kind to 'pattern'"
        )
    trained, about = load_net(model)
    _check_same(scene, about.get("scene"), Path(model))
    margin = scene.training.margin if scene.training else 0.0
    return NetPlan(trained.net, gauges.build(plate), subset, steps, margin)


def _check_same(scene: Scene, about: object, path: Path) -> None:
    """Refuse a net of another bench, and say what differs."""
    try:
        trained = Scene.model_validate(about)
    except ValidationError as error:
        raise ValueError(
            f"model file {path} names a bench that this release does not know; train it again"
        ) from error
    other = [name for name in SAME if getattr(trained, name) != getattr(scene, name)]
    if other:
        raise ValueError(
            f"model file {path} was trained for another [{other[0]}] than scene '{scene.title}'"
            " has; train it again"
        )


def prepare_net(
    plan: NetPlan, chain: Chain, reference: ReferenceFrame, camera: synthetic.AnyCamera
) -> NetChain:
    """Prepare a net for a reference.

    Raises
    ------
    ValueError
        If a gauge leaves the image or stands where there is no pattern, or the bench is not known
        as it is; see `ImageMotions.plate_modes`.
    """
    motions = chain.pattern.motions
    readings = prepare_camera_gauges(motions.plate_modes, camera, plan.gauges, plan.subset)
    gauges = dic.prepare(reference.image, plan.subset, points=readings.gauges.xy)
    blind = np.count_nonzero(gauges.status != dic.Status.OK)
    if blind:
        raise ValueError(
            f"{blind} of {len(plan.gauges)} gauges show no pattern to follow; look after pattern"
            " and light, or set gauges.margin larger"
        )
    # The noise of a frame less the reference, shared evenly, as the covariance takes it.
    root = readings.root(reference.image, reference.noise / sqrt(2))
    a, b = motions.modes.plate.size
    sides = (np.linspace(plan.margin, side - plan.margin, PLACES) for side in (a, b))
    places = np.stack(np.meshgrid(*sides), axis=-1).reshape(-1, 2)
    apart = np.abs(readings.gauges.xy[:, None] - motions.tiles.xy).max(axis=2)
    touch = prepare_net_estimator(plan.net, readings, root, places, plan.steps)
    return NetChain(gauges, readings, touch, apart.argmin(axis=1))
