"""DIC without images: what it reads from a motion of the image, and with what noise.

A subset that fits a polynomial to the motion of its pixels, and a window that fits a plane to the
motion of its subsets, are weighted means of the motion around a place. The same weights carry the
noise of the pixels. All of it is linear, so that it composes with what a camera sees of a plate:

    gauges = strain_gauges(px)
    points = camera.on_plate(gauges.px, z)
    motion = seen(camera, gauges.px, modes.value(points), modes.slope(points), z)
    per_newton = gauges.read(motion) @ modes.response(xy).T
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.signal import correlate

from dic import box_sums, check_image, lies_inside, spline_coefficients, spline_gradient
from synthetic.arrays import F64
from synthetic.points import checked

# Nodes a side of a gauge at which the motion is asked for: exact for polynomials of degree 7.
_NODES = 8


@dataclass(frozen=True, eq=False)
class Gauges:
    """N equal gauges of C channels each: weighted means of the motion around their places.

    Attributes
    ----------
    xy : (N, 2) float64, px, whole numbers.
    kernel : (C, 2, S, S) float64
        Weight of the motion of each pixel [channel, component (u, v), row, column]; the middle
        pixel is the place itself.
    """

    xy: F64
    kernel: F64 = field(repr=False)

    @property
    def size(self) -> int:
        """Side of a gauge, px: the virtual strain gauge (VSG) of a strain."""
        return self.kernel.shape[-1]

    @property
    def px(self) -> F64:
        """(N · 64, 2) float64, px, where the motion is asked for."""
        x, y = np.meshgrid(self._nodes(), self._nodes())
        return (self.xy[:, None] + np.column_stack([x.ravel(), y.ravel()])).reshape(-1, 2)

    def read(self, motion: ArrayLike) -> F64:
        """Read the gauges.

        Parameters
        ----------
        motion : (N · 64, 2, ...) float64, px, motion of the image at `px`, smooth over a gauge.

        Returns
        -------
        (N, C, ...) float64, px for displacement, dimensionless for strain.
        """
        moved = np.asarray(motion, dtype=np.float64)
        count = len(self.xy) * _NODES**2
        if moved.shape[:2] != (count, 2):
            raise ValueError(f"motion must have shape ({count}, 2, ...) in px, got {moved.shape}")
        moved = moved.reshape(len(self.xy), _NODES**2, *moved.shape[1:])
        return np.einsum("caq,nqa...->nc...", self._weights(), moved)

    def covariance(self, texture: ArrayLike, noise: float) -> F64:
        """Covariance of all readings from the noise of the pixels.

        Two gauges share the noise of the pixels that they share. That the light is free costs one
        to two per cent of σ more, which are not in it.

        Parameters
        ----------
        texture : (2, 2) or (N, 2, 2) float64, (grey levels per px)²
            Mean ∇f∇fᵀ of the pattern, as from `texture_at`.
        noise : grey levels, standard deviation in each of the two images.

        Returns
        -------
        (N · C, N · C) float64.
        """
        texture = np.broadcast_to(np.asarray(texture, dtype=np.float64), (len(self.xy), 2, 2))
        if not (np.linalg.eigvalsh(texture) > 0).all() or not 0 <= noise < np.inf:
            raise ValueError(
                f"covariance needs a texture that varies in both directions and noise of at least "
                f"0 grey levels, got noise {noise} and texture {texture[0].tolist()} first; "
                "look at the pattern"
            )
        # A subset of n pixels divides noise times ∇f by n times the texture T: (∇fᵀ T⁻¹) has the
        # mean square T⁻¹, of which each gauge brings its root.
        root = np.linalg.inv(np.linalg.cholesky(texture)).transpose(0, 2, 1)
        shared = np.einsum("nal,mbl->nmab", root, root)
        table = self._overlaps()
        lag = np.rint(self.xy[None] - self.xy[:, None]).astype(np.int64)
        near = np.abs(lag).max(axis=2) < self.size
        column, row = (np.where(near, lag[..., axis], 0) + self.size - 1 for axis in (0, 1))
        overlap = table[..., row, column] * near  # (C, C, 2, 2, N, N)
        count = len(self.xy) * len(self.kernel)
        full = 2 * noise**2 * np.einsum("cdabnm,nmab->ncmd", overlap, shared)
        return full.reshape(count, count)

    def _nodes(self) -> F64:
        return np.polynomial.legendre.leggauss(_NODES)[0] * (self.size / 2)

    def _weights(self) -> F64:
        """Weights (C, 2, Q) of the nodes that have the moments of the kernel up to degree 7."""
        degree, half = _NODES - 1, self.size // 2
        pixels = np.arange(-half, half + 1) / (self.size / 2)
        powers = np.polynomial.legendre.legvander(pixels, degree)
        moments = powers.T @ self.kernel @ powers
        at_nodes = np.polynomial.legendre.legvander(self._nodes() / (self.size / 2), degree)
        back = np.linalg.inv(at_nodes)
        return (back.T @ moments @ back).reshape(*self.kernel.shape[:2], -1)

    def _overlaps(self) -> F64:
        """Sum products of the kernels at each lag: (C, C, 2, 2, 2S − 1, 2S − 1)."""
        channels, reach = len(self.kernel), 2 * self.size - 1
        table = np.zeros((channels, channels, 2, 2, reach, reach))
        for c, d, a, b in np.ndindex(table.shape[:4]):
            first, second = self.kernel[c, a], self.kernel[d, b]
            if first.any() and second.any():
                table[c, d, a, b] = correlate(first, second)
        return table


def displacement_gauges(xy: ArrayLike, subset: int = 21, order: int = 1) -> Gauges:
    """Displacement (u, v) of subsets.

    Parameters
    ----------
    xy : (N, 2), px, middles; rounded to pixels, as by DIC.
    subset : side of the subset, px, odd.
    order : of the shape function, 0 to 2.

    Raises
    ------
    ValueError
        The subset is even or too small, or the order is not known.
    """
    value, _, _ = _subset(subset, order)
    none = np.zeros_like(value)
    return Gauges(_places(xy), np.array([[value, none], [none, value]]))


def strain_gauges(
    xy: ArrayLike, subset: int = 21, step: int = 5, window: int = 5, order: int = 1
) -> Gauges:
    """Small strain (exx, eyy, exy) of whole strain windows around places.

    Parameters
    ----------
    xy, subset, order : as of `displacement_gauges`.
    step : distance of the points of a window, px.
    window : points along its side, odd; 1 for the gradient of the subset itself, as DIC takes it at
        scattered points.

    Raises
    ------
    ValueError
        As `displacement_gauges`, and for a window that is even or a step that is not positive.
    """
    if window < 1 or window % 2 == 0 or step < 1:
        raise ValueError(
            f"strain window must be odd and its step positive, got {window} points and {step} px; "
            "use 5 and 5"
        )
    value, along, down = _subset(subset, order)
    if window == 1 and order == 0:
        raise ValueError(
            "a subset of order 0 has no gradient; use order 1 or a window of 3 or more"
        )
    if window > 1:
        offsets = np.arange(window) - window // 2
        slope = offsets / (step * window * np.square(offsets).sum())
        even = np.ones(window)
        along, down = _spread(value, step, even, slope), _spread(value, step, slope, even)
    none = np.zeros_like(along)
    kernel = [[along, none], [none, down], [down / 2, along / 2]]
    return Gauges(_places(xy), np.array(kernel))


def texture_at(image: ArrayLike, xy: ArrayLike, size: int) -> F64:
    """Mean ∇f∇fᵀ of an image over squares.

    Parameters
    ----------
    image : (H, W), grey levels; noise in it counts as pattern, so average frames or draw one.
    xy : (N, 2), px, middles, rounded to pixels.
    size : side of the squares, px, odd; that of the gauge.

    Returns
    -------
    (N, 2, 2) float64, (grey levels per px)².

    Raises
    ------
    ValueError
        An image that cannot be used, or a square that leaves it.
    """
    image = check_image(image, "reference")
    centres, half = _places(xy).astype(np.int64), size // 2
    outside = np.count_nonzero(~lies_inside(centres, half, image.shape))
    if outside:
        raise ValueError(
            f"squares of {size} px must lie on the image, got {outside} that leave it; "
            f"keep {half} px from its border"
        )
    fx, fy = (
        np.asarray(part, dtype=np.float64) for part in spline_gradient(spline_coefficients(image))
    )
    xx, xy_, yy = (
        box_sums(product, centres, half) / (2 * half + 1) ** 2
        for product in (fx * fx, fx * fy, fy * fy)
    )
    return np.stack([np.stack([xx, xy_], axis=-1), np.stack([xy_, yy], axis=-1)], axis=-2)


def _places(xy: ArrayLike) -> F64:
    return np.rint(checked(xy, 2, "places", "px"))


def _subset(subset: int, order: int) -> tuple[F64, F64, F64]:
    """Weights (S, S) of the value and of both slopes at the middle of the fitted polynomial."""
    if subset < 5 or subset % 2 == 0:
        raise ValueError(f"subset size must be odd and at least 5 px, got {subset} px; use 21")
    if order not in (0, 1, 2):
        raise ValueError(f"order of the shape function must be 0, 1 or 2, got {order}; use order=1")
    half = subset // 2
    y, x = (part.ravel() for part in np.mgrid[-half : half + 1, -half : half + 1] / half)
    terms: Sequence[F64] = [np.ones_like(x), x, y, x * x, x * y, y * y]
    fit = np.linalg.pinv(np.column_stack(terms[: (1, 3, 6)[order]]))
    value = fit[0].reshape(subset, subset)
    if order == 0:
        return value, np.zeros_like(value), np.zeros_like(value)
    along, down = (part.reshape(subset, subset) / half for part in fit[1:3])
    return value, along, down


def _spread(value: F64, step: int, down: F64, along: F64) -> F64:
    """Sum of copies of a kernel at every `step` px, weighted by rows and columns."""
    subset, window = len(value), len(down)
    size = subset + (window - 1) * step
    total = np.zeros((size, size))
    for i, j in np.ndindex(window, window):
        square = np.s_[i * step : i * step + subset, j * step : j * step + subset]
        total[square] += down[i] * along[j] * value
    return total
