"""Random fields on tiles, with their slopes, that stand for displacement: drawn, never rendered."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from models.arrays import F64, Mask

_PERIODS = 3.5, 40.0  # tiles
_SCALES = 2.0, 40.0  # tiles, of bumps and Gaussian fields
_WAVES = 24  # in a Gaussian field
_SIZES = 0.5, 60.0  # σ of a tile, of fields
_JUMPS = 2.0, 60.0  # σ of a tile
_ROUGH = 0.35  # of the logarithm of σ, over a field


@dataclass(frozen=True, eq=False)
class DrawnField:
    """A component of displacement on tiles, in any unit.

    Attributes
    ----------
    values : (3, R, C) float64
        u and its slopes along x and y, per tile.
    torn : (R, C) bool
        Tiles that a crack cuts.
    """

    values: F64
    torn: Mask


def draw_field(
    shape: tuple[int, int], plates: Sequence[F64], rng: np.random.Generator
) -> DrawnField:
    """Draw a field in units of the noise of a tile: nothing, or one to three parts, or a crack.

    Parameters
    ----------
    plates : sequence of (3, R', C') float64
        Displacement of plates under touches with its slopes; R' and C' are no smaller than `shape`.
    rng : numpy.random.Generator
    """
    x, y = places(shape)
    values, torn = np.zeros((3, *shape)), np.zeros(shape, bool)
    for _ in range(int(rng.choice(4, p=(0.1, 0.45, 0.3, 0.15)))):
        values += _KINDS[int(rng.integers(len(_KINDS)))](x, y, rng)
    if plates and rng.random() < _PLATES:
        values += _of_plate(plates[int(rng.integers(len(plates)))], shape, rng)
    values += _plane(x, y, rng)
    if rng.random() < _CRACKS:
        torn = _tear(values, x, y, rng)
    return DrawnField(values, torn)


_PLATES, _CRACKS = 0.3, 0.15


def draw_noise(shape: tuple[int, int], rng: np.random.Generator) -> F64:
    """Draw σ of the tiles, (R, C), about 1: contrast changes slowly over a pattern."""
    x, y = places(shape)
    slow = _gaussian(x, y, rng, (15.0, 60.0))[0]
    return np.exp(_ROUGH * rng.random() * slow / max(float(np.std(slow)), 1e-9))


def places(shape: tuple[int, int]) -> tuple[F64, F64]:
    """Column and row of each tile, (R, C)."""
    row, column = np.indices(shape).astype(np.float64)
    return column, row


def _size(rng: np.random.Generator, limits: tuple[float, float] = _SIZES) -> float:
    return log_uniform(limits, rng) * float(rng.choice((-1.0, 1.0)))


def log_uniform(limits: tuple[float, float], rng: np.random.Generator) -> float:
    """Draw a number of which the logarithm lies evenly between those of two limits."""
    low, high = np.log(limits)
    return float(np.exp(rng.uniform(float(low), float(high))))


def draw_wave(
    x: F64, y: F64, rng: np.random.Generator, periods: tuple[float, float] = _PERIODS
) -> F64:
    """Draw a wave with its slopes at places x, y; its period changes slowly."""
    period, angle = log_uniform(periods, rng), rng.uniform(0, 2 * np.pi)
    along = np.cos(angle) * (x - x.mean()) + np.sin(angle) * (y - y.mean())
    across = np.cos(angle) * (y - y.mean()) - np.sin(angle) * (x - x.mean())
    chirp, fan = rng.normal(0, 0.004, 2)
    phase = along / period * (1 + chirp * along / 2 + fan * across)
    by_along = (1 + chirp * along + fan * across) / period
    by_across = fan * along / period
    turn, start, size = 2 * np.pi, rng.uniform(0, 2 * np.pi), _size(rng)
    slope = -size * turn * np.sin(turn * phase + start)
    along_x = np.cos(angle) * by_along - np.sin(angle) * by_across
    along_y = np.sin(angle) * by_along + np.cos(angle) * by_across
    return np.stack([size * np.cos(turn * phase + start), slope * along_x, slope * along_y])


def _gaussian(
    x: F64, y: F64, rng: np.random.Generator, scales: tuple[float, float] = _SCALES
) -> F64:
    """Draw a Gaussian field of one scale, as a sum of waves."""
    scale = log_uniform(scales, rng)
    k: F64 = rng.normal(0, 1 / scale, (2, _WAVES, 1, 1))
    phase = k[0] * x + k[1] * y + rng.uniform(0, 2 * np.pi, (_WAVES, 1, 1))
    size = _size(rng) * np.sqrt(2 / _WAVES)
    slope = -size * np.sin(phase)
    return np.stack([size * np.cos(phase), slope * k[0], slope * k[1]]).sum(axis=1)


def _bumps(x: F64, y: F64, rng: np.random.Generator) -> F64:
    total = np.zeros((3, *x.shape))
    for _ in range(int(rng.integers(1, 6))):
        scale, size = log_uniform(_SCALES, rng), _size(rng)
        dx, dy = x - rng.uniform(0, _end(x)), y - rng.uniform(0, _end(y))
        bump = size * np.exp(-(dx**2 + dy**2) / (2 * scale**2))
        if rng.random() < 0.5:
            total += np.stack([bump, -bump * dx / scale**2, -bump * dy / scale**2])
        else:  # its derivative, as around a touch
            total += bump / scale * np.stack(
                [dx, 1 - dx**2 / scale**2, -dx * dy / scale**2]
            )  # fmt: skip
    return total


def _curved(x: F64, y: F64, rng: np.random.Generator) -> F64:
    """Draw a polynomial of degree three."""
    half = max(x.shape) / 2
    s, t = (x - x.mean()) / half, (y - y.mean()) / half
    c, size = rng.normal(0, 1, 7), _size(rng)
    value = c[0] * s * s + c[1] * s * t + c[2] * t * t
    value += c[3] * s**3 + c[4] * s * s * t + c[5] * s * t * t + c[6] * t**3
    by_s = 2 * c[0] * s + c[1] * t + 3 * c[3] * s * s + 2 * c[4] * s * t + c[5] * t * t
    by_t = c[1] * s + 2 * c[2] * t + c[4] * s * s + 2 * c[5] * s * t + 3 * c[6] * t * t
    return size * np.stack([value, by_s / half, by_t / half])


def _plane(x: F64, y: F64, rng: np.random.Generator) -> F64:
    """Draw a shift and a slope, of any size or none."""
    a, b = rng.normal(0, 0.5, 2) * (rng.random() < 0.5)
    shift = rng.normal(0, 30.0)
    return np.stack([shift + a * x + b * y, np.full_like(x, a), np.full_like(x, b)])


def _of_plate(plate: F64, shape: tuple[int, int], rng: np.random.Generator) -> F64:
    """Cut a part of a plate, and scale it."""
    rows, columns = int(plate.shape[1]) - shape[0], int(plate.shape[2]) - shape[1]
    row = int(rng.integers(0, rows + 1))
    column = int(rng.integers(0, columns + 1))
    return _size(rng) * plate[:, row : row + shape[0], column : column + shape[1]]


def _tear(values: F64, x: F64, y: F64, rng: np.random.Generator) -> Mask:
    """Add a jump and another slope on one side of a line; return the tiles that it cuts."""
    angle = rng.uniform(0, 2 * np.pi)
    away = np.cos(angle) * (x - rng.uniform(*_inside(x))) + np.sin(angle) * (
        y - rng.uniform(*_inside(y))
    )
    beyond = away > 0
    jump, slope = _size(rng, _JUMPS), rng.normal(0, 0.05, 2)
    values[0] += beyond * (jump + slope[0] * x + slope[1] * y)
    values[1] += beyond * slope[0]
    values[2] += beyond * slope[1]
    width = max(abs(float(np.cos(angle))), abs(float(np.sin(angle))))
    return np.abs(away) <= 0.5 * width + 1e-9


def _inside(axis: F64) -> tuple[float, float]:
    return 0.2 * _end(axis), 0.8 * _end(axis)


def _end(axis: F64) -> float:
    return float(np.max(axis))


_KINDS: tuple[Callable[[F64, F64, np.random.Generator], F64], ...] = (
    draw_wave,
    draw_wave,
    _gaussian,
    _bumps,
    _curved,
)
