"""Presses on demand: where to press next, whether a press stands still, and what it was.

The paper's own validation: targets are shown one after the other; each is pressed until the loop
has seen it stable for a while, and let go of before the next is shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import fe
from rig.calibration.requested_presses import requested_presses
from rig.live.alignment import Alignment, align
from rig.live.snapshot import Mark
from rig.scene import Scene
from rig.scene.source import Files, Folder, Recorded, Video
from rig.system.arrays import F64

HOLD = 0.6  # s that a press must stand still, until a finger has settled
FRAMES = 12  # last ones of a press that count, or all of the second half of HOLD if more
FEWEST_FRAMES = 4  # that must show it still, for as long as a slow machine takes to see them
STEADY = 0.05  # of the force, by which it may vary meanwhile, beside what its noise explains
NOISE = 4.0  # standard deviations that noise may explain
NEAR = 30.0  # mm from its target: further away somebody pressed something else
# What a plate keeps of a press for minutes, up to a twentieth, looks like a weak touch.
WEAK = 0.15  # of the strongest touch, below which another is no finger
LET_GO = 0.3  # of a press, below which what is still seen at its place is no finger


def targets(scene: Scene) -> tuple[fe.Touch, ...]:
    """Return the presses that a collection on a scene asks for, in their order.

    Raises
    ------
    ValueError
        If the scene does not say where and how hard to press, or its images are recorded.
    """
    require_live(scene)
    if scene.plate is None or scene.touches is None or scene.source is None:
        raise ValueError(
            f"scene '{scene.title}' needs [touches] and a [source] to collect presses; add them,"
            " as twin has them"
        )
    seed = scene.source.seed if scene.source.kind == "twin" else 0
    return requested_presses(scene.plate.size, scene.touches.force, seed)


def require_live(scene: Scene) -> None:
    """Refuse to ask for presses in images that are recorded: they are where they are.

    Raises
    ------
    ValueError
        If the source of the scene is a folder, files, a video or a recording.
    """
    if isinstance(scene.source, Folder | Files | Video | Recorded):
        raise ValueError(
            f"scene '{scene.title}' takes recorded images (source.kind = '{scene.source.kind}'),"
            " and no press can be asked for in them; name the list of their presses with --list,"
            " or give it to `touchplate calibrate bench`"
        )


def recorded_images(scene: Scene) -> Path:
    """Return the folder, video or names of images that a scene takes.

    Raises
    ------
    ValueError
        If it takes no such images.
    """
    match scene.source:
        case Folder(path=path) | Files(path=path) | Video(path=path):
            return Path(path)
        case _:
            raise ValueError(
                "a list names presses in recorded images; give their folder or video with --images"
            )


@dataclass(frozen=True, eq=False)
class Taken:
    """A press that was asked for, and the mean of what was found while it stood still.

    Attributes
    ----------
    press : Press
        Where and how hard it was; the force is that of a scale under the plate, or of the script.
    found : (3,) float64
        x, y mm, and force N.
    sigma : (3,) float64
        Standard deviations of one frame.
    frames : int
    """

    press: fe.Touch
    found: F64
    sigma: F64
    frames: int


@dataclass
class Collector:
    """Leads through targets; feed it with the touches of every frame.

    A press on a target that was not asked for yet counts as well.

    Attributes
    ----------
    targets : sequence of fe.Touch
    wanted : int
        Number of presses after which it is enough.
    taken : list of Taken
    fewest : int
        Frames that must show a press still.
    """

    targets: Sequence[fe.Touch]
    wanted: int
    taken: list[Taken] = field(default_factory=list[Taken])
    fewest: int = FEWEST_FRAMES
    _held: list[tuple[float, F64, F64]] = field(default_factory=list[tuple[float, F64, F64]])
    _released: bool = True

    @property
    def target(self) -> fe.Touch | None:
        """Where to press now; None when enough were taken."""
        done = {one.press for one in self.taken}
        left = (touch for touch in self.targets if touch not in done)
        return next(left, None) if len(self.taken) < self.wanted else None

    @property
    def sentence(self) -> str:
        """What to do now, for the user."""
        target = self.target
        if target is None:
            return f"all {len(self.taken)} presses are taken"
        if not self._released:
            return "let go"
        return (
            f"press {len(self.taken) + 1} of {self.wanted}: at {target.x:.0f},"
            f" {target.y:.0f} mm with {target.force:.1f} N, and hold still"
        )

    def add_frame(self, marks: Sequence[Mark], time: float) -> Taken | None:
        """Follow a frame; gives the press that it completes, if it does.

        Parameters
        ----------
        marks : sequence of Mark
            Touches as they were found, without what known presses correct.
        time : float, s
            When the frame was captured.
        """
        mark = _finger(marks)
        self._released |= mark is None or self._has_let_go(mark)
        pressed = self._pressed(mark)
        if self.target is None or not self._released or mark is None or pressed is None:
            self._held = []
            return None
        found = np.array([mark.x, mark.y, mark.force])
        sigma = np.array([mark.sigma_x, mark.sigma_y, mark.sigma_force])
        self._held.append((time, found, sigma))
        self._held = [one for one in self._held if _still(one[1], found, sigma)]
        if time - self._held[0][0] < HOLD or len(self._held) < self.fewest:
            return None
        settled = sum(time - one[0] <= HOLD / 2 for one in self._held)
        values = np.array([one[1] for one in self._held[-max(settled, FRAMES) :]])
        taken = Taken(pressed, values.mean(axis=0), sigma, len(values))
        self.taken.append(taken)
        self._released, self._held = False, []
        return taken

    def _has_let_go(self, mark: Mark) -> bool:
        """Whether what is seen now is only what the last press left behind."""
        if not self.taken:
            return True
        x, y, force = self.taken[-1].found
        return np.hypot(mark.x - x, mark.y - y) > NEAR or mark.force < LET_GO * force

    def _pressed(self, mark: Mark | None) -> fe.Touch | None:
        """Target that one finger presses and that was not taken yet."""
        if mark is None or not self.targets:
            return None
        away = [np.hypot(mark.x - touch.x, mark.y - touch.y) for touch in self.targets]
        nearest = self.targets[int(np.argmin(away))]
        if min(away) > NEAR or nearest in {one.press for one in self.taken}:
            return None
        return nearest


def _finger(marks: Sequence[Mark]) -> Mark | None:
    """Return the one finger beside what the plate keeps of others; None of several or none."""
    strongest = max(marks, key=lambda mark: mark.force, default=None)
    if strongest is None:
        return None
    others = (mark.force for mark in marks if mark is not strongest)
    return strongest if all(force < WEAK * strongest.force for force in others) else None


def _still(before: F64, now: F64, sigma: F64) -> bool:
    return bool(abs(now[2] - before[2]) < STEADY * now[2] + NOISE * sigma[2])


@dataclass(frozen=True)
class HeldOutScore:
    """Presses held out, one at a time: RMS errors as found, and as the others correct them.

    Places in mm, forces as fractions; slips are not among them.
    """

    held_out: int
    place_before: float
    place_after: float
    force_before: float
    force_after: float

    @property
    def helps(self) -> bool:
        """Whether places and forces together did not get worse, as fractions of what they were."""
        after, before = self.place_after * self.force_after, self.place_before * self.force_before
        return after <= before


def score(taken: Sequence[Taken]) -> tuple[Alignment, HeldOutScore]:
    """Fit what known presses correct, and score each press by a fit to all others.

    Raises
    ------
    ValueError
        If there are too few presses.
    """
    presses = tuple(one.press for one in taken)
    found = np.array([one.found for one in taken]).reshape(-1, 3)
    sigma = np.array([one.sigma for one in taken]).reshape(-1, 3)
    correction = align(presses, found, sigma)
    fair = np.setdiff1d(np.arange(len(taken)), correction.slips)
    after = found.copy()
    for index in fair:
        others = np.arange(len(taken)) != index
        kept = tuple(press for press, other in zip(presses, others, strict=True) if other)
        part = align(kept, found[others], sigma[others])
        after[[index]] = part.correct(found[[index]])
    true = np.array([(press.x, press.y, press.force) for press in presses])
    before, after = (rms(given[fair], true[fair]) for given in (found, after))
    return correction, HeldOutScore(len(fair), before[0], after[0], before[1], after[1])


def rms(found: F64, true: F64) -> tuple[float, float]:
    """RMS distance, mm, and RMS error of the force as a fraction, of touches (n, 3)."""
    away = np.square(found[:, :2] - true[:, :2]).sum(axis=1)
    force = np.square(found[:, 2] / true[:, 2] - 1)
    return float(np.sqrt(away.mean())), float(np.sqrt(force.mean()))
