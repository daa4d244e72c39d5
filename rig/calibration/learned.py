"""What runs have learned of a bench, kept beside its calibration from one run to the next.

It never replaces what presses have shown: it is a file of its own, stands on one calibration of one
scene, and is left aside where either has changed since. Time makes it less sure, as it does a
calibration.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pydantic import AwareDatetime, Field, ValidationError

import models
from rig.calibration.entries import BenchEntry
from rig.calibration.found_on import FoundOn, found_on
from rig.calibration.store import Calibration, beside, calibration_beside, calibration_warnings
from rig.scene import Scene
from rig.scene.section import Section
from rig.scene.source import DeviceSection, TwinSection
from rig.system import cache

if TYPE_CHECKING:
    from rig.live.live_loop import LiveLoop

EVERY = 60.0  # s after which what is new is written, so that a run that is killed loses little
Number = Annotated[int, Field(ge=0)]


class LearnedBench(Section):
    """A bench as runs have left it: what is known, from how many touches, and since when."""

    date: AwareDatetime
    stands_on: str
    touches: Number
    weights: Number
    bench: BenchEntry

    def sentence(self) -> str:
        """Say how much was learned, and how to be rid of it."""
        weights = f", {self.weights} known weights among them" if self.weights else ""
        return (
            f"the bench goes on from {self.touches} touches of earlier runs{weights}, the last on"
            f" {self.date:%Y-%m-%d}; `touchplate calibrate bench SCENE --forget-learned` forgets"
            " them"
        )


def learned_beside(scene: str | Path) -> Path:
    """Return where that of a scene lies."""
    path = beside(scene)
    return path.with_name(path.name.replace(".calibration.", ".learned."))


def forget_learned(scene: str | Path) -> bool:
    """Delete what runs have learned of a scene; whether there was anything."""
    path = learned_beside(scene)
    there = path.exists()
    path.unlink(missing_ok=True)
    return there


def is_kept(scene: Scene) -> bool:
    """Whether what a run of a scene learns is kept: of a live bench, not of images that were.

    A run over images that were kept ends the same whenever it is repeated.
    """
    return isinstance(scene.source, DeviceSection | TwinSection)


@dataclass(frozen=True)
class Known:
    """What is known when a run begins.

    Attributes
    ----------
    calibration : Calibration
        What was measured and what runs have learned, as sure as it is today.
    notes : tuple of str
        What the user should know, a sentence each.
    keeper : Keeper or None
        Keeps what the run learns; None where that is not kept.
    """

    calibration: Calibration
    notes: tuple[str, ...]
    keeper: Keeper | None = None


def known_now(name: str | Path, scene: Scene, now: datetime) -> Known:
    """Read what is known of a scene's bench, by its name or file.

    Raises
    ------
    OSError, ValueError
        If a file cannot be read or is damaged.
    """
    measured = calibration_beside(name)
    notes = calibration_warnings(measured, scene, now)
    if not is_kept(scene):
        return Known(measured, tuple(notes))
    path, stands_on = learned_beside(name), _stands_on(scene, measured)
    learned, date, touches, weights = read_learned(path), None, 0, 0
    if learned is not None and learned.stands_on == stands_on:
        measured = measured.model_copy(update={"bench": learned.bench})
        date, touches, weights = learned.date, learned.touches, learned.weights
        notes.append(learned.sentence())
    elif learned is not None:
        notes.append(
            f"'{path}' was learned on another calibration or scene and is left aside; it is"
            " replaced by what this run learns"
        )
    keeper = Keeper(path, stands_on, touches, weights, found_on(scene, measured))
    return Known(_aged(measured, scene, date, now), tuple(notes), keeper)


def _stands_on(scene: Scene, calibration: Calibration) -> str:
    """Name what a bench was learned on: plate, camera and estimator, and the calibration."""
    sections = [scene.plate, scene.camera, scene.estimator]
    described = [None if part is None else part.model_dump_json() for part in sections]
    return cache.key("learned", [*described, calibration.model_dump_json(exclude_none=True)])


def _aged(
    calibration: Calibration, scene: Scene, date: datetime | None, now: datetime
) -> Calibration:
    """Let a bench be less sure by the time since it was known; a twin's stands still meanwhile."""
    known, entry = calibration.known_bench(), calibration.bench
    if known is None or entry is None or isinstance(scene.source, TwinSection):
        return calibration
    seconds = (now - (date or entry.date)).total_seconds()
    return calibration.on_bench(models.wandered(known, max(seconds, 0.0)))


def read_learned(path: Path) -> LearnedBench | None:
    """Read what was learned; None where there is no file.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it holds no learned bench.
    """
    if not path.exists():
        return None
    try:
        return LearnedBench.model_validate_json(path.read_bytes())
    except ValidationError:
        raise ValueError(
            f"'{path}' holds no learned bench; delete it, and the next run learns again"
        ) from None


class Keeper:
    """Writes what a run learns beside the calibration, now and then and at its end.

    Parameters
    ----------
    path : Path
    stands_on : str
        The calibration and scene that it was learned on.
    touches, weights : int
        Of earlier runs.
    on : FoundOn or None
        Plate and camera of the scene.
    """

    def __init__(self, path: Path, stands_on: str, touches: int, weights: int, on: FoundOn | None):
        self._path, self._stands_on, self._on = path, stands_on, on
        self._before = touches, weights
        self._written, self._at = 0, None

    def follow(self, loop: LiveLoop, time: float) -> None:
        """Write what is new, if the last time is long ago; `time` is a capture's, s."""
        self._at = time if self._at is None else self._at
        if time - self._at >= EVERY:
            self._at = time
            self.write(loop)

    def write(self, loop: LiveLoop) -> None:
        """Write what a loop has learned, if that is more than was written.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        learned, known = loop.learned, loop.known
        if learned is None or known is None or learned.touches == self._written:
            return
        now = datetime.now(UTC).replace(microsecond=0)
        entry = Calibration().on_bench(known).bench
        if entry is None:
            return
        touches, weights = self._before
        kept = LearnedBench(
            date=now,
            stands_on=self._stands_on,
            touches=touches + learned.touches,
            weights=weights + learned.weights,
            bench=entry.model_copy(update={"found_on": self._on}),
        )
        _replace(self._path, kept.model_dump_json(indent=2, exclude_none=True))
        self._written = learned.touches


def _replace(path: Path, text: str) -> None:
    aside = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        aside.write_text(text, encoding="utf-8")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)
