"""The loop once more on a recording: the same pictures, from the same states, the same touches."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rig.live import chain as live
from rig.live.bench import Bench
from rig.recording.layout import covariances, places, state, there
from rig.recording.session import Session, frame
from rig.system.frame import Frame
from rig.system.timing import Stopwatch


@dataclass(frozen=True, eq=False)
class Replayed:
    """One frame, what is found in it now, and whether that is what was found then, bit for bit."""

    frame: Frame
    sensed: live.FrameEstimate
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
    chain, strain_chain = bench.prepare(session.zero)
    net = bench.prepare_net(session.zero, chain)
    for index in range(session.frames):
        row = session.row(index)
        shot = frame(row)
        sensed = live.estimate_frame(chain, shot.image, state(row), watch)
        if net:
            sensed = net.tell(chain, shot.image, sensed, watch)
        sensed = live.with_strain(strain_chain, sensed, watch, bench.alignment)
        same = np.array_equal(places(sensed.estimate), there(row["touches/place"]))
        same &= np.array_equal(covariances(sensed.estimate), there(row["touches/covariance"]))
        if strain_chain:
            same &= np.array_equal(places(sensed.from_strain), there(row["touches/from_strain"]))
        yield Replayed(shot, sensed, same)
