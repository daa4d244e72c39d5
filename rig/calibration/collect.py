"""Presses on demand: where to press next, whether a press stands still, and what it was.

The paper's own validation: targets are shown one after the other; each is pressed until the loop
has seen it stable for a while, and let go of before the next is shown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import fe
from rig.calibration.alignment import Alignment, align
from rig.snapshot import Mark

HOLD = 0.4  # s that a press must stand still
STEADY = 0.05  # of the force, by which it may vary meanwhile, beside what its noise explains
NOISE = 4.0  # standard deviations that noise may explain
NEAR = 30.0  # mm from its target: further away somebody pressed something else


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
    found: NDArray[np.float64]
    sigma: NDArray[np.float64]
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
    """

    targets: Sequence[fe.Touch]
    wanted: int
    taken: list[Taken] = field(default_factory=list)
    _held: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = field(
        default_factory=list
    )
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

    def see(self, marks: Sequence[Mark], time: float) -> Taken | None:
        """Follow a frame; gives the press that it completes, if it does.

        Parameters
        ----------
        marks : sequence of Mark
            Touches as they were found, without what known presses mend.
        time : float, s
            When the frame was captured.
        """
        self._released |= not marks
        pressed = self._pressed(marks)
        if self.target is None or not self._released or pressed is None:
            self._held = []
            return None
        mark = marks[0]
        found = np.array([mark.x, mark.y, mark.force])
        sigma = np.array([mark.sigma[0], mark.sigma[0], mark.sigma_force])
        self._held.append((time, found, sigma))
        self._held = [one for one in self._held if _still(one[1], found, sigma)]
        if time - self._held[0][0] < HOLD:
            return None
        values = np.array([one[1] for one in self._held])
        taken = Taken(pressed, values.mean(axis=0), sigma, len(values))
        self.taken.append(taken)
        self._released, self._held = False, []
        return taken

    def _pressed(self, marks: Sequence[Mark]) -> fe.Touch | None:
        """Target that one finger presses and that was not taken yet."""
        if len(marks) != 1 or not self.targets:
            return None
        away = [np.hypot(marks[0].x - touch.x, marks[0].y - touch.y) for touch in self.targets]
        nearest = self.targets[int(np.argmin(away))]
        if min(away) > NEAR or nearest in {one.press for one in self.taken}:
            return None
        return nearest


def _still(before: NDArray, now: NDArray, sigma: NDArray) -> bool:
    return bool(abs(now[2] - before[2]) < STEADY * now[2] + NOISE * sigma[2])


@dataclass(frozen=True)
class Score:
    """Held-out presses: RMS errors as found, and after the others mended them; mm and shares."""

    held_out: int
    place_before: float
    place_after: float
    force_before: float
    force_after: float


def score(taken: Sequence[Taken]) -> tuple[Alignment, Score]:
    """Fit what known presses mend to two thirds of them and score it on every third.

    Returns
    -------
    Alignment
        Of all presses, for use.
    Score
        Of those that were held out of another fit.

    Raises
    ------
    ValueError
        If there are too few presses.
    """
    presses = tuple(one.press for one in taken)
    found = np.array([one.found for one in taken]).reshape(-1, 3)
    held = np.arange(len(taken)) % 3 == 2
    kept = tuple(press for press, out in zip(presses, held, strict=True) if not out)
    part = align(kept, found[~held])
    true = np.array([(press.x, press.y, press.force) for press in presses])[held]
    after = found[held].copy()
    after[:, :2] = after[:, :2] @ part.matrix[:, :2].T + part.matrix[:, 2]
    after[:, 2] *= part.gain
    place_before, force_before = _rms(found[held], true)
    place_after, force_after = _rms(after, true)
    return align(presses, found), Score(
        int(held.sum()), place_before, place_after, force_before, force_after
    )


def _rms(found: NDArray, true: NDArray) -> tuple[float, float]:
    away = np.square(found[:, :2] - true[:, :2]).sum(axis=1)
    force = np.square(found[:, 2] / true[:, 2] - 1)
    return float(np.sqrt(away.mean())), float(np.sqrt(force.mean()))
