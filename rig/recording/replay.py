"""The loop once more on a recording: the same images, from the same states, the same touches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig.live.bench import Bench
from rig.live.frame_estimate import FrameEstimate, estimate_frame
from rig.live.strain_chain import with_strain
from rig.recording.layout import covariances, places, state, there
from rig.recording.session import Session, frame
from rig.system.frame import Frame
from rig.system.timing import Stopwatch


@dataclass(frozen=True, eq=False)
class Replayed:
    """One frame, what is found in it now, and whether that is what was found then, bit for bit."""

    frame: Frame
    frame_estimate: FrameEstimate
    same: bool


def replay(session: Session, bench: Bench, watch: Stopwatch) -> Iterator[Replayed]:
    """Find the touches of every whole frame again.

    A frame starts from the state that was recorded with it and not from what the last one gives, so
    that frames which are not in the file make no difference.

    Raises
    ------
    OSError
        If the file is damaged.
    """
    used, prepared = 0, bench.prepare_all(session.reference)
    for index in range(session.frames):
        row = session.row(index)
        recorded = frame(row)
        number, reference = session.reference_of(row)
        if number != used:
            used, prepared = number, bench.prepare_all(reference)
        chain, strain_chain, net = prepared.chain, prepared.strain, prepared.net
        frame_estimate = estimate_frame(chain, recorded.image, state(row), watch)
        if net:
            frame_estimate = net.estimate(chain, recorded.image, frame_estimate, watch)
        frame_estimate = with_strain(strain_chain, frame_estimate, watch, bench.alignment)
        same = np.array_equal(places(frame_estimate.estimate), there(row["touches/place"]))
        same &= np.array_equal(
            covariances(frame_estimate.estimate), there(row["touches/covariance"])
        )
        if strain_chain:
            same &= np.array_equal(
                places(frame_estimate.from_strain), there(row["touches/from_strain"])
            )
        yield Replayed(recorded, frame_estimate, same)
