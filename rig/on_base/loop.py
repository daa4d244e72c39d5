"""The live loop on a base: frames in, snapshots out, every stage timed from the capture."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from math import isfinite
from typing import Any

import numpy as np

from rig.live.baseline import ReferenceFrame
from rig.live.first_frames import take_reference
from rig.live.learned import Learned
from rig.live.live_loop import Progress, to_nobody
from rig.live.loop import MISSED, SILENCE
from rig.live.notice import Notice
from rig.live.pace import LATENCY, Pace
from rig.live.run_score import RunScore
from rig.live.snapshot import BaseReading, Sign, Snapshot
from rig.live.view import empty_snapshot, plate_view, tracked_marks, true_marks
from rig.on_base.background import Background, in_a_thread
from rig.on_base.base_bench import BaseBench
from rig.on_base.follower import SurfaceFollower, SurfaceResult
from rig.system.frame import Frame, Source
from rig.system.timing import Stopwatch

LOOSE = 1.3  # times the noise of a frame, of what is left of an image
BUMPED = 1.0  # px
COARSE = 5.0  # mm


class SurfaceLoop:
    """Runs a bench with a base on a source, frame by frame; iterate over it for the snapshots.

    Parameters
    ----------
    bench : BaseBench
    source : Source
        The plate must be flat for the frames that the reference takes.
    clock : callable
        Monotonic time, s; the same that stamps the frames.
    reference : ReferenceFrame or None
        The flat plate, where the source knows it.
    background : callable
        Does what takes seconds; see `Background`.
    on_rest : callable
        Called once, when the bent plate at rest was taken: it may be touched.
    """

    def __init__(
        self,
        bench: BaseBench,
        source: Source,
        clock: Callable[[], float] = time.monotonic,
        reference: ReferenceFrame | None = None,
        background: Background = in_a_thread,
        on_rest: Callable[[], object] = lambda: None,
    ):
        self.bench = bench
        self.pace = Pace(bench.rate)
        self.watch = Stopwatch(clock)
        self.score = RunScore(bench.min_force)
        self.outcomes: Counter[str] = Counter()
        self._source, self._clock, self._background = source, clock, background
        self._reference, self._on_rest = reference, on_rest
        self._view = plate_view(bench.plate, bench.camera)
        self._follower: SurfaceFollower | None = None
        self._silence, self._begun = SILENCE, False
        self._notice = Notice()
        self._last: BaseReading | None = None

    @property
    def learned(self) -> Learned | None:
        """Nothing is learned of a bench with a base."""
        return None

    @property
    def known(self) -> None:
        """The bench counts as exact."""
        return

    def get_ready(self, progress: Progress = to_nobody) -> SurfaceFollower:
        """Take the reference of the flat plate.

        Parameters
        ----------
        progress : callable
            Takes how many steps are done, of how many, and what can be shown meanwhile.

        Raises
        ------
        OSError
            If no frame comes for some seconds.
        ValueError
            If something touched the plate or moved whenever the reference was taken.
        """
        if self._follower:
            return self._follower
        if self._reference is None:
            self._reference, pace = take_reference(self._source, self.bench.dic.reference_frames)
            self._silence = max(SILENCE, MISSED * pace)
        rest = Frame(0, self._clock(), np.rint(self._reference.image).astype(np.uint8))
        sentence = "the flat plate was taken: the base may be bent now"
        snapshot = empty_snapshot(rest, self.bench.plate.size, self._view, sentence)
        progress(1, 1, replace(snapshot, fresh=False))
        parts = self.bench, self._reference, self.watch, self._clock, self._background
        self._follower = SurfaceFollower(*parts)
        return self._follower

    def __iter__(self) -> Iterator[Snapshot]:
        """Get ready, then yield a snapshot a frame until the source ends.

        Raises
        ------
        OSError, ValueError
            See `get_ready`.
        """
        follower = self.get_ready()
        snapshot: Snapshot | None = None
        while True:
            try:
                frame = self._source.grab(self._silence)
            except EOFError:
                return
            if frame:
                snapshot = self._take(frame, follower)
            elif snapshot:
                snapshot = self._without_frame(snapshot, follower)
            if snapshot:
                yield snapshot

    def tare(self) -> None:
        """Identify the shape anew and take the bent plate at rest, while nothing touches.

        The reference stays that of the flat plate, with which every base is compared.
        """
        self.get_ready().search()
        self._notice.say("tare: the shape of the base is identified anew, touch nothing")

    def weigh(self, force: float) -> None:
        """Refuse a known weight.

        Raises
        ------
        ValueError
            Always.
        """
        raise ValueError(
            f"a known weight of {force:g} N says nothing of a plate that is bent by its base; lay"
            " it on the flat plate, without [base]"
        )

    def summary(self) -> dict[str, Any]:
        """Figures of the run so far, ready for JSON."""
        return self.pace.summary(self.watch) | {
            "pattern": self.score.summary(),
            "strain": None,
            "net": None,
            "recorded": None,
            "learned": None,
            "diagnosis": "",
            "base": self._base_summary(),
        }

    def _base_summary(self) -> dict[str, Any]:
        taken = self._follower.preparation.taken if self._follower else []
        return {
            "last": _as_json(self._last) if self._last else None,
            "outcomes": dict(self.outcomes),
            "shapes_prepared": len(taken),
            "prepare_s": float(np.median(taken)) if taken else None,
        }

    def _take(self, frame: Frame, follower: SurfaceFollower) -> Snapshot:
        self.pace.begin(frame.sequence, frame.captured)
        result = follower.process(frame)
        self.outcomes[result.outcome] += 1
        self._last = result.base or self._last
        errors = self._score(frame, result)
        self.pace.finish(self._clock())
        if follower.knows_rest and not self._begun:
            self._begun = True
            self._on_rest()
        return self._snapshot(frame, follower, result, errors)

    def _score(self, frame: Frame, result: SurfaceResult) -> tuple[float, float] | None:
        """Score a frame that says what touches; those that cannot know are counted by outcome."""
        if frame.truth is None or not result.knows:
            return None
        return self.score.add(result.estimate, frame.truth)

    def _without_frame(self, snapshot: Snapshot, follower: SurfaceFollower) -> Snapshot:
        return replace(
            snapshot,
            touches=(),
            truth=None,
            status=self._source.status,
            strain_reason="no frames come",
            fresh=False,
            signs=(),
            estimate=None,
            events=follower.miss(self._clock()),
            base=None,
        )

    def _snapshot(
        self,
        frame: Frame,
        follower: SurfaceFollower,
        result: SurfaceResult,
        errors: tuple[float, float] | None,
    ) -> Snapshot:
        view = follower.ready.view if follower.ready else self._view
        running, said = self.score.running(), result.said
        empty = empty_snapshot(frame, self.bench.plate.size, view, result.sentence)
        return replace(
            empty,
            touches=tracked_marks(result.tracks, result.estimate),
            truth=None if frame.truth is None else true_marks(frame.truth),
            position_error=errors[0] if errors else None,
            force_error=errors[1] if errors else None,
            position_error_median=running[0] if running else None,
            force_error_median=running[1] if running else None,
            fps=self.pace.fps,
            dropped=self.pace.dropped,
            stages=tuple(row for row in self.watch.table() if row[0] != LATENCY),
            latency=self.watch.quantiles(LATENCY),
            noise=float("nan") if said is None else float(np.sqrt(said.misfit)),
            strain_reason="a bent plate has no map of strain",
            events=result.events,
            signs=(*_signs(result, follower), *self.pace.signs),
            estimate=result.estimate,
            notice=self._notice.at(frame.captured),
            base=result.base,
        )


def _as_json(reading: BaseReading) -> dict[str, Any]:
    """Give a reading as JSON knows it: what is not finite becomes None."""
    return {
        name: None if isinstance(value, float) and not isfinite(value) else value
        for name, value in asdict(reading).items()
    }


def _signs(result: SurfaceResult, follower: SurfaceFollower) -> tuple[Sign, ...]:
    """Say how good a frame is."""
    said, ready = result.said, follower.ready
    if said is None or ready is None:
        return ()
    left = float(np.sqrt(said.misfit)) / ready.shape.noise
    shift = float(np.hypot(*said.motion[-6:-4]))
    travelled = ready.shape.travelled(said.motion)
    signs = (
        Sign("misfit", f"{left:.2f} of the noise", left > LOOSE),
        Sign("camera moved", f"{shift:.2f} px", shift > BUMPED),
        Sign("base moved", f"{travelled:.0%} of range", travelled > 1.0),
    )
    if not result.estimate.count:
        return signs
    variances = np.diag(result.estimate.covariance).reshape(-1, 3)
    place = float(np.sqrt((variances[:, 0] + variances[:, 1]).max() / 2))
    force = float(np.sqrt(variances[:, 2].max()))
    return (*signs, Sign("touch, σ", f"{place:.2g} mm, {force:.2g} N", place > COARSE))
