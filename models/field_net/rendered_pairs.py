"""Rendered pairs of images with their true displacement, drawn as they are needed."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import map_coordinates

from models.arrays import F32, F64, AnyArray, Mask
from models.field_net.drawn_fields import draw_field, draw_wave, log_uniform, places
from synthetic import BatchWarper

CELL = 2  # px along a side of the cells at whose middles the truth is given
_UNITS = 0.003, 0.025  # px, of which a drawn field has 0.5 to 60
_SHORT = 2.3, 12.0  # control pixels, periods of the waves beside those of `draw_field`
_WAVED = 0.5  # fraction of the components that have one
_STEEPEST = 0.33  # px per px
_CONTRASTS = 12.0, 65.0  # grey levels, of images
_NOISES = 0.005, 0.12  # of the contrast, and no less than rounding leaves
_BLUR = 0.8  # px
_HOLES = 0.12  # fraction of the pairs with one
_RIM = 20  # px at the border of a pattern, where the spots end


@dataclass(frozen=True, eq=False)
class RenderedPair:
    """A pair of images.

    Attributes
    ----------
    first, second : (H, W) uint8
    truth : (2, R, C) float32, px
        Displacement at the middles of the cells.
    roi : (H, W) bool
    """

    first: AnyArray
    second: AnyArray
    truth: F32
    roi: Mask

    def truth_at(self, xy: F64) -> F64:
        """Displacement (2, N) px of points (N, 2) px, by cubic splines between the cells."""
        place = (xy[:, ::-1].T - (CELL - 1) / 2) / CELL
        parts = self.truth.astype(np.float64)
        return np.stack(
            [
                np.asarray(map_coordinates(part, place, order=3, mode="nearest"), dtype=np.float64)
                for part in parts
            ]
        )


def draw_pairs(
    pool: Sequence[BatchWarper],
    plates: Sequence[F64],
    count: int,
    side: int,
    rng: np.random.Generator,
) -> list[RenderedPair]:
    """Draw pairs of side x side px: parts of one pattern, each turned and lit in its own way.

    Parameters
    ----------
    pool : sequence of BatchWarper
        Patterns, of which one is taken.
    plates : sequence of (3, R', C') float64
        Displacement of plates under touches, as of `draw_plates`.
    count, side : int
    rng : numpy.random.Generator
    """
    whole = pool[int(rng.integers(len(pool)))]
    corner = tuple(int(rng.integers(_RIM, whole.size[k] - side - _RIM + 1)) for k in range(2))
    part = whole.part((corner[0], corner[1]), (side, side))
    shape = part.controls.shape[:2]
    fields = np.stack([_displacement(shape, plates, rng) for _ in range(count)])
    rest = part.render(np.zeros((1, *shape, 2)))[0, 0].cpu().numpy()
    moved = part.render(fields)[:, 0].cpu().numpy()
    truth = part.displacement(fields, _middles(side)).cpu().numpy()
    return [_seen(rest, moved[k], truth[k], rng) for k in range(count)]


def _middles(side: int) -> F64:
    at = CELL * np.arange(side // CELL) + (CELL - 1) / 2
    return np.stack(np.meshgrid(at, at), axis=-1).astype(np.float64)


def _displacement(shape: tuple[int, int], plates: Sequence[F64], rng: np.random.Generator) -> F64:
    """Draw u and v at the control pixels, (rows, columns, 2) px, nowhere too steep to see."""
    unit = log_uniform(_UNITS, rng)
    field = np.stack([_component(shape, plates, unit, rng) for _ in range(2)], axis=-1)
    steep = max(float(np.abs(np.diff(field, axis=axis)).max()) for axis in (0, 1)) / 4
    field *= min(1.0, _STEEPEST / max(steep, 1e-9))
    return np.asarray(field + rng.uniform(-1, 1, 2), np.float64)


def _component(
    shape: tuple[int, int], plates: Sequence[F64], unit: float, rng: np.random.Generator
) -> F64:
    drawn = draw_field(shape, plates, rng).values[0]
    drawn -= drawn.mean()
    if rng.random() < _WAVED:
        drawn *= rng.choice((0.0, 1.0))
        drawn += draw_wave(*places(shape), rng, _SHORT)[0]
    return unit * drawn


def _seen(rest: F32, moved: F32, truth: F32, rng: np.random.Generator) -> RenderedPair:
    """Turn a pair, and take both images as a camera of 8 bit would."""
    u, v = truth
    if rng.random() < 0.5:
        rest, moved, u, v = rest.T, moved.T, v.T, u.T
    if rng.random() < 0.5:
        rest, moved, u, v = rest[:, ::-1], moved[:, ::-1], -u[:, ::-1], v[:, ::-1]
    if rng.random() < 0.5:
        rest, moved, u, v = rest[::-1], moved[::-1], u[::-1], -v[::-1]
    contrast = log_uniform(_CONTRASTS, rng)
    noise = max(contrast * log_uniform(_NOISES, rng), 0.3)
    scale = contrast / max(float(rest.std()), 1.0) * rng.choice((-1.0, 1.0), p=(0.3, 0.7))
    blur, level = rng.uniform(0, _BLUR), rng.uniform(100, 155)
    first, second = (_blurred(image, blur) for image in (rest, moved))
    middle = float(first.mean())
    first, second = (level + scale * (image - middle) for image in (first, second))
    if rng.random() < 0.5:
        second = second * _light(second.shape, rng) + rng.uniform(-6, 6)
    before, after = (_eight_bit(image, noise, rng) for image in (first, second))
    truth = np.ascontiguousarray(np.stack([u, v]), np.float32)
    return RenderedPair(before, after, truth, _roi(first.shape, rng))


def _eight_bit(image: AnyArray, noise: float, rng: np.random.Generator) -> AnyArray:
    noisy = image + rng.normal(0, noise, image.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def _roi(shape: tuple[int, ...], rng: np.random.Generator) -> Mask:
    """Draw an ROI: all, or what lies around a hole."""
    if rng.random() > _HOLES:
        return np.ones(shape, bool)
    y, x = np.indices(shape)
    away = np.hypot(x - rng.uniform(0, shape[1]), y - rng.uniform(0, shape[0]))
    return away > rng.uniform(8.0, 0.25 * min(shape))


def _blurred(image: F32, sigma: float) -> F32:
    if sigma < 0.25:
        return image
    return np.asarray(cv2.GaussianBlur(np.ascontiguousarray(image), (0, 0), sigma), np.float32)


def _light(shape: tuple[int, ...], rng: np.random.Generator) -> F64:
    """Draw a gain that changes slowly over the image."""
    y, x = (np.linspace(-1, 1, n) for n in shape)
    slope = rng.normal(0, 0.03, 2)
    return rng.uniform(0.9, 1.1) * (1 + slope[0] * x + slope[1] * y[:, None])
