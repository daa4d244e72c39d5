"""What projected light does to the touches that are found: a meter that needs no further frames.

Light L on the reference f changes it by f (L - 1), which correlation takes for motion. The sums of
that change, whitened as a frame is, are what the light adds to every frame in which it is on; its
least-squares fit to a touch is how far the light moves that touch.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import models
from dic import tile_sums
from rig.live.chain import Chain
from rig.live.illumination import sums_without_gain_offset
from rig.live.snapshot import Mark
from rig.system.arrays import F32, Real

SPOILT = 0.45  # of σ: a bias of so much makes an error 10 % larger, √(1 + 0.45²)


@dataclass(frozen=True)
class Interference:
    """Bias of the touches by light.

    Attributes
    ----------
    shift : float, mm
        Largest shift of a touch.
    force : float, N
        Largest change of a force.
    sigmas : float
        Largest shift of a touch over the standard deviation of its place.
    """

    shift: float
    force: float
    sigmas: float

    @property
    def spoils(self) -> bool:
        """Whether the light makes errors of place more than 10 % larger."""
        return self.sigmas > SPOILT

    @property
    def sentence(self) -> str:
        """What the light does, for the user; empty where it does no harm."""
        if not self.spoils:
            return ""
        return (
            f"projected light moves a touch by {self.shift:.2g} mm, {self.sigmas:.1f} of its"
            ' uncertainty; make the marks dimmer, or set projector.mode to "outside"'
        )


def leftover(image: Real, reference: Real, light: Real, black: float) -> float:
    """Strength of a light of known shape in a frame: its brightest over the light of the room.

    Parameters
    ----------
    image, reference : (H, W), grey levels
        The reference without that light. Motion of the pattern does not look like light on it.
    light : (H, W)
        Shape of the light, 0 where none falls.
    black : float, grey levels
        What a pixel reads without any light.
    """
    there = light > 0
    lit = (reference[there] - black) * light[there]
    more = image[there].astype(np.float64) - reference[there]
    energy = float(np.vdot(lit, lit))
    return max(float(np.vdot(lit, more)) / energy, 0.0) if energy > 0 else 0.0


def interference(chain: Chain, light: F32, black: float, marks: tuple[Mark, ...]) -> Interference:
    """Predict what light does to touches, to first order.

    Parameters
    ----------
    chain : Chain
    light : (H, W) float32
        On each pixel of the camera, over that of the room, from `LightMap.on_camera`; where an
        image is divided by it, what is left of it.
    black : float, grey levels
        What a pixel reads without any light.
    marks : tuple of Mark
        The touches that press now.
    """
    if not marks:
        return Interference(0.0, 0.0, 0.0)
    image, pattern = chain.reference.image, chain.pattern
    sums = tile_sums(chain.reference, image + (image - black) * (light - 1.0))
    contrast = models.fit_tiles(chain.reference, sums).contrast
    moving = sums_without_gain_offset(chain.tiles, sums, chain.weight, contrast)
    right = pattern.gradient(moving, pattern.still())
    seen = pattern.whiten(right, chain.noise)
    touches = np.array([(mark.x, mark.y, mark.force) for mark in marks])
    _, tangent = pattern.forward(chain.noise).read(touches)
    moved = np.linalg.lstsq(tangent.T, seen, rcond=None)[0].reshape(-1, 3)
    covariance = np.linalg.inv(tangent @ tangent.T)
    variance = np.diag(covariance).reshape(-1, 3)[:, :2].sum(axis=1)
    shift = np.hypot(moved[:, 0], moved[:, 1])
    return Interference(
        shift=float(shift.max()),
        force=float(np.abs(moved[:, 2]).max()),
        sigmas=float((shift / np.sqrt(variance)).max()),
    )
