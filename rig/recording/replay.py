"""The loop once more on a recording: the same images, from the same states, the same touches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from rig.live.bench import Bench
from rig.live.frame_estimate import FrameEstimate
from rig.live.plate_in_time import Past
from rig.live.reported import report_frame
from rig.live.strain_chain import with_strain
from rig.recording.layout import covariances, places, state, there
from rig.recording.session import Session, frame
from rig.system.arrays import AnyArray
from rig.system.frame import Frame
from rig.system.timing import Stopwatch

ROUNDING = 1e-9
"""Of the largest number, by which touches may differ on an inferred bench: its equilibrium goes on
from the one before, which is not kept. On an exact bench they are the same bit for bit."""


@dataclass(frozen=True, eq=False)
class Replayed:
    """One frame, what is found in it now, and whether that is what was found then."""

    frame: Frame
    frame_estimate: FrameEstimate
    same: bool


def replay(session: Session, bench: Bench, watch: Stopwatch) -> Iterator[Replayed]:
    """Find the touches of every whole frame again.

    A frame starts from the state that was recorded with it and not from what the last one gives, so
    that frames which are not in the file make no difference. How a plate rings and what it has
    crept to is not in the file: that goes on from frame to frame, from a plate at rest in the first
    one and in that of a new reference.

    Raises
    ------
    OSError
        If the file is damaged.
    """
    used, prepared, past = 0, bench.prepare_all(session.reference), Past()
    for index in range(session.frames):
        row = session.row(index)
        recorded = frame(row)
        number, reference = session.reference_of(row)
        if number != used:
            used, prepared, past = number, bench.prepare_all(reference), Past()
        begun, when = replace(state(row), past=past), recorded.captured
        chain, net = prepared.chain, prepared.net
        found = report_frame(chain, net, recorded.image, begun, watch, time=when)
        past = found.state.past
        found = with_strain(prepared.strain, found, watch, bench.alignment)
        rounding = 0.0 if prepared.chain.estimator.bench is None else ROUNDING
        same = _same(places(found.estimate), row["touches/place"], rounding)
        same &= _same(covariances(found.estimate), row["touches/covariance"], rounding)
        if prepared.strain:
            same &= _same(places(found.from_strain), row["touches/from_strain"], rounding)
        yield Replayed(recorded, found, same)


def _same(now: AnyArray, padded: AnyArray, rounding: float) -> bool:
    then = there(padded)
    if now.shape != then.shape:
        return False
    largest = float(np.abs(then[np.isfinite(then)]).max(initial=0.0))
    return np.allclose(now, then, rtol=0.0, atol=rounding * largest)
