"""Known presses out of a recording: what they correct in the forward model, and what that is worth.

The presses are found again as `collect` found them, from the touches that the recording keeps. A
third of them is held out of a first fit and scored; all of them make the one that is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import synthetic
from models.estimate import Estimate, Result
from models.from_presses import Corrected, correct
from models.motions import Motions, see_motions
from rig import live
from rig.bench import Bench, build_bench
from rig.calibration.alignment import FEWEST, Alignment, align
from rig.calibration.collect import HOLD, Collector, Score, Taken, rms, targets
from rig.calibration.lens import Lens
from rig.calibration.pose import Pose
from rig.calibration.store import parse
from rig.recording.layout import there
from rig.recording.session import Session
from rig.script import ASKED
from rig.stopwatch import Stopwatch
from rig.view import marks


@dataclass(frozen=True, eq=False)
class Pressed:
    """A known press, and the mean picture (H, W) of the frames in which it stood still."""

    taken: Taken
    picture: NDArray[np.float32]

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
    score : Score
        Of the presses held out.
    """

    lens: Lens
    pose: Pose
    alignment: Alignment
    score: Score


def presses(session: Session) -> list[Pressed]:
    """Find the presses that were asked for in a recording.

    Raises
    ------
    ValueError
        If the scene of the recording does not say where to press.
    OSError
        If the file is damaged.
    """
    collector, found = Collector(targets(session.scene), ASKED), []
    times = session.column("frames/captured")
    images = session.arrays["frames/image"]
    for index in range(session.frames):
        taken = collector.see(marks(_estimate(session.row(index))), float(times[index]))
        if taken:
            first = int(np.searchsorted(times, times[index] - HOLD / 2))
            frames = np.asarray(images[first : index + 1], dtype=np.float32)
            found.append(Pressed(taken, np.asarray(frames.mean(axis=0), dtype=np.float32)))
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
    known = parse(session.calibration, "in the recording").model_copy(update={"presses": None})
    bench = build_bench(session.scene, report, known)
    if not isinstance(bench.camera, synthetic.Camera):
        raise ValueError(
            f"scene '{session.scene.title}' has a camera of kind '{bench.camera.kind}', and presses"
            " correct a pinhole camera; mend it with `touchplate collect`"
        )
    kept = _without_slips(presses(session))
    held = [one for index, one in enumerate(kept) if index % 3 == 2]
    part = [one for index, one in enumerate(kept) if index % 3 != 2]
    true = np.array([one.touch for one in held])
    before = rms(_find(bench, session, held, 1.0), true)
    corrected = _correct(bench, session, part)
    seen = replace(bench, camera=corrected.camera, motions=_look(bench)(corrected.camera))
    after = rms(_find(seen, session, held, corrected.softness), true)
    score = Score(len(held), before[0], after[0], before[1], after[1])
    return _learned(_correct(bench, session, kept), score)


def _without_slips(found: list[Pressed]) -> list[Pressed]:
    if len(found) < FEWEST:
        raise ValueError(
            f"the recording shows {len(found)} known presses and {FEWEST} are needed; record some"
            " with `touchplate collect --record`"
        )
    measured = np.array([one.taken.found for one in found])
    sigma = np.array([one.taken.sigma for one in found])
    slips = align(tuple(one.taken.press for one in found), measured, sigma).slips
    return [one for index, one in enumerate(found) if index not in slips]


def _look(bench: Bench) -> Callable[[synthetic.Camera], Motions]:
    known = bench.motions
    return lambda camera: see_motions(known.modes, camera, bench.height, known.tiles, known.large)


def _correct(bench: Bench, session: Session, pressed: list[Pressed]) -> Corrected:
    chain, _ = replace(bench, strain=False).prepare(session.zero)
    frames = float(np.median([one.taken.frames for one in pressed]))
    count = bench.reference_frames  # that of the mean of frames, less that of the reference
    noise = session.zero.noise * float(np.sqrt((1 / frames + 1 / count) / (1 + 1 / count)))
    touches = np.array([one.touch for one in pressed])
    pictures = [one.picture for one in pressed]
    return correct(bench.camera, _look(bench), chain.reference, pictures, touches, noise)


def _find(
    bench: Bench, session: Session, pressed: list[Pressed], softness: float
) -> NDArray[np.float64]:
    """Find the one touch of each press, (n, 3)."""
    chain, _ = replace(bench, strain=False, most=1).prepare(session.zero)
    watch, found = Stopwatch(lambda: 0.0), []
    for one in pressed:
        estimate = live.sense(chain, one.picture, live.at_rest(chain), watch).estimate
        if estimate.count != 1:
            x, y, _ = one.touch
            raise ValueError(
                f"no touch is found at ({x:.0f}, {y:.0f}) mm where the recording shows a known"
                " press; press harder, or look at it with `touchplate replay`"
            )
        found.append((*estimate.xy[0], estimate.force[0] / softness))
    return np.array(found)


def _learned(corrected: Corrected, score: Score) -> Learned:
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
    return Learned(lens, pose, alignment, score)


def _estimate(row: dict[str, NDArray]) -> Estimate:
    """Touches that were found when a frame was recorded."""
    place = there(row["touches/place"])
    blocks = row["touches/covariance"][: len(place)]
    spread = np.zeros((3 * len(place), 3 * len(place)))
    for index, block in enumerate(blocks):
        own = slice(3 * index, 3 * index + 3)
        spread[own, own] = block
    return Estimate(place[:, :2], place[:, 2], spread, 0.0, 1, 1.0, Result.FOUND)
