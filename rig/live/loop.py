"""The live loop: frames in, snapshots out, with every stage timed from the capture."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from models import BenchEstimate, Estimate, Tap, noise_from_sums
from rig.live.baseline import ReferenceFrame
from rig.live.bench import Bench
from rig.live.diagnosing import Diagnosing
from rig.live.first_frames import take_reference
from rig.live.first_touches import FirstTouches
from rig.live.frame_estimate import FrameEstimate
from rig.live.frame_record import FrameRecord, Recorder
from rig.live.gestures import Gesture, Gestures
from rig.live.learned import Learned
from rig.live.learning import Learning
from rig.live.live_loop import Progress, to_nobody
from rig.live.pace import LATENCY, Pace
from rig.live.quality import signs
from rig.live.run_score import RunScore
from rig.live.snapshot import Mark, Snapshot, StrainOverlay
from rig.live.strain_chain import StrainChain
from rig.live.tare import Tare
from rig.live.tracker import FrameProcessor, FrameResult
from rig.live.view import (
    View,
    empty_snapshot,
    marks,
    plate_view,
    strain_map,
    tracked_marks,
    true_marks,
)
from rig.system.frame import Frame, Source, Stored
from rig.system.timing import Stopwatch

SILENCE = 0.5  # s without a frame after which the user is warned,
MISSED = 3  # or so many of the intervals between the frames of the reference, if these are longer
SHOWN = 1.0  # s that a gesture stays in the snapshots, for those who do not see every frame


class Loop:
    """Runs a bench on a source, frame by frame; iterate over it for the snapshots.

    Parameters
    ----------
    bench : Bench
    source : Source
        The plate must be untouched for the frames that the reference takes.
    clock : callable
        Monotonic time, s; the same that stamps the frames.
    recorder : Recorder or None
        Keeps what every frame said; it never holds the loop up.
    reference : ReferenceFrame or None
        The plate at rest, where the source knows it.
    """

    def __init__(
        self,
        bench: Bench,
        source: Source,
        clock: Callable[[], float] = time.monotonic,
        recorder: Recorder | None = None,
        reference: ReferenceFrame | None = None,
    ):
        self.bench = bench
        self.pace = Pace(bench.rate)
        self.watch = Stopwatch(clock)
        self.pattern_score = RunScore(bench.min_force)
        self.strain_score = RunScore(bench.min_force)
        self.net_score = RunScore(bench.min_force)
        self._recorder = recorder
        self._source = source
        self._clock = clock
        self._reference = reference
        self._view = plate_view(bench.plate, bench.camera)
        self._follower: FrameProcessor | None = None
        self._silence = SILENCE
        self._gestures, self._recent = Gestures(), tuple[Gesture, ...]()
        self._taps: tuple[Tap, ...] = ()
        self._tare = Tare(bench)
        self._learning = _learning(bench, source)
        self._diagnosing = _diagnosing(bench, source)
        self._recorded = False

    def get_ready(self, progress: Progress = to_nobody) -> FrameProcessor:
        """Take the reference and pass all that may come through the chain, so that nothing waits.

        Parameters
        ----------
        progress : callable
            Takes how many steps are done, of how many, and what can be shown meanwhile.

        Raises
        ------
        OSError
            If no frame comes for some seconds before the reference is there.
        ValueError
            If something touched the plate or moved whenever the reference was taken.
        """
        if self._follower:
            return self._follower
        if self._reference is None:
            self._reference, pace = take_reference(self._source, self.bench.reference_frames)
            self._silence = max(SILENCE, MISSED * pace)
        reference = self._reference
        rest = Frame(0, self._clock(), np.rint(reference.image).astype(np.uint8))

        def report(done: int, total: int, what: str) -> None:
            status = f"getting ready: {what} ({done} of {total})"
            snapshot = empty_snapshot(rest, self.bench.plate.size, self._view, status)
            progress(done, total, replace(snapshot, fresh=False))

        self._follower = FrameProcessor(self.bench, reference, self.watch, self._clock, report)
        if self._recorder:
            self._recorder.begin(reference, self._follower.chain, self._follower.strain is not None)
        return self._follower

    def __iter__(self) -> Iterator[Snapshot]:
        """Get ready, then yield a snapshot a frame until the source ends.

        While no frames come, the last one is shown without touches and with what the source says.

        Raises
        ------
        OSError, ValueError
            See `get_ready`.
        """
        follower, view = self.get_ready(), self._view
        snapshot: Snapshot | None = None
        while True:
            try:
                frame = self._source.grab(self._silence)
            except EOFError:
                return
            if frame:
                snapshot = self._take(frame, follower, view)
            elif snapshot:
                snapshot = self._without_frame(snapshot, follower)
            if snapshot:
                yield snapshot

    def tare(self) -> None:
        """Renew the reference from the next frames, while nothing touches.

        The notice of the snapshots says the outcome: a touch that is held refuses it. Frames
        go on meanwhile, against the reference so far.
        """
        self._tare.ask()

    def weigh(self, force: float) -> None:
        """Take the touch that is held next as a known weight, which sets the newton.

        The notice of the snapshots says the outcome.

        Parameters
        ----------
        force : float, N

        Raises
        ------
        ValueError
            If the bench is exact, or the weight too small.
        """
        if self._learning is None:
            raise ValueError(
                "a known weight teaches nothing of a bench that is just as the scene says; set"
                ' estimator.bench to "usual", or calibrate the bench'
            )
        self._learning.weigh(force)

    @property
    def learned(self) -> Learned | None:
        """How far the learning of the bench has come; None where the bench is exact."""
        return self._learning.learned if self._learning else None

    @property
    def known(self) -> BenchEstimate | None:
        """What is known of the bench; None where it counts as exact."""
        return self.bench.known

    def summary(self) -> dict[str, Any]:
        """Figures of the run so far, ready for JSON."""
        return self.pace.summary(self.watch) | {
            "pattern": self.pattern_score.summary(),
            "strain": self.strain_score.summary() if self._from_strain else None,
            "net": self.net_score.summary() if self.bench.net else None,
            "recorded": self._recorder.summary() if self._recorder else None,
            "learned": self._learning.learned.summary if self._learning else None,
            "diagnosis": self._diagnosing.sentence if self._diagnosing else "",
        }

    @property
    def _from_strain(self) -> bool:
        return self.bench.strain and self.bench.strain_touches

    def _strain_marks(self, found: FrameEstimate) -> tuple[Mark, ...] | None:
        if not self._from_strain:
            return None
        return () if found.from_strain is None else marks(found.from_strain)

    def _take(self, frame: Frame, follower: FrameProcessor, view: View) -> Snapshot:
        self.pace.begin(frame.sequence, frame.captured)
        self._renew(follower)
        self._begin_recording(follower)
        result = follower.process(frame)
        cause = self._diagnose(follower, result)
        self._learn(frame, follower, result)
        shift = result.frame_estimate.state.motion[follower.chain.pattern.count :][:2]
        self._tare.follow(frame, result.frame_estimate, shift)
        sentence = follower.sentence(result.frame_estimate, cause)
        if self._recorder:
            identities = result.identities
            self._recorder.put(
                FrameRecord(frame, result.before, result.frame_estimate, identities, sentence)
            )
        self._follow_gestures(frame, result)
        taps = self._taps + result.frame_estimate.state.past.taps
        self._taps = tuple(one for one in taps if frame.captured - one.time <= SHOWN)
        errors = self._score(frame, result.frame_estimate)
        self.pace.finish(self._clock())
        return self._snapshot(frame, follower, view, result, sentence, errors)

    def _notice(self, time: float) -> str:
        """Say what was done at the user's wish, the tare or a known weight; else what is wrong."""
        learning = self._learning.notice.at(time) if self._learning else ""
        cause = self._diagnosing.notice.at(time) if self._diagnosing else ""
        return self._tare.current_notice(time) or learning or cause

    def _renew(self, follower: FrameProcessor) -> None:
        """Go over to a new reference, where one is ready."""
        if prepared := self._tare.ready():
            follower.renew(prepared)
            self._reference = prepared.reference
            if self._learning:
                self._learning.pause()
            if self._diagnosing:
                self._diagnosing.pause()
            if self._recorder:
                self._recorder.renew(prepared.reference, prepared.chain)

    def _begin_recording(self, follower: FrameProcessor) -> None:
        """Stand on the bench that a recording names, from its first frame on.

        What was learned moves the chain by little steps, which a replay does not know: it prepares
        the bench at once, and so does the loop, whose next frames wait for it.
        """
        recorded = self._recorder is not None and self._recorder.summary() is not None
        begins, self._recorded = recorded and not self._recorded, recorded
        if begins and self._learning and self.pace.frames and self._reference:
            self._learning.pause()
            if self._diagnosing:
                self._diagnosing.pause()
            follower.stand_still(self.bench.prepare_all(self._reference))

    def _diagnose(self, follower: FrameProcessor, result: FrameResult) -> str:
        """Name what of the bench is otherwise, where it is not known exactly; mostly empty."""
        if self._diagnosing is None or self.bench.known is None:
            return ""
        self._diagnosing.follow(result.frame_estimate, follower.chain, self.bench.known)
        return self._diagnosing.sentence

    def _learn(self, frame: Frame, follower: FrameProcessor, result: FrameResult) -> None:
        """Learn the bench on from a touch that is held, where it is not known exactly.

        While a recording runs nothing is learned: it is replayed on the bench that it names.
        """
        if self._learning is None or self._recorded:
            return
        found = result.frame_estimate
        if known := self._learning.follow(frame.captured, found, follower.chain):
            follower.stand_on(known)
            self.bench = replace(self.bench, known=known.bench)
            self._tare.stand_on(self.bench)
            if self._recorder:
                self._recorder.stand_on(known.bench)

    def _follow_gestures(self, frame: Frame, result: FrameResult) -> None:
        estimate = result.frame_estimate.estimate
        places = zip(result.identities, estimate.xy.tolist(), estimate.force.tolist(), strict=True)
        touches = [
            (identity, x, y, force, _sigma(estimate, index))
            for index, (identity, (x, y), force) in enumerate(places)
        ]
        found = self._recent + self._gestures.follow(touches, frame.captured)
        self._recent = tuple(one for one in found if frame.captured - one.time <= SHOWN)

    def _without_frame(self, snapshot: Snapshot, follower: FrameProcessor) -> Snapshot:
        return replace(
            snapshot,
            touches=(),
            from_strain=() if self._from_strain else None,
            truth=None,
            strain=None,
            status=self._source.status,
            strain_reason="no frames come",
            fresh=False,
            signs=(),
            estimate=None,
            events=follower.miss(self._clock()),
            taps=(),
        )

    def _score(self, frame: Frame, frame_estimate: FrameEstimate) -> tuple[float, float] | None:
        if frame.truth is None:
            return None
        if frame_estimate.from_strain is not None:
            self.strain_score.add(frame_estimate.from_strain, frame.truth)
        if frame_estimate.from_pattern is not None:
            self.pattern_score.add(frame_estimate.from_pattern, frame.truth)
            return self.net_score.add(frame_estimate.estimate, frame.truth)
        return self.pattern_score.add(frame_estimate.estimate, frame.truth)

    def _snapshot(
        self,
        frame: Frame,
        follower: FrameProcessor,
        view: View,
        result: FrameResult,
        sentence: str,
        errors: tuple[float, float] | None,
    ) -> Snapshot:
        score = self.net_score if self.bench.net else self.pattern_score
        frame_estimate, running = result.frame_estimate, score.running()
        shown = _shown(follower.strain, frame_estimate)
        return Snapshot(
            sequence=frame.sequence,
            captured=frame.captured,
            image=frame.image,
            plate_size=self.bench.plate.size,
            plate_outline=view.outline,
            T_px_plate=view.T_px_plate,
            touches=tracked_marks(result.tracks, frame_estimate.estimate),
            from_strain=self._strain_marks(frame_estimate),
            truth=None if frame.truth is None else true_marks(frame.truth),
            strain=shown,
            status=sentence,
            position_error=errors[0] if errors else None,
            force_error=errors[1] if errors else None,
            position_error_median=running[0] if running else None,
            force_error_median=running[1] if running else None,
            fps=self.pace.fps,
            dropped=self.pace.dropped,
            stages=tuple(row for row in self.watch.table() if row[0] != LATENCY),
            latency=self.watch.quantiles(LATENCY),
            noise=noise_from_sums(frame_estimate.sums, follower.chain.reference.tiles),
            strain_reason="" if shown else "the scene names no [comparison] by strain",
            events=result.events,
            gestures=self._recent,
            signs=(*signs(follower.chain, frame_estimate), *self.pace.signs),
            estimate=frame_estimate.estimate,
            notice=self._notice(frame.captured),
            learned=self.learned,
            taps=frame_estimate.state.past.taps,
            recent_taps=self._taps,
            late=frame.late,
        )


def _learning(bench: Bench, source: Source) -> Learning | None:
    """Learn of a bench that is not known exactly."""
    if not bench.known:
        return None
    first = FirstTouches(bench.known, bench.camera) if bench.known.is_prior else None
    return Learning(bench.known, bench.reference_frames, first, isinstance(source, Stored))


def _diagnosing(bench: Bench, source: Source) -> Diagnosing | None:
    """Diagnose a bench that is not known exactly."""
    if not bench.known:
        return None
    return Diagnosing(bench.camera, bench.reference_frames, isinstance(source, Stored))


def _sigma(estimate: Estimate, index: int) -> float:
    """Return the standard deviation of a place in its worst direction, mm; infinite if unknown."""
    spread = estimate.touch_covariance(index)[:2, :2]
    return float(np.sqrt(np.linalg.eigvalsh(spread)[-1])) if np.isfinite(spread).all() else inf


def _shown(strain_chain: StrainChain | None, frame_estimate: FrameEstimate) -> StrainOverlay | None:
    if strain_chain is None or frame_estimate.strain is None:
        return None
    return strain_map(strain_chain, frame_estimate.strain)
