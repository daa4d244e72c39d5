"""Random speckle on a torch device, and parts of it under random displacements."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import numpy as np

from models.field_net.drawn_fields import log_uniform
from synthetic import BatchWarper, Speckle, prepare_batch, prepare_warp, telecentric_above

SPACING = 4  # px between control pixels: the shortest wave has 2.5 of them
_OVERSAMPLE = 2
_DIAMETERS = 2.8, 9.0  # px of the spots
_EDGE = 1.2  # px, the sharpest that the sharp image holds


def draw_speckle(count: int, side: int, rng: np.random.Generator, device: str) -> list[BatchWarper]:
    """Draw plates of side x side px with spots of random size, edge and density.

    Parameters
    ----------
    count : int
    side : int, px
    rng : numpy.random.Generator
    device : str
        Of torch.
    """
    return [_draw(side, rng, device) for _ in range(count)]


def _draw(side: int, rng: np.random.Generator, device: str) -> BatchWarper:
    size = (float(side), float(side))  # mm, of which one is a pixel
    diameter = log_uniform(_DIAMETERS, rng)
    speckle = Speckle(
        size,
        diameter=diameter,
        density=rng.uniform(0.25, 0.65),
        softness=min(max(rng.uniform(0.2, 0.8), _EDGE / diameter), 0.8),
        seed=int(rng.integers(2**31)),
    )
    camera = telecentric_above(size, (side, side), margin=0.0)
    return prepare_batch(
        prepare_warp(speckle.draw(), camera, oversample=_OVERSAMPLE), device, SPACING
    )
