"""The live loop: frames in, snapshots out, with every stage timed from the capture."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from models.estimate import Estimate, Result
from models.pattern import noise_of
from rig import live
from rig.bench import Bench
from rig.recording.shot import Recorder, Shot
from rig.snapshot import Snapshot, StrainMap
from rig.source import Frame, Source
from rig.stopwatch import Stopwatch
from rig.tally import Tally
from rig.track import Event, Tracks
from rig.view import View, look, marks, strain_map, true_marks
from rig.zero import Zero, fits, restless, share, take_zero

PATIENCE = 5.0  # s without a frame after which the source is given up
LATENCY = "capture to touches"
Tracked = tuple[tuple[int, ...], tuple[Event, ...]]
ATTEMPTS = 30  # series of reference frames that are thrown away because something moved
PACE = 60  # frames over which the running rate is measured


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
    """

    def __init__(
        self,
        bench: Bench,
        source: Source,
        clock: Callable[[], float] = time.monotonic,
        recorder: Recorder | None = None,
    ):
        self.bench = bench
        self.dropped = 0
        self.frames = 0
        self.watch = Stopwatch(clock)
        self.tally = Tally(bench.least_force)
        self.strain_tally = Tally(bench.least_force)
        self._recorder = recorder
        self._source = source
        self._clock = clock
        self._first: float | None = None
        self._finished: deque[float] = deque(maxlen=PACE)

    @property
    def fps(self) -> float:
        """Frames a second that the loop finishes now; 0 before the second."""
        if len(self._finished) < 2:
            return 0.0
        return (len(self._finished) - 1) / (self._finished[-1] - self._finished[0])

    @property
    def mean_fps(self) -> float | None:
        """Frames a second from the first to the last; None before the second."""
        if self._first is None or self.frames < 2:
            return None
        return (self.frames - 1) / (self._finished[-1] - self._first)

    def __iter__(self) -> Iterator[Snapshot]:
        """Take the reference, then yield a snapshot a frame until the source is given up.

        Raises
        ------
        OSError
            If no frame comes for `PATIENCE` seconds.
        ValueError
            If something touched the plate or moved whenever the reference was taken.
        """
        zero = self._take_zero()
        chain, strain_chain = self.bench.prepare(zero)
        _warm_up(chain, strain_chain, zero)
        if self._recorder:
            self._recorder.begin(zero, chain, strain_chain is not None)
        view = look(self.bench.plate, self.bench.camera, self.bench.height)
        state, tracks, last = live.at_rest(chain), Tracks(), self._next()
        while True:
            frame = self._next()
            self.dropped += frame.sequence - last.sequence - 1
            settling = share(frame.captured - last.captured)
            found = live.sense(chain, frame.image, state, self.watch, settling)
            self.watch.add(LATENCY, self._clock() - frame.captured)
            sensed = live.with_strain(strain_chain, found, self.watch, self.bench.alignment)
            tracks, identities, events = tracks.follow(sensed.estimate, frame.captured)
            if self._recorder:
                self._recorder.put(Shot(frame, state, sensed, identities))
            state, last = sensed.state, frame
            self.frames += 1
            shown = _shown(strain_chain, sensed)
            errors = self._score(frame, sensed)
            self._finish()
            noise = noise_of(sensed.sums, chain.reference.tiles)
            yield self._snapshot(frame, view, sensed, (identities, events), shown, errors, noise)

    def summary(self) -> dict[str, Any]:
        """Figures of the run so far, ready for JSON."""
        median, late = self.watch.quantiles(LATENCY)
        return {
            "frames": self.frames,
            "dropped": self.dropped,
            "fps": self.mean_fps,
            "latency_ms": {"median": median, "p95": late},
            "stages_ms": {
                name: {"median": middle, "p95": slow}
                for name, middle, slow in self.watch.table()
                if name != LATENCY
            },
            "pattern": self.tally.summary(),
            "strain": self.strain_tally.summary() if self.bench.strain else None,
            "recorded": self._recorder.summary() if self._recorder else None,
        }

    def _next(self) -> Frame:
        frame = self._source.grab(PATIENCE)
        if frame is None:
            raise OSError(f"the source gave no frame for {PATIENCE:g} s; check that it is running")
        return frame

    def _take_zero(self) -> Zero:
        for _ in range(ATTEMPTS):
            frames = [self._next() for _ in range(self.bench.reference_frames)]
            if any(frame.truth for frame in frames):
                raise ValueError(
                    "plate was touched while the reference was taken; leave the machine more time"
                    " or set dic.reference_frames to fewer"
                )
            images = [frame.image for frame in frames]
            if not restless(images):
                return take_zero(images)
        raise ValueError(
            f"something moved in the picture in each of {ATTEMPTS} series of reference frames;"
            " leave the plate alone, or set camera exposure longer if its light flickers"
        )

    def _finish(self) -> None:
        now = self._clock()
        self._first = now if self._first is None else self._first
        self._finished.append(now)

    def _score(self, frame: Frame, sensed: live.Sensed) -> tuple[float, float] | None:
        if frame.truth is None:
            return None
        if sensed.from_strain is not None:
            self.strain_tally.add(sensed.from_strain, frame.truth)
        return self.tally.add(sensed.estimate, frame.truth)

    def _snapshot(
        self, frame: Frame, view: View, sensed: live.Sensed, tracked: Tracked, shown, errors, noise
    ) -> Snapshot:
        identities, events = tracked
        running = self.tally.running()
        return Snapshot(
            sequence=frame.sequence,
            captured=frame.captured,
            image=frame.image,
            plate_size=self.bench.plate.size,
            plate_outline=view.outline,
            T_px_plate=view.T_px_plate,
            touches=marks(sensed.estimate, identities),
            from_strain=() if sensed.from_strain is None else marks(sensed.from_strain),
            truth=None if frame.truth is None else true_marks(frame.truth),
            strain=shown,
            status=_sentence(sensed.estimate),
            position_error=errors[0] if errors else None,
            force_error=errors[1] if errors else None,
            position_error_median=running[0] if running else None,
            force_error_median=running[1] if running else None,
            fps=self.fps,
            dropped=self.dropped,
            stages=tuple(row for row in self.watch.table() if row[0] != LATENCY),
            latency=self.watch.quantiles(LATENCY),
            noise=noise,
            strain_reason="" if shown else "the scene names no [comparison] by strain",
            events=events,
        )


def _warm_up(chain: live.Chain, strain_chain: live.StrainChain | None, zero: Zero) -> None:
    """Pass the reference through the chain: what compiles does so before time counts."""
    watch = Stopwatch(time.monotonic)
    picture = np.rint(zero.image).astype(np.uint8)
    found = live.sense(chain, picture, live.at_rest(chain), watch)
    live.with_strain(strain_chain, found, watch)


def _sentence(estimate: Estimate) -> str:
    said = estimate.result.value
    if estimate.result is Result.FOUND:
        said = "one touch" if estimate.count == 1 else f"{estimate.count} touches"
    if not fits(estimate):
        said += ", but the picture does not fit: is something in the way, or did the camera jump?"
    return said


def _shown(strain_chain: live.StrainChain | None, sensed: live.Sensed) -> StrainMap | None:
    if strain_chain is None or sensed.strain is None:
        return None
    return strain_map(strain_chain, sensed.strain)
