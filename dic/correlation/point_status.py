"""The status of each point, and the uncertainty of what was measured."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from dic.arrays import F64, I8, AnyArray, Mask
from dic.compiled import njit
from dic.correlation import breaks, clipping, residuals
from dic.correlation.deformed_image import DeformedImage
from dic.correlation.newton import Points
from dic.correlation.reference import Reference
from dic.fields.displacement import DisplacementField, Status
from dic.fields.roughness import excess, flattening
from dic.images.prefilter import gaussian_power
from dic.images.spline import noise_power, noise_slope
from dic.numbers import check_type, median, read_real

Clipped: TypeAlias = list[tuple[F64, Status]]  # fraction of each subset, DARK or SATURATED

FOUND = 0.8  # ZNCC below which it is not the same pattern
STOPPED = 1e-3  # px, more than this in the last iteration is NOT_CONVERGED
DISTURBED = 4.0  # times the noise of the field: photographs without a hand reach 3.2
WHOLE = 0.99  # ZNCC from which no subset is disturbed, however little noise the others have
CLEAR = 0.995  # ZNCC from which no subset is searched for pixels that clip
CLIPPED = 0.1  # fraction of a subset that may clip in the frame and not in the reference
ONE_SIDED = 0.04  # fraction that doubles σ
BEYOND = 0.25  # px beyond the last pixels to which the spline is believed: 2 mpx of error
# The residual is a difference of sums in single precision: below this part of the contrast it is
# their rounding, of either sign, and no σ of 0 follows from it.
_ROUNDING = 2 * float(np.finfo(np.float32).eps)
_MAX_NOISE = 0.5  # fraction of Σ∇f∇fᵀ that may be noise in a small subset
FAR = 5.0  # σ, the distance that shall be as rare as it is for a normal error


def is_correlated(ref: Reference, points: Points) -> Mask:
    """Find where the pattern was found again, wholly on the image, (N,) bool."""
    known = (ref.status == Status.OK) & (points.zncc >= FOUND)
    return known & ~leaves_image(ref, points.motion)


def displacement_field(ref: Reference, points: Points, frame: DeformedImage) -> DisplacementField:
    """Turn the last state of the points in a frame into a measurement, NaN where there is none."""
    return field_and_breaks(ref, points, frame)[0]


def noise_of(ref: Reference, points: Points) -> F64:
    """Noise of one image that each subset leaves over, (N,), grey levels."""
    residual = np.maximum(points.residual * freedom(ref), rounding(ref))
    return np.sqrt(residual / _noise_gain(ref, points.motion))


def median_noise(ref: Reference, points: Points) -> float:
    """Median noise of the subsets that were found, grey levels; NaN where none was."""
    measured = is_correlated(ref, points)
    return median(noise_of(ref, points)[measured]) if measured.any() else float("nan")


def images(ref: Reference) -> float:
    """Noise of a frame and of the reference together, over that of a frame: 2 for one still."""
    return 1.0 + 1.0 / ref.stills


def field_and_breaks(
    ref: Reference, points: Points, frame: DeformedImage
) -> tuple[DisplacementField, breaks.Lines]:
    """Turn the last state of the points into a measurement, and find where the material broke."""
    noise = noise_of(ref, points)
    clipped = _clipped(ref, points, frame.image)
    status = _status(ref, points, noise, clipped)
    broken = breaks.lines(ref, points, frame, noise, status)
    status[breaks.across(ref, broken, noise, status)] = Status.BROKEN
    lost = status != Status.OK
    correlated = ref.noise_gain * residuals.excess(ref, points, frame, ~lost)
    fraction = _noise_fraction(ref, noise)
    scale = noise / np.sqrt(1 - fraction) * _widening(ref, fraction)
    for part, _ in clipped:
        # What clips is off by more than noise, and all to one side.
        scale *= 1 + part / ONE_SIDED
    spread = scale[:, None, None] * np.sqrt(variance(ref) * correlated[:, :, None] * images(ref))
    spread *= ref.scatter[:, None]
    motion = points.motion.copy()
    # The bias of interpolation is a sine over the fraction of a px.
    bias = np.sqrt(2) * ref.prefilter.bias * np.sin(2 * np.pi * motion[:, :, 0])
    spread[:, :, 0] = np.hypot(spread[:, :, 0], bias)
    motion[lost], spread[lost] = np.nan, np.nan
    if ref.grid is not None:
        spread *= excess(motion[:, :, 0].T, spread[:, :, 0].T, ref.grid, ref.order)
        spread[:, :, 0] = np.hypot(
            spread[:, :, 0], flattening(motion[:, :, 0].T, ref.grid, ref.order).T
        )
    untried = ref.status != Status.OK
    field = DisplacementField(
        xy=ref.xy,
        u=motion[:, 0, 0],
        v=motion[:, 1, 0],
        sigma_u=spread[:, 0, 0],
        sigma_v=spread[:, 1, 0],
        gradient=motion[:, :, 1:3],
        sigma_gradient=spread[:, :, 1:3],
        zncc=np.where(untried, np.nan, points.zncc),
        iterations=np.where(untried, 0, points.iterations).astype(np.int16),
        valid_fraction=ref.light[:, 2] / ref.subset**2,
        status=status,
        subset=ref.subset,
        order=ref.order,
        grid=ref.grid,
        prefilter=ref.prefilter.sigma,
    )
    return field, broken


def expected_sigma(ref: Reference, noise: float | None = None) -> F64:
    """σ of u and v to expect of a frame that fits, before there is one.

    It is what `correlate` states where noise and interpolation alone are left over: no motion
    bends a subset beyond its shape function, and the light stays.

    Parameters
    ----------
    ref : Reference
    noise : float, grey levels, optional
        Standard deviation of the noise of reference and frame; without it that which the spectrum
        of the reference shows.

    Returns
    -------
    (N, 2) float64, px
        NaN where a point will not be measured.

    Raises
    ------
    ValueError
        The noise is not known, because the prefilter was named, or is negative.
    """
    check_type(ref, Reference, "ref", "dic.prepare")
    given = ref.prefilter.noise if noise is None else read_real(noise, "noise", "grey levels")
    if not given >= 0:
        raise ValueError(
            f"noise must be 0 grey levels or more, got {given:g}; give that of the camera, or"
            " prepare the reference without a prefilter"
        )
    level = np.full(len(ref.xy), given * np.sqrt(gaussian_power(ref.prefilter.sigma)))
    fraction = _noise_fraction(ref, level)
    scale = level / np.sqrt(1 - fraction) * _widening(ref, fraction)
    spread = scale[:, None] * np.sqrt(images(ref) * variance(ref)[:, :, 0] * ref.noise_gain)
    spread *= ref.scatter
    spread = np.hypot(spread, ref.prefilter.bias)  # rms of its sine over the fraction of a px
    measured = (ref.status == Status.OK) & ~_is_flat(ref, float(level.max(initial=0.0)))
    return np.where(measured[:, None], spread, np.nan)


def variance(ref: Reference) -> F64:
    """Diagonal of the inverse of each subset for its motion, (N, 2, P)."""
    every = np.diagonal(ref.inverse, axis1=1, axis2=2)[:, :-2].reshape(len(ref.inverse), 2, -1)
    # Rounding turns the inverse of next to nothing negative: such a point knows nothing.
    return np.where(every > 0, every, np.inf)


def rounding(ref: Reference) -> F64:
    """Variance that single precision leaves over, (N,), grey levels²."""
    squares, total, pixels = ref.light.T
    pixels = np.maximum(pixels, 1)
    return _ROUNDING * np.maximum(squares / pixels - np.square(total / pixels), 0)


def freedom(ref: Reference) -> F64:
    """Correct the residual for what a fit takes of correlated noise, (N,): more than of white."""
    taken = ref.inverse.shape[1]
    pixels = np.maximum(ref.light[:, 2], 1)
    left = np.maximum(pixels - taken * ref.noise_gain.mean(axis=1), pixels / 2)
    return np.maximum(pixels - taken, 1) / left


def _noise_gain(ref: Reference, motion: AnyArray) -> F64:
    """Variance of the residual over that of the noise of a frame: 1 + κ, or 1 + κ/M, (N,).

    κ depends on the fraction of a px by which the subset moved, averaged over what its gradients
    sweep.
    """
    kept = np.empty(len(motion))
    _keep_noise(motion, ref.half, *noise_power(ref.prefilter.sigma), kept)
    return 1 + kept / ref.stills


@njit(cache=True, nogil=True)
def _keep_noise(motion: F64, half: int, mean: float, harmonic: float, out: F64) -> None:
    for n in range(motion.shape[0]):
        out[n] = 1.0
        for shift, along_x, along_y in motion[n, :, :3]:
            swept = _sinc(2 * half * along_x) * _sinc(2 * half * along_y)
            out[n] *= mean + harmonic * math.cos(2 * math.pi * shift) * swept


@njit(cache=True, nogil=True)
def _sinc(x: float) -> float:
    return math.sin(math.pi * x) / (math.pi * x) if x != 0 else 1.0


def _noise_fraction(ref: Reference, noise: AnyArray) -> F64:
    """Fraction of Σ∇f∇fᵀ that is noise of the reference, (N,): it follows no motion."""
    power = noise_slope(ref.prefilter.sigma) * np.square(noise) / ref.stills
    return np.minimum(power / np.maximum(np.square(ref.slope), 1e-30), max_noise(ref))


def max_noise(ref: Reference) -> F64:
    """Fraction of Σ∇f∇fᵀ that may be noise, (N,): the larger a subset, the better it is known.

    What is left over of n pixels when it is taken off is known to 2/√n.
    """
    pixels = np.maximum(ref.light[:, 2], 1)
    return np.maximum(_MAX_NOISE, 1 - FAR * 2 / np.sqrt(pixels))


def _widening(ref: Reference, fraction: AnyArray) -> F64:
    """Widen σ, which is estimated itself, so that an error of 5 σ is as rare as it should be, (N,).

    Where a fraction p of the Hessian of n pixels is noise, it is known to 4 p/(1 - p)/(2n) of its
    square (sampled: σ scatters by 6 % at a fraction of 0.33, 7 % at 0.44). Student's t with that
    many degrees of freedom ν has longer tails: x + (x³ + x)/(4ν) in place of x (Abramowitz, Stegun
    26.7.5).
    """
    fewer = 4 * fraction / (1 - fraction) / np.maximum(ref.light[:, 2], 1)  # 1/ν
    return 1 + (FAR**2 + 1) / 4 * fewer


def _clipped(ref: Reference, points: Points, image: AnyArray) -> Clipped:
    """Fraction of each subset that clips in the frame and did not before, at black and at white."""
    moved = ref.xy + points.motion[:, :, 0]
    measured = (ref.status == Status.OK) & (points.zncc >= FOUND)
    moved[~(measured & (points.zncc < CLEAR))] = np.nan  # pixels that clip would show
    return clipping.gained(ref.image, image, ref.xy, moved, ref.half)


def _status(ref: Reference, points: Points, noise: F64, clipped: Clipped) -> I8:
    """Name what became of each point; what is named first stands."""
    measured = (ref.status == Status.OK) & (points.zncc >= FOUND)
    level = median(noise[measured]) if measured.any() else 0.0
    status = ref.status.copy()
    for condition, name in (
        (points.repeats, Status.AMBIGUOUS),
        (_is_flat(ref, level), Status.FLAT),
        (leaves_image(ref, points.motion), Status.OUTSIDE),
        (~(points.zncc >= FOUND), Status.LOW_CORRELATION),
        (~(points.still | (points.change <= STOPPED)), Status.NOT_CONVERGED),
        *((part > CLIPPED, name) for part, name in clipped),
        ((noise > DISTURBED * level) & (points.zncc < WHOLE), Status.DISTURBED),
    ):
        status[(status == Status.OK) & condition] = name
    return status


def is_flat(ref: Reference, points: Points) -> Mask:
    """Find where too much of the slope is noise, as far as is known yet, (N,) bool."""
    noise = np.sqrt(np.maximum(points.residual, 0) / _noise_gain(ref, points.motion))
    measured = (ref.status == Status.OK) & (points.zncc >= FOUND)
    return _is_flat(ref, median(noise[measured]) if measured.any() else 0.0)


def _is_flat(ref: Reference, level: float) -> Mask:
    level /= math.sqrt(ref.stills)
    return ref.slope < np.sqrt(noise_slope(ref.prefilter.sigma) / max_noise(ref)) * level


def leaves_image(ref: Reference, motion: AnyArray) -> Mask:
    """Find where a corner of the moved subset lies beyond the last pixels, (N,) bool."""
    out = np.empty(len(motion), dtype=bool)
    _leave(ref.xy, motion, ref.half, ref.image.shape, out)
    return out


@njit(cache=True, nogil=True)
def _leave(xy: F64, motion: F64, half: int, shape: tuple[int, ...], out: Mask) -> None:
    """Move the four ends of each subset, which begins at the border where the image cuts it."""
    for n in range(xy.shape[0]):
        out[n] = False
        for a in range(2):
            first = last = round(xy[n, a]) + motion[n, a, 0]
            for b in range(2):
                slope, centre = motion[n, a, 1 + b] + (a == b), round(xy[n, b])
                low = slope * max(-half, -centre)
                high = slope * min(half, shape[1 - b] - 1 - centre)
                first, last = first + min(low, high), last + max(low, high)
            inside = first >= -BEYOND and last <= shape[1 - a] - 1 + BEYOND
            out[n] = out[n] or not inside
