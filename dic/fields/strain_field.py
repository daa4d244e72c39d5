"""Strain of a displacement field, with its kind, gauge length and uncertainty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from dic.arrays import F64, I64, AnyArray, Mask
from dic.compiled import njit
from dic.fields import roughness
from dic.fields.displacement import DisplacementField
from dic.fields.grid import Grid
from dic.numbers import check_type, read_array, read_integer, shown

StrainKind = Literal["small", "green-lagrange", "logarithmic"]
"""Definition of strain: of small motion, or free of rotation."""

MIN_FRACTION = 0.5  # fraction of a window that must be valid
_NUDGE = 1e-5  # for differences of the strain measures: error 1e-10


@dataclass(frozen=True)
class StrainField:
    """In-plane strain at N points, dimensionless; NaN where it is not `valid`.

    Attributes
    ----------
    xy : (N, 2) float64, px
    exx, eyy, exy : (N,) float64
        Tensor components along the image's x and y; engineering shear is 2 exy.
    sigma : (N, 3) float64
        One standard deviation of exx, eyy, exy.
    valid : (N,) bool
    vsg : int, px
        Length of the virtual strain gauge: the pixels that one strain depends on.
    window : int
        Points along the side of the strain window; 1 for gauges without a grid.
    kind : str
        "small", "green-lagrange" or "logarithmic".
    grid : Grid or None
    """

    xy: F64
    exx: F64
    eyy: F64
    exy: F64
    sigma: F64
    valid: Mask
    vsg: int
    window: int
    kind: StrainKind
    grid: Grid | None

    @property
    def gxy(self) -> F64:
        """Engineering shear 2 exy, (N,)."""
        return 2 * self.exy


def strain(
    disp: DisplacementField,
    window: int = 5,
    kind: StrainKind = "small",
    slopes: F64 | None = None,
) -> StrainField:
    """Strain from a least-squares plane through u and v over a window of points.

    Parameters
    ----------
    disp : DisplacementField
        On a grid. Scattered gauges are taken too if they were measured at order 1: their strain is
        that of the subset itself, `window` is not used, and the gauge length is the subset. A field
        of `dic.adaptive_field` brings its own gradient over windows that the data chose: `window`
        is not used, and the gauge length is the median of its `gauge`.
    window : int
        Points along the side of the window, odd. Points that are not valid are left out; at least
        half of the window and its centre must be valid.
    kind : {"small", "green-lagrange", "logarithmic"}
        With F = 1 + ∇u: the symmetric part of ∇u; (FᵀF - 1)/2; and ln U = ½ ln FᵀF (Hencky).
    slopes : (N, 2, 2) float64 or None
        Of the true places of the points in their px, where the displacement is one of places: of a
        lens, or of a camera that looks askew. Strain is then along the axes of the places.

    Raises
    ------
    ValueError
        The kind is unknown, the window is not odd or larger than the grid, there is no gradient, or
        the slopes are not of the points or have no inverse.

    Notes
    -----
    σ follows from that of the displacements and from their overlap: two subsets that share a part
    of their pixels share that part of their noise, ρ = (1 - |Δx|/subset)₊ (1 - |Δy|/subset)₊ at
    orders 0 and 1; at order 2 the pixels count as the quadratic fit weighs them.
    """
    check_type(disp, DisplacementField, "disp", "dic.correlate")
    _check_kind(kind)
    if disp.gauge is not None:
        gradient, variance = disp.gradient, disp.sigma_gradient**2
        window, vsg = 1, _median(disp.gauge)
    elif disp.grid is None:
        gradient, variance = _of_subsets(disp)
        window, vsg = 1, disp.subset
    else:
        window = check_window(window)
        check_fits(window, disp.grid.shape)
        gradient, variance = _of_windows(disp, disp.grid, window)
        vsg = (window - 1) * disp.grid.step + disp.subset
    if slopes is not None:
        gradient, variance = _by_place(gradient, variance, slopes)
    e, sigma = _measure_with_sigma(gradient, variance, kind)
    return StrainField(
        xy=disp.xy,
        exx=e[:, 0],
        eyy=e[:, 1],
        exy=e[:, 2],
        sigma=sigma,
        valid=np.all(np.isfinite(e), axis=1),
        vsg=vsg,
        window=window,
        kind=kind,
        grid=disp.grid,
    )


def _by_place(gradient: AnyArray, variance: AnyArray, slopes: F64) -> tuple[AnyArray, AnyArray]:
    """Slopes in places rather than in px, and their variances."""
    given = read_array(slopes, "slopes", "per px")
    if given.shape != gradient.shape:
        raise ValueError(f"slopes must be {gradient.shape}, got shape {given.shape}; stack them so")
    turn = np.abs(np.linalg.det(given))
    if not np.all(turn > 1e-12 * np.sum(given**2, axis=(1, 2))):
        raise ValueError("slopes must have an inverse at every point; correct the map of places")
    inverse = np.linalg.inv(given)
    return gradient @ inverse, variance @ inverse**2


def check_window(window: int) -> int:
    """Return a strain window; ValueError if it has no middle or no slope."""
    window = read_integer(window, "strain window", "points")
    if window % 2 == 0 or window < 3:
        raise ValueError(f"strain window must be odd and at least 3 points, got {window}; use 5")
    return window


def check_fits(window: int, shape: tuple[int, ...]) -> None:
    """Refuse a strain window that is larger than the grid (R, C)."""
    if window > min(shape):
        rows, columns = shape
        raise ValueError(
            f"strain window of {window} points is larger than the grid of {columns}x{rows} points; "
            "use a smaller window or step"
        )


def _check_kind(kind: StrainKind) -> None:
    if check_type(kind, str, "strain kind", "its name, such as 'small'") not in get_args(
        StrainKind
    ):
        raise ValueError(
            f"strain kind must be one of {', '.join(get_args(StrainKind))}, got {shown(kind)}; "
            "use 'small'"
        )


def _median(gauge: F64) -> int:
    known = gauge[np.isfinite(gauge)]
    return round(float(np.median(known))) if len(known) else 0


def _of_subsets(disp: DisplacementField) -> tuple[AnyArray, AnyArray]:
    if disp.order == 0:
        raise ValueError(
            "strain needs a grid of points, or scattered points measured at order 1, got scattered "
            "points at order 0; prepare with order=1"
        )
    return disp.gradient, disp.sigma_gradient**2


def _of_windows(disp: DisplacementField, grid: Grid, window: int) -> tuple[AnyArray, AnyArray]:
    fields = np.stack([disp.u, disp.v, disp.sigma_u, disp.sigma_v])
    fields[:, ~disp.valid] = np.nan
    gradient = np.full((*grid.shape, 2, 2), np.nan)
    variance = np.full((*grid.shape, 2, 2), np.nan)
    overlap = roughness.overlap(disp.order, grid.subset, grid.step, window)
    layout = window // 2, float(grid.step), overlap
    _fit(fields.reshape(4, *grid.shape), disp.valid.reshape(grid.shape), layout, gradient, variance)
    return gradient.reshape(-1, 2, 2), variance.reshape(-1, 2, 2)


@njit(cache=True, nogil=True)
def _fit(
    fields: F64, valid: Mask, layout: tuple[int, float, F64], gradient: F64, variance: F64
) -> None:
    """Fit planes; writes ∂(u, v)/∂(x, y) and their variances where a window holds enough points."""
    (rows, columns), (half, step, overlap) = valid.shape, layout
    points = (2 * half + 1) ** 2
    enough = max(3.0, MIN_FRACTION * points)
    place, weights, spread = (
        np.empty((points, 2), np.int64),
        np.empty((points, 2)),
        np.empty((points, 4)),
    )
    for r in range(rows):
        if half <= r < rows - half:
            inside = slice(half, columns - half)
            around = fields[:, r - half : r + half + 1]
            _fit_along(around, layout, gradient[r, inside], variance[r, inside])
        for c in range(columns):
            if not valid[r, c] or np.isfinite(gradient[r, c, 0, 0]):
                continue
            count = 0
            for i in range(max(r - half, 0), min(r + half + 1, rows)):
                for j in range(max(c - half, 0), min(c + half + 1, columns)):
                    if valid[i, j]:
                        place[count, 0], place[count, 1] = i, j
                        count += 1
            if count >= enough and _weigh(place[:count], step, weights):
                _slopes(fields, place[:count], weights, gradient[r, c], spread)
                _vary(place[:count], spread, overlap, variance[r, c])


@njit(cache=True, nogil=True)
def _fit_along(fields: F64, layout: tuple[int, float, F64], gradient: F64, variance: F64) -> None:
    """Fit the whole windows of a row; NaN where a point of the window is not valid.

    Parameters
    ----------
    fields : (4, 2 half + 1, C + 2 half) float64
        The rows that the windows reach over.
    gradient, variance : (C, 2, 2) float64
        Written.
    """
    half, step, overlap = layout
    side, count = 2 * half + 1, len(gradient)
    square = step * side**2 * (side**2 - 1) / 12
    slopes, spreads = np.zeros((2, 2, 2, count))
    for n in range(side**2):
        i, j = n // side, n % side
        for a in range(2):
            _add(fields[a, i, j : j + count], (j - half) / square, (i - half) / square, slopes[a])
        for m in range(n + 1):
            k, h = m // side, m % side
            shared = overlap[i - k, abs(j - h)] * (1 + (m < n)) / square**2
            if shared == 0:
                continue
            by_x, by_y = shared * (j - half) * (h - half), shared * (i - half) * (k - half)
            for a in range(2, 4):
                one, other = fields[a, i, j : j + count], fields[a, k, h : h + count]
                _add_product(one, other, by_x, by_y, spreads[a - 2])
    gradient[:], variance[:] = slopes.transpose(2, 0, 1), spreads.transpose(2, 0, 1)


@njit(cache=True, nogil=True)
def _add(line: F64, by_x: float, by_y: float, total: F64) -> None:
    along_x, along_y = total
    for c in range(len(line)):
        along_x[c] += by_x * line[c]
        along_y[c] += by_y * line[c]


@njit(cache=True, nogil=True)
def _add_product(one: F64, other: F64, by_x: float, by_y: float, total: F64) -> None:
    along_x, along_y = total
    for c in range(len(one)):
        product = one[c] * other[c]
        along_x[c] += by_x * product
        along_y[c] += by_y * product


@njit(cache=True, nogil=True)
def _weigh(place: I64, step: float, weights: F64) -> bool:
    """Weigh points for the slopes of their plane along x and y, unless they lie on a line."""
    count = place.shape[0]
    middle_x = middle_y = xx = xy = yy = 0.0
    for n in range(count):
        middle_x += place[n, 1] / count
        middle_y += place[n, 0] / count
    for n in range(count):
        x, y = (place[n, 1] - middle_x) * step, (place[n, 0] - middle_y) * step
        xx, xy, yy = xx + x * x, xy + x * y, yy + y * y
    determinant = xx * yy - xy * xy
    if determinant <= 1e-9 * xx * yy:
        return False
    for n in range(count):
        x, y = (place[n, 1] - middle_x) * step, (place[n, 0] - middle_y) * step
        weights[n, 0] = (yy * x - xy * y) / determinant
        weights[n, 1] = (xx * y - xy * x) / determinant
    return True


@njit(cache=True, nogil=True)
def _slopes(fields: F64, place: I64, weights: F64, gradient: F64, spread: F64) -> None:
    """Write ∂(u, v)/∂(x, y), and what the σ of each point brings to the σ of each of the four."""
    gradient[:] = 0
    for n in range(place.shape[0]):
        i, j = place[n]
        for a in range(2):
            for b in range(2):
                gradient[a, b] += weights[n, b] * fields[a, i, j]
                spread[n, 2 * a + b] = weights[n, b] * fields[2 + a, i, j]


@njit(cache=True, nogil=True)
def _vary(place: I64, spread: F64, overlap: F64, variance: F64) -> None:
    """Write the variances of the four slopes: points whose subsets overlap share their noise."""
    variance[:] = 0
    for n in range(place.shape[0]):
        for m in range(n + 1):
            shared = overlap[place[n, 0] - place[m, 0], abs(place[n, 1] - place[m, 1])]
            shared *= 1 + (m < n)
            for k in range(4):
                variance[k // 2, k % 2] += shared * spread[n, k] * spread[m, k]


def _measure_with_sigma(
    gradient: AnyArray, variance: AnyArray, kind: StrainKind
) -> tuple[AnyArray, AnyArray]:
    """Strain (N, 3) and its σ (N, 3), by the slopes of the measure in the four gradients."""
    spread = np.zeros((len(gradient), 3))
    for a in range(2):
        for b in range(2):
            nudge = np.zeros((2, 2))
            nudge[a, b] = _NUDGE
            slope = (_measure(gradient + nudge, kind) - _measure(gradient - nudge, kind)) / (
                2 * _NUDGE
            )
            spread += slope**2 * variance[:, a, b, None]
    return _measure(gradient, kind), np.sqrt(spread)


def strain_measure(gradient: F64, kind: StrainKind) -> F64:
    """Strain of a displacement gradient.

    Parameters
    ----------
    gradient : (..., 2, 2) float64
        [[∂u/∂x, ∂u/∂y], [∂v/∂x, ∂v/∂y]].
    kind : {"small", "green-lagrange", "logarithmic"}

    Returns
    -------
    (..., 3) float64
        exx, eyy, exy.

    Raises
    ------
    ValueError
        The kind is unknown, or the gradients are of another shape, or turn the material inside out.
    """
    _check_kind(kind)
    given = read_array(gradient, "gradient", "px per px")
    if given.shape[-2:] != (2, 2):
        raise ValueError(f"gradient must be (..., 2, 2), got shape {given.shape}; stack it so")
    (xx, xy), (yx, yy) = np.moveaxis(np.eye(2) + given, (-2, -1), (0, 1))
    if kind == "logarithmic" and np.any(xx * yy <= xy * yx):
        raise ValueError("1 + gradient must have a positive determinant; this one folds the plane")
    return _measure(given, kind)


def _measure(gradient: F64, kind: StrainKind) -> F64:
    """Strain (..., 3) of gradients that were checked."""
    swapped = np.swapaxes(gradient, -1, -2)
    match kind:
        case "small":
            tensor = (gradient + swapped) / 2
        case "green-lagrange":
            tensor = (gradient + swapped + swapped @ gradient) / 2
        case "logarithmic":
            stretch = np.eye(2) + gradient
            tensor = _log(np.swapaxes(stretch, -1, -2) @ stretch) / 2
    return np.stack([tensor[..., 0, 0], tensor[..., 1, 1], tensor[..., 0, 1]], axis=-1)


def _log(tensor: AnyArray) -> AnyArray:
    """Logarithm of symmetric positive 2x2 tensors: mean and deviator keep their directions."""
    mean = (tensor[..., 0, 0] + tensor[..., 1, 1]) / 2
    apart = np.hypot((tensor[..., 0, 0] - tensor[..., 1, 1]) / 2, tensor[..., 0, 1])
    relative = apart / mean
    # artanh(r)/r is smooth at zero, where the deviator vanishes.
    safe = np.where(relative > 1e-4, relative, 1.0)
    scale = np.where(
        relative > 1e-4, np.arctanh(np.minimum(safe, 1 - 1e-16)) / safe, 1 + relative**2 / 3
    )
    deviator = (tensor - mean[..., None, None] * np.eye(2)) * (scale / mean)[..., None, None]
    isotropic = np.log(mean * mean - apart * apart) / 2
    return deviator + isotropic[..., None, None] * np.eye(2)
