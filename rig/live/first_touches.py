"""A bench of which nothing is known but its scene, found from the first touches together.

One touch after the other would not do: each is taken in by derivatives at the bench that is known
then, and where that is far from the real one they lead astray and say that they are sure. Of all
first touches together a bench is found as from presses, at places and forces that nobody states.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import fe
import models
import synthetic
from rig.live.known_bench import KnownBench
from rig.live.next_bench import NextBench

ENOUGH = 24, 48
"""Touches from which a bench is found, and from which it is found once more.

Of fewer, one whose camera stands a millimetre elsewhere may look as likely.
"""
_PLATE = len(fe.BENCH_PARAMETERS)


@dataclass(frozen=True, eq=False)
class FirstTouches:
    """Touches on a bench of which nothing is known but its scene.

    Attributes
    ----------
    prior : models.BenchEstimate
    camera : synthetic.AnyCamera
        As it is described.
    presses : tuple of models.Press
    """

    prior: models.BenchEstimate
    camera: synthetic.AnyCamera
    presses: tuple[models.Press, ...] = ()

    @property
    def due(self) -> bool:
        """Whether the bench is to be found now."""
        return len(self.presses) in ENOUGH

    @property
    def complete(self) -> bool:
        """Whether it is known well enough to be followed from touch to touch."""
        return len(self.presses) >= ENOUGH[-1]

    def with_press(self, press: models.Press) -> FirstTouches:
        """Return these touches and one more."""
        return replace(self, presses=(*self.presses, press))

    def find(self, pattern: models.TilePattern, noise: float) -> NextBench | None:
        """Find the bench that all of them show; None where the descent does not end."""
        forward, look = pattern.forward(noise), KnownBench(self.prior, self.camera).look(pattern)
        if not isinstance(forward, models.BenchForward):
            return None
        try:
            bench = models.identify(forward.apart(), self.presses, self.prior, look)
        except np.linalg.LinAlgError:
            return None
        if not (bench.converged and bench.is_sound):
            return None
        return NextBench(bench, look.at(bench.values[_PLATE:], bench["thickness"][0]))
