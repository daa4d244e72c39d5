"""What a pattern that stands still on the sensor makes of tile sums: dirt, unequal pixels.

It is in the reference and in every frame, but does not move along. So least squares move the
reference by less than the plate has moved, towards no motion, and what they leave unexplained grows
with the motion: that is how the pattern shows.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from dic.arrays import F64
from dic.compiled import njit
from dic.images.prefilter import gaussian_taps
from dic.numbers import check_type, read_array
from dic.tiles.tile_kernels import BEFORE, DEGREE, spline_weights
from dic.tiles.tiles import TileReference

_WAVES = 1024  # at which responses are looked at
_STEPS = 128  # of a pixel
_FARTHEST = 8  # px: beyond, a pattern of the sensor does not resemble itself


def fixed_pattern_sums(reference: TileReference, flow: F64) -> tuple[F64, F64]:
    """Compute what white noise of variance 1 that stands still adds to the sums of a frame.

    Parameters
    ----------
    reference : TileReference
    flow : (T, 2) float64, px
        By which it was moved before it was compared.

    Returns
    -------
    gradient : (T, 2) float64
        Added to Σ∇f·e, of each grey level² of its variance.
    unexplained : (T,) float64
        Added to Σe², likewise.

    Raises
    ------
    ValueError
        If the flow is not one finite motion a tile.
    """
    check_type(reference, TileReference, "reference", "dic.prepare_tiles")
    flow = read_array(flow, "flow", "px")
    if flow.shape != (len(reference.hessian), 2) or not np.isfinite(flow).all():
        raise ValueError(
            f"flow must be ({len(reference.hessian)}, 2) finite px, one motion a tile; got shape"
            f" {flow.shape}; give that of the sums"
        )
    gradient, unexplained = _sums(flow, _responses(reference.prefilter.sigma))
    pixels = float(reference.tiles.size**2)
    smooth = reference.smooth
    gradient = gradient if smooth is None else smooth.vectors(gradient)
    return pixels * gradient, pixels * unexplained


@cache
def _responses(sigma: float) -> F64:
    """Say what is left of a pixel that is moved along one axis by 0 to 8 px, (6, N).

    Its value f and that behind a Gaussian of `sigma` px that is passed twice, φ, where the pixel
    stands; the slope of φ there; and over all pixels f², φf and the slope of φ times f.
    """
    waves = np.linspace(-np.pi, np.pi, _WAVES, endpoint=False)
    taps, lags = gaussian_taps(sigma), np.arange(DEGREE + 1) - BEFORE
    kept = np.square(np.cos(np.outer(waves, np.arange(len(taps)) - len(taps) // 2)) @ taps)
    turn = np.exp(1j * np.outer(waves, lags))
    value, slope = np.empty(DEGREE + 1), np.empty(DEGREE + 1)
    spline_weights(0.0, value, slope)
    through = (turn @ value).real
    responses: list[list[float]] = []
    for moved in np.arange(_FARTHEST * _STEPS + 2) / _STEPS:
        whole = np.ceil(moved)
        spline_weights(whole - moved, value, slope)
        back = np.exp(-1j * whole * waves) / through
        f, rise = back * (turn @ value), back * (turn @ slope)
        energy, mixed = np.abs(f) ** 2, (rise * f.conj()).real
        every = f.real, kept * f.real, kept * rise.real, energy, kept * energy, kept * mixed
        responses.append([float(each.mean()) for each in every])
    return np.ascontiguousarray(np.array(responses).T)


@njit(cache=True, nogil=True, error_model="numpy")
def _sums(flow: F64, responses: F64) -> tuple[F64, F64]:
    """Put the responses along both axes together, for a pixel of each tile."""
    gradient, unexplained = np.empty((len(flow), 2)), np.empty(len(flow))
    along = np.empty((2, 6))
    for t in range(len(flow)):
        for axis in range(2):
            at = min(abs(flow[t, axis]), float(_FARTHEST)) * _STEPS
            low = int(at)
            part = at - low
            for k in range(6):
                here, there = responses[k, low], responses[k, low + 1]
                along[axis, k] = here + part * (there - here)
            if flow[t, axis] < 0.0:  # slopes turn with the motion
                along[axis, 2], along[axis, 5] = -along[axis, 2], -along[axis, 5]
        x, y = along
        gradient[t, 0] = x[2] * y[1] - x[5] * y[4]
        gradient[t, 1] = x[1] * y[2] - x[4] * y[5]
        unexplained[t] = 1.0 + x[3] * y[3] - 2.0 * x[0] * y[0]
    return gradient, unexplained
