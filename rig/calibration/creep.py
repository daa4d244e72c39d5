"""How a plate creeps, learned from one press in a recording that was held and let go."""

from __future__ import annotations

import numpy as np

from models import LearnedCreep, learn_creep
from rig.calibration.recorded import Recorded
from rig.system.arrays import F64

RELEASED = 0.3  # of the strongest force, below which a finger is leaving
LEAVING = 0.5  # s that it may take from there


def learn_held_press(recorded: Recorded) -> LearnedCreep:
    """Learn how a plate creeps from the one press of a recording; its force need not be known.

    Raises
    ------
    ValueError
        If more than one finger presses, the press does not end, or the plate has hardly crept.
    """
    peak, place = recorded.strongest
    if max(one.count for one in recorded.estimates[: peak + 1]) > 1:
        raise ValueError(
            "the recording shows more than one touch at once, and creep is learned from one; press"
            " with one finger"
        )
    at_place, sigma = recorded.shown_at(place)
    strongest = float(recorded.estimates[peak].force[0])
    ended = peak + np.flatnonzero(at_place[peak:] < RELEASED * strongest)
    if not len(ended):
        raise ValueError(
            f"the press of {strongest:.3g} N does not end in the recording; record on for as long"
            " as it was held"
        )
    released = float(recorded.times[ended[0]]) + LEAVING
    shown = np.where(recorded.times < released, _pressed(recorded), at_place)
    return learn_creep(recorded.times, shown, released, sigma)


def _pressed(recorded: Recorded) -> F64:
    """Force (N,) of all touches of each frame: that of a plate that is stretched is not linear."""
    return np.array([one.force.sum() for one in recorded.estimates])
