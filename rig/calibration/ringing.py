"""How a plate rings, learned from one tap in a recording.

A finger pushes and never pulls: when the plate swings beyond its rest after the tap nothing touches
it any more, and all that it shows from then on is its own.
"""

from __future__ import annotations

import numpy as np

from models import LearnedDamping, Seeing, learn_damping, plate_dynamics
from rig.calibration.recorded import Recorded
from rig.calibration.ringing_plate import Ringing
from rig.live.plate_in_time import exposure_of
from rig.scene import Scene
from rig.system.arrays import I64

SURE = 5.0  # standard deviations by which the plate must swing beyond its rest
LASTING = 1.0  # s of ringing that are looked at


def learn_ringing(recorded: Recorded, scene: Scene) -> Ringing:
    """Learn how the plate of a scene rings from the strongest tap of a recording.

    Parameters
    ----------
    recorded : Recorded
    scene : Scene
        Names the density that is supposed.

    Raises
    ------
    ValueError
        If the scene names no density, the bench has no modes that ring by themselves, or the
        recording shows no tap that rings.
    """
    dynamics = scene.dynamics
    if dynamics is None or dynamics.density is None:
        raise ValueError(
            f"scene '{scene.title}' names no density to begin from; write dynamics.density, for PVC"
            ' "1.4 g/cm³"'
        )
    modes, chain = recorded.bench.motions.plate_modes, recorded.chain
    first = _free_from(recorded)
    ends = int(recorded.times.searchsorted(float(recorded.times[first]) + LASTING))
    rings = slice(first, ends)
    learned: LearnedDamping = learn_damping(
        plate_dynamics(modes, dynamics.density, dynamics.damping),
        Seeing(modes, chain.pattern.factor / chain.noise),
        recorded.measured[rings],
        recorded.times[rings],
        exposure_of(scene),
    )
    density = dynamics.density / learned.frequency**2
    return Ringing(density, learned.damping, learned.sigma[1])


def _free_from(recorded: Recorded) -> int:
    """Return the first frame after the strongest tap in which surely nothing touches.

    Raises
    ------
    ValueError
        If the plate never swings beyond its rest.
    """
    peak, place = recorded.strongest
    shown, sigma = recorded.shown_at(place)
    beyond: I64 = peak + 1 + np.flatnonzero(shown[peak + 1 :] < -SURE * sigma)
    # The next one is the first that was exposed after the release from beginning to end.
    if not len(beyond) or beyond[0] + 1 == len(shown):
        raise ValueError(
            f"the plate never swings beyond its rest by {SURE:g} standard deviations after the"
            " strongest touch; tap it with a knuckle, and let it ring for half a second"
        )
    return int(beyond[0]) + 1
