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
from rig.snapshot import Snapshot
from rig.source import Frame, Source
from rig.stopwatch import Stopwatch
from rig.tally import Tally
from rig.view import View, look, marks, strain_map, true_marks

PATIENCE = 5.0  # s without a frame after which the source is given up
LATENCY = "capture to touches"
DOUBT = 1e-12  # p-value below which touches cannot explain a frame; a clear view stays above 1e-5
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
    """

    def __init__(self, bench: Bench, source: Source, clock: Callable[[], float] = time.monotonic):
        self.bench = bench
        self.dropped = 0
        self.frames = 0
        self.watch = Stopwatch(clock)
        self.tally = Tally(bench.least_force)
        self.strain_tally = Tally(bench.least_force)
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
            If the source knows that the plate was touched while the reference was taken.
        """
        zero = self._take_zero()
        chain, strain_chain = self.bench.prepare(zero)
        _warm_up(chain, strain_chain, zero)
        view = look(self.bench.plate, self.bench.camera, self.bench.height)
        state, from_strain, last = live.at_rest(chain), None, self._next().sequence
        while True:
            frame = self._next()
            self.dropped += frame.sequence - last - 1
            last = frame.sequence
            estimate, sums, state = live.sense(chain, frame.image, state, self.watch)
            self.watch.add(LATENCY, self._clock() - frame.captured)
            strain, shown = None, None
            if strain_chain:
                strain, from_strain = live.sense_strain(strain_chain, sums, from_strain, self.watch)
                shown = strain_map(strain_chain, strain)
            self.frames += 1
            errors = self._score(frame, estimate, from_strain)
            self._finish()
            noise = noise_of(sums, chain.reference.tiles)
            yield self._snapshot(frame, view, estimate, from_strain, shown, errors, noise)

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
        }

    def _next(self) -> Frame:
        frame = self._source.grab(PATIENCE)
        if frame is None:
            raise OSError(f"the source gave no frame for {PATIENCE:g} s; check that it is running")
        return frame

    def _take_zero(self) -> live.Zero:
        frames = [self._next() for _ in range(self.bench.reference_frames)]
        if any(frame.truth for frame in frames):
            raise ValueError(
                "plate was touched while the reference was taken; leave the machine more time or"
                " set dic.reference_frames to fewer"
            )
        return live.take_zero([frame.image for frame in frames])

    def _finish(self) -> None:
        now = self._clock()
        self._first = now if self._first is None else self._first
        self._finished.append(now)

    def _score(
        self, frame: Frame, estimate: Estimate, from_strain: Estimate | None
    ) -> tuple[float, float] | None:
        if frame.truth is None:
            return None
        if from_strain is not None:
            self.strain_tally.add(from_strain, frame.truth)
        return self.tally.add(estimate, frame.truth)

    def _snapshot(
        self, frame: Frame, view: View, estimate, from_strain, shown, errors, noise
    ) -> Snapshot:
        running = self.tally.running()
        return Snapshot(
            sequence=frame.sequence,
            captured=frame.captured,
            image=frame.image,
            plate_size=self.bench.plate.size,
            plate_outline=view.outline,
            T_px_plate=view.T_px_plate,
            touches=marks(estimate),
            from_strain=() if from_strain is None else marks(from_strain),
            truth=None if frame.truth is None else true_marks(frame.truth),
            strain=shown,
            status=_sentence(estimate),
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
        )


def _warm_up(chain: live.Chain, strain_chain: live.StrainChain | None, zero: live.Zero) -> None:
    """Pass the reference through the chain: what compiles does so before time counts."""
    watch = Stopwatch(time.monotonic)
    picture = np.rint(zero.image).astype(np.uint8)
    estimate, sums, _ = live.sense(chain, picture, live.at_rest(chain), watch)
    if strain_chain:
        live.sense_strain(strain_chain, sums, estimate, watch)


def _sentence(estimate: Estimate) -> str:
    said = estimate.result.value
    if estimate.result is Result.FOUND:
        said = "one touch" if estimate.count == 1 else f"{estimate.count} touches"
    if estimate.p_value < DOUBT:
        said += ", but the picture does not fit: is something in the way, or did the camera jump?"
    return said
