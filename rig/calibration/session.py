"""Known presses out of a recording: what they correct in the forward model, and what that is worth.

The presses are found again as `collect` found them, from the touches that the recording keeps. A
third of them is held out of a first fit and scored; all of them make the one that is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import compress
from typing import cast

import numpy as np

import synthetic
from models import ImageMotions, PressCorrection, correct_by_presses, prepare_motions
from rig.calibration.collect import Collector, HeldOutScore, Taken, rms, targets
from rig.calibration.lens import Lens
from rig.calibration.pose import Pose
from rig.calibration.requested_presses import REQUESTED
from rig.calibration.store import parse
from rig.live.alignment import FEWEST, Alignment, align
from rig.live.bench import Bench, build_bench
from rig.live.chain import Chain, at_rest
from rig.live.evidence import SIGNIFICANCE
from rig.live.frame_estimate import FrameEstimate, estimate_frame
from rig.live.view import marks
from rig.recording.session import Session, reported
from rig.system.arrays import F32, F64, AnyArray, Mask
from rig.system.timing import Stopwatch


@dataclass(frozen=True, eq=False)
class PressedFrames:
    """A known press, and the mean image (H, W) of the frames in which it stood still."""

    taken: Taken
    image: F32

    @property
    def touch(self) -> tuple[float, float, float]:
        """x, y, F of the press, mm, mm, N."""
        return self.taken.press.x, self.taken.press.y, self.taken.press.force


@dataclass(frozen=True, eq=False)
class Learned:
    """What the presses of a session correct, in the form in which a calibration keeps it.

    Attributes
    ----------
    lens : Lens
    pose : Pose
    alignment : Alignment
        A factor of the force alone: a plate that is softer by a factor takes less for the same.
    score : HeldOutScore
        Of the presses held out.
    p_value : float
        By which a model that is right would be corrected by so much.
    """

    lens: Lens
    pose: Pose
    alignment: Alignment
    score: HeldOutScore
    p_value: float

    @property
    def helps(self) -> bool:
        """Whether the presses prove that the model was wrong, and those held out got no worse."""
        return self.p_value < SIGNIFICANCE and self.score.helps


def presses(session: Session) -> list[PressedFrames]:
    """Find the presses that were asked for in a recording.

    Raises
    ------
    ValueError
        If the scene of the recording does not say where to press, or the reference was renewed.
    OSError
        If the file is damaged.
    """
    session.require_one_reference()
    collector = Collector(targets(session.scene), REQUESTED, fewest=1)
    found: list[PressedFrames] = []
    times: F64 = session.columns()["frames/captured"]
    images = session.arrays["frames/image"]
    for index in range(session.frames):
        taken = collector.add_frame(marks(reported(session.row(index))), float(times[index]))
        if taken:
            first = index + 1 - taken.frames
            frames = cast(AnyArray, images[first : index + 1]).astype(np.float32)
            found.append(PressedFrames(taken, np.asarray(frames.mean(axis=0), dtype=np.float32)))
    return found


def learn(session: Session, report: Callable[[int, int], None]) -> Learned:
    """Correct the forward model of a session by its presses.

    Raises
    ------
    ValueError
        If there are too few presses, or the scene cannot run live or has no pinhole camera.
    OSError
        If the file is damaged.
    """
    (bench, camera), kept = _bench(session, report), _without_slips(presses(session))
    chain, look = _chain(bench, session), _look(bench)
    estimates = [_sense(chain, one) for one in kept]
    touches = np.array([one.touch for one in kept])
    images = np.stack([one.image for one in kept])
    hidden = np.array([one.hidden for one in estimates])
    noise = _noise(kept, session.reference.noise, bench.reference_frames)

    def by(chosen: Mask) -> PressCorrection:
        given = images[chosen], touches[chosen], noise, hidden[chosen]
        return correct_by_presses(camera, look, chain.reference, *given)

    held = np.arange(len(kept)) % 3 == 2
    part = by(~held)
    better = _chain(replace(bench, camera=part.camera, motions=look(part.camera)), session)
    again = _found([_sense(better, one) for one in compress(kept, held)])
    before = rms(_found(estimates)[held], touches[held])
    after = rms(again / (1.0, 1.0, part.softness), touches[held])
    score = HeldOutScore(len(again), before[0], after[0], before[1], after[1])
    return _learned(by(np.ones(len(kept), dtype=bool)), score)


def _bench(session: Session, report: Callable[[int, int], None]) -> tuple[Bench, synthetic.Camera]:
    """Build the bench of a recording, and its camera, without what older presses corrected."""
    known = parse(session.calibration, "in the recording").model_copy(update={"presses": None})
    bench = build_bench(session.scene, report, known)
    if not isinstance(bench.camera, synthetic.Camera):
        raise ValueError(
            f"scene '{session.scene.title}' has a camera of kind '{bench.camera.kind}', and presses"
            " correct a pinhole camera; correct it with `touchplate collect`"
        )
    return replace(bench, strain=False, net=None, max_touches=1), bench.camera


def _chain(bench: Bench, session: Session) -> Chain:
    return bench.prepare(session.reference)[0]


def _noise(pressed: list[PressedFrames], one: float, reference: int) -> tuple[float, float]:
    """Noise of the mean images and of the reference, if a frame less the reference has `one`."""
    frames = float(np.median([each.taken.frames for each in pressed]))
    frame = one / float(np.sqrt(1 + 1 / reference))
    return frame / float(np.sqrt(frames)), frame / float(np.sqrt(reference))


def _without_slips(found: list[PressedFrames]) -> list[PressedFrames]:
    if len(found) < FEWEST:
        raise ValueError(
            f"the recording shows {len(found)} known presses and {FEWEST} are needed; record some"
            " with `touchplate collect --record`"
        )
    measured = np.array([one.taken.found for one in found])
    sigma = np.array([one.taken.sigma for one in found])
    slips = align(tuple(one.taken.press for one in found), measured, sigma).slips
    return [one for index, one in enumerate(found) if index not in slips]


def _look(bench: Bench) -> Callable[[synthetic.Camera], ImageMotions]:
    known = bench.motions
    return lambda camera: prepare_motions(
        known.modes, camera, bench.height, known.tiles, known.large
    )


def _sense(chain: Chain, pressed: PressedFrames) -> FrameEstimate:
    """Find the one touch of a press.

    Raises
    ------
    ValueError
        If there is none.
    """
    estimates = estimate_frame(chain, pressed.image, at_rest(chain), Stopwatch(lambda: 0.0))
    if estimates.estimate.count != 1:
        x, y, _ = pressed.touch
        raise ValueError(
            f"no touch is found at ({x:.0f}, {y:.0f}) mm where the recording shows a known press;"
            " press harder, or look at it with `touchplate replay`"
        )
    return estimates


def _found(estimates: list[FrameEstimate]) -> F64:
    """x, y, F of the one touch of each, (n, 3)."""
    return np.array([(*one.estimate.xy[0], one.estimate.force[0]) for one in estimates])


def _learned(corrected: PressCorrection, score: HeldOutScore) -> Learned:
    camera, softness = corrected.camera, corrected.softness
    spread = np.sqrt(np.diag(corrected.covariance))
    lens = Lens(
        camera.size,
        camera.focal,
        camera.centre,
        camera.distortion or synthetic.Distortion(),
        sigma_focal=camera.focal * float(spread[6]),
        residual=0.0,
        error=score.place_after,
        left_out=(),
    )
    pose = Pose(camera, corrected.pose_covariance, 0.0, score.place_after)
    alignment = Alignment(
        matrix=np.eye(2, 3),
        gain=1 / softness,
        error=score.place_after,
        error_force=score.force_after,
        sigma_gain=float(spread[7]) / softness,
        slips=(),
        terms=("force",),
    )
    return Learned(lens, pose, alignment, score, corrected.p_value)
