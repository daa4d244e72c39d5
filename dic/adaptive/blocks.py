"""A noisy field on tiles, cut into blocks of which the data keep what stands above the noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from dic.adaptive import polynomials
from dic.adaptive.parts import Parts, filled, parts_of
from dic.arrays import F32, F64, I64, AnyArray, Mask
from dic.compiled import njit

SCALES = (8, 4), (16, 4), (24, 6), (32, 8)  # tiles: side of a block, and distance of blocks
_WIDE = 64, 16  # tiles, of blocks for what hardly bends: where they are whole, and they count less
_TRUST = 0.25
_DERIVATIVES = 3
_TINY = 1e-24  # px², a variance below which numbers end
_ROUNDS = 8  # in which what a block lacks is filled from what it has
_APART = 4.0  # of the square by which blocks lie farther apart than σ, that is their error
_FARTHEST = 3.0  # times σ, for what is shorter than the blocks that win is not in them


@dataclass(frozen=True)
class BlockField:
    """A field on tiles, with its slopes; NaN where no block holds a tile.

    Attributes
    ----------
    values : (2, 3, R, C) float64
        u, ∂u/∂x, ∂u/∂y and v, ∂v/∂x, ∂v/∂y, px and px per tile.
    sigma : (2, 3, R, C) float64
        By the noise and what blocks keep of it, without `slope_factor`.
    slope_factor : (R, C) float64
        How many times as unsure slopes are where these blocks lie farther apart than σ.
    """

    values: F64
    sigma: F64
    slope_factor: F64

    @property
    def valid(self) -> Mask:
        """(R, C) True where there is a value."""
        return np.isfinite(self.values[0, 0])


@dataclass(frozen=True)
class _Layout:
    """Where the blocks of one size lie: first rows and columns, (M, 2), and their side."""

    starts: I64
    side: int
    weight: float

    def cut(self, plane: AnyArray) -> AnyArray:
        """Blocks (M, side, side) of a plane (R, C)."""
        windows = np.lib.stride_tricks.sliding_window_view(plane, (self.side, self.side))
        return windows[self.starts[:, 0], self.starts[:, 1]]


def denoise(field: F64, sigma: F64, valid: Mask, pilot: F64 | None) -> BlockField:
    """Estimate a field on tiles from a noisy one.

    Parameters
    ----------
    field : (2, R, C) float64, px
    sigma : (2, R, C) float64, px
        Of its noise, which is white.
    valid : (R, C) bool
    pilot : (2, R, C) float64, px, optional
        A first estimate, finite everywhere. With it each coefficient is weighed by p²/(p² + σ²), p
        being that of the pilot (Wiener's filter); without, it is kept or dropped.

    Notes
    -----
    Blocks of several sizes lie over one another. What each says of a point counts by the inverse of
    its variance there squared, so large blocks of few coefficients win where the field is smooth.
    Blocks lie less apart than their σ, for they read the same tiles; where they lie farther apart
    the field bends within them, and slopes of their mean err by more.
    """
    totals = np.zeros((2, _DERIVATIVES, 4, *valid.shape))  # Σω value, Σω value², Σω σ², Σω
    sigma = np.where(valid, sigma, 0.0)
    planes = [(field[a], sigma[a], None if pilot is None else pilot[a]) for a in range(2)]
    for side, step in SCALES:
        if min(valid.shape) >= side:
            layout = _lay(valid.shape, side, step)
            masks = layout.cut(valid)
            whole = np.asarray(masks.all(axis=(1, 2)))
            parts = parts_of(masks, ~whole)
            for each, total in zip(planes, totals, strict=True):
                _add_whole(replace(layout, starts=layout.starts[whole]), each, total)
                _add_parts(layout, each, parts, total)
    if min(valid.shape) >= _WIDE[0]:
        wide = _lay(valid.shape, *_WIDE)
        whole = np.asarray(wide.cut(valid).all(axis=(1, 2)))
        wide = replace(wide, starts=wide.starts[whole], weight=_TRUST * wide.weight)
        for each, total in zip(planes, totals, strict=True):
            _add_whole(wide, each, total)
    value, square, power, weight = np.moveaxis(totals, 2, 0)
    there = valid & (weight[0, 0] > 0)
    safe = np.where(weight > 0, weight, 1.0)
    values, variance = value / safe, power / safe
    apart = square / safe - np.square(values)
    factor = _slope_factor(apart[:, 1:], variance[:, 1:])
    values[..., ~there], variance[..., ~there] = np.nan, np.nan
    return BlockField(values, np.sqrt(variance), factor)


def _slope_factor(apart: F64, variance: F64) -> F64:
    """Say how many times their σ slopes of a mean of blocks err, (R, C).

    Both arrays are (2, 2, R, C): the mean square by which blocks lie apart, and the variance. All
    four slopes count together: what bends one bends the others, which noise does not.
    """
    ratio = apart.sum(axis=(0, 1)) / np.maximum(variance.sum(axis=(0, 1)), _TINY)
    return np.minimum(np.sqrt(1.0 + _APART * np.maximum(ratio - 1.0, 0.0)), _FARTHEST)


def _lay(shape: tuple[int, int], side: int, step: int) -> _Layout:
    rows, columns = (np.append(np.arange(0, n - side, step), n - side) for n in shape)
    starts = np.stack(np.meshgrid(rows, columns, indexing="ij"), -1).reshape(-1, 2)
    return _Layout(starts, side, (step / 4) ** 2)


def _add_whole(layout: _Layout, planes: tuple[F64, F64, F64 | None], totals: F64) -> None:
    field, sigma, guide = planes
    power = np.square(layout.cut(sigma.astype(np.float32)))
    noise = np.sqrt(power.reshape(len(power), layout.side**2).mean(axis=1))
    blocks = polynomials.analyse(layout.cut(field))
    pilot = None if guide is None else polynomials.analyse(layout.cut(guide))
    gain = polynomials.gains(blocks, noise, pilot)
    kept = polynomials.degrees(gain)
    blocks, gain = blocks[:, :kept, :kept], gain[:, :kept, :kept]
    variance = polynomials.uncertainty(gain, layout.side) * np.square(noise)[:, None, None]
    _add(layout, layout.starts, blocks * gain, variance, np.ones((1, 1, 1), bool), totals)


def _add_parts(
    layout: _Layout, planes: tuple[F64, F64, F64 | None], parts: Parts, totals: F64
) -> None:
    """Add blocks of which only a part is known: the rest is filled from what that part says."""
    if not len(parts.block):
        return
    field, sigma, guide = planes
    known = parts.masks
    fraction = known.mean(axis=(1, 2)).astype(np.float32)
    power = np.square(layout.cut(sigma)[parts.block]) * known
    noise = np.sqrt(power.mean(axis=(1, 2)) / fraction).astype(np.float32)
    blocks = np.asarray(layout.cut(field)[parts.block], np.float32)
    pilot = None
    if guide is not None:
        pilot = polynomials.analyse(
            filled(np.asarray(layout.cut(guide)[parts.block], np.float32), known)
        )
    coefficients = polynomials.analyse(filled(blocks, known))
    gain = polynomials.gains(coefficients, noise, pilot)
    for _ in range(_ROUNDS - 1):
        estimate = polynomials.synthesise(coefficients * gain, layout.side)
        coefficients = polynomials.analyse(np.where(known, blocks, estimate))
        gain = polynomials.gains(coefficients, noise, pilot)
    variance = polynomials.uncertainty(gain, layout.side)
    variance *= (np.square(noise) / fraction)[:, None, None]
    _add(layout, layout.starts[parts.block], coefficients * gain, variance, known, totals)


def _add(
    layout: _Layout, starts: I64, coefficients: F32, variance: F32, known: Mask, totals: F64
) -> None:
    for derivative in range(_DERIVATIVES):
        value = polynomials.synthesise(coefficients, layout.side, derivative)
        of_value = polynomials.spread(variance, layout.side, derivative)
        _overlay(starts, value, of_value, known, layout.weight, totals[derivative])


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def _overlay(
    starts: I64, value: F32, variance: F32, known: Mask, weight: float, totals: F64
) -> None:
    side, alike = value.shape[1], known.shape[0] == 1
    for m in range(value.shape[0]):
        top, left = starts[m, 0], starts[m, 1]
        for j in range(side):
            for i in range(side):
                if alike or known[m, j, i]:
                    power = max(np.float64(variance[m, j, i]), _TINY)
                    omega = weight / (power * power)
                    totals[0, top + j, left + i] += omega * value[m, j, i]
                    totals[1, top + j, left + i] += omega * value[m, j, i] * value[m, j, i]
                    totals[2, top + j, left + i] += omega * power
                    totals[3, top + j, left + i] += omega
