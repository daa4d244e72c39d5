"""Benches that a touch net is trained on: drawn about one that is described."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import fe
import synthetic
from dic import lay_tiles
from models.design.expected_errors import equal_tiles
from models.forward.image_motion import prepare_motions
from models.forward.linear import LinearForward
from models.forward.tile_pattern import prepare_pattern

MODES, ELEMENTS = 200, 48
_GIVE = 0.02  # compliance of a clamp against turning, in parts of side / rigidity: twice the usual
_THICKER, _STIFFER = 0.15, 0.2  # parts by which thickness and modulus differ
_NOISIER = 2.0  # factor either way of the noise
_NEARER = 0.2  # parts by which the camera stands nearer or farther


@dataclass(frozen=True)
class DescribedBench:
    """The bench about which others are drawn.

    Attributes
    ----------
    plate : fe.Plate
    stand_off : float, mm
        Distance of a pinhole above the plate.
    pixels : (int, int)
    tile : int, px
    noise : float
        Of a frame less its reference, over the RMS of the pattern's gradient along x, px.
    """

    plate: fe.Plate
    stand_off: float
    pixels: tuple[int, int]
    tile: int
    noise: float


def draw_bench(described: DescribedBench, rng: np.random.Generator) -> LinearForward:
    """Draw a bench: stiffness, clamps that give, distance of the camera, noise and contrast."""
    plate = described.plate
    thick, young, far = 1.0 + rng.uniform(-1, 1, 3) * (_THICKER, _STIFFER, _NEARER)
    plate = replace(plate, thickness=thick * plate.thickness, young=young * plate.young)
    plate = replace(plate, edges=_clamps(plate, rng))
    noise = described.noise * _NOISIER ** rng.uniform(-1, 1)
    return bench_forward(replace(described, plate=plate, noise=noise), far)


def bench_forward(described: DescribedBench, farther: float = 1.0) -> LinearForward:
    """Forward model of the amplitudes that a bench shows, its camera so many times as far away."""
    plate = described.plate
    camera = synthetic.pinhole_above(plate.size, farther * described.stand_off, described.pixels)
    modes = fe.modes(plate, MODES, mesh=fe.grid(plate, ELEMENTS))
    tiles = lay_tiles((described.pixels[1], described.pixels[0]), described.tile)
    motions = prepare_motions(modes, camera, camera.face_height(plate.thickness), tiles)
    forward = prepare_pattern(motions, equal_tiles(tiles, 1.0)).forward(described.noise)
    if not isinstance(forward, LinearForward):
        raise TypeError("a pattern of modes has a linear forward model")
    return forward


def _clamps(plate: fe.Plate, rng: np.random.Generator) -> fe.Edges | fe.Edge:
    """Clamps each of which gives a little where it turns; one bench in three has rigid ones."""
    if rng.random() < 1 / 3:
        return plate.edges
    turning = plate.rigidity / (_GIVE * np.sqrt(plate.area))
    held = plate.rigidity / np.sqrt(plate.area) ** 3 * 1e6
    return fe.Edges(*(fe.Elastic(held, turning / rng.uniform(0.05, 1.0)) for _ in range(4)))
