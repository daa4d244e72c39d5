"""The reference image, prepared once: its texture and how each subset responds to motion."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F32, F64, I8, I64, AnyArray, Mask
from dic.correlation import clipping, moments, normal
from dic.correlation.blocks import expected_gain
from dic.correlation.checks import check_options, check_served, read_grid, read_points, read_roi
from dic.correlation.subset import gather
from dic.fields.displacement import Status
from dic.fields.grid import Grid, grid_over
from dic.images.image import check_reference
from dic.images.prefilter import Prefilter, gaussian_power, read_prefilter, smooth_image
from dic.images.quality import box_areas, box_sums
from dic.images.spline import noise_slope, prefilter, spline_gradient

if TYPE_CHECKING:
    from dic.correlation.device_field import DeviceField
    from dic.correlation.islands import Islands

_BARE = 0.02  # of the median mean square of ∇f: the inner half of a subset is without pattern
_FAR = 5.0  # σ of the mean square that noise has there
_HALF = 0.5  # of the median: what is steeper is like the rest
_ENOUGH = 0.5  # fraction of the inner half that the ROI must leave to call it without pattern
_LEAK = 3  # px from the edge of the ROI at which the spline keeps 8 % of a jump there


_NO_PREFILTER = Prefilter()


@dataclass(frozen=True)
class Rest:
    """The specimen at rest: the mean of some images.

    Attributes
    ----------
    image : (H, W), grey levels
    stills : int
        Images whose mean it is.
    levels : tuple of (int, Status)
        Grey levels at which their pixels clip.
    """

    image: AnyArray
    stills: int
    levels: tuple[tuple[int, Status], ...]


@dataclass(frozen=True)
class Reference:
    """What `correlate` needs of the reference; made by `prepare`.

    Attributes
    ----------
    image : (H, W) float32, grey levels
        As it was given; the texture is that of the image that has passed the prefilter.
    texture : (4, H, W) float32
        ∂f/∂x, ∂f/∂y, f less its mean, and weight: 1 in the ROI; all four are 0 outside.
    xy : (N, 2) float64, px
        Points of interest.
    inverse : (N, K, K) float64
        Inverse of Σ JᵀJ, J = (fx·m, fy·m, -f, -1) with the monomials m of the shape function
        (`dic.fields.shape`): motion and light of the subset.
    light : (N, 3) float64
        Σf², Σf and the number of pixels of the subset.
    slope : (N,) float64, grey levels per px
        Root mean square of ∇f in the direction in which it is least.
    noise_gain : (N, 2) float64
        What a prefilter makes of the variance of u and of v, because it correlates the noise: 1
        where there is none.
    block_gain : (2,) float64
        What is expected of sums over blocks of a subset (`dic.correlation.blocks`).
    status : (N,) int8
        What is known before any frame: OK, EXCLUDED, FLAT, DARK, SATURATED or OUTSIDE.
    subset : int, px
    order : int
    grid : Grid or None
    subsets : (N, 4, ·) float32 or None
        The texture of each scattered point side by side; None on a grid.
    device : str or None
        Where torch measures the frames; None without torch.
    prefilter : Prefilter
        What every frame passes first.
    stills : int
        Images whose mean `image` is.
    scatter : (2,) float64
        By which σ of u and of v is larger than noise and residual say (`dic.prepare_stills`).
    """

    image: F32
    texture: F32
    xy: F64
    inverse: F64
    light: F64
    slope: F64
    noise_gain: F64
    block_gain: F64
    status: I8
    subset: int
    order: int
    grid: Grid | None
    subsets: F32 | None
    device: str | None = None
    prefilter: Prefilter = _NO_PREFILTER
    stills: int = 1
    scatter: F64 = field(default_factory=lambda: np.ones(2))

    @cached_property
    def on_device(self) -> DeviceField:
        """The grid on its device, put there when it is first asked for.

        Raises
        ------
        ValueError
            The reference names no device.
        """
        from dic.correlation.device_field import DeviceField

        if self.grid is None or self.device is None:
            raise ValueError("reference names no device; prepare a grid with device='cuda'")
        return DeviceField(self, self.grid, self.device)

    @cached_property
    def islands(self) -> Islands | None:
        """Parts of the ROI that are too small for a template, found when first asked for."""
        from dic.correlation.islands import find_islands

        return find_islands(self)

    @property
    def half(self) -> int:
        """(subset - 1)/2, px."""
        return self.subset // 2

    @property
    def margin(self) -> int:
        """By which the pixels that are used stay within the ROI, px."""
        return _margin(self.prefilter.sigma)


def prepare(
    image: ArrayLike,
    subset: int = 21,
    step: int = 5,
    order: int = 1,
    roi: ArrayLike | None = None,
    points: ArrayLike | Grid | None = None,
    device: str | None = None,
    prefilter: Prefilter | float | None = None,
) -> Reference:
    """Prepare a reference image for any number of frames.

    Parameters
    ----------
    image : (H, W) uint8, uint16 or float, grey levels
    subset : int, px
        Side of the square subset, odd.
    step : int, px
        Distance of the points of the grid, which covers the image wherever a whole subset fits.
    order : {0, 1, 2}
        Shape function: 0 a shift, 1 affine, 2 quadratic.
    roi : (H, W) bool, optional
        Pixels that may be used. Points whose centre lies outside are EXCLUDED; of the other subsets
        only the pixels inside count.
    points : (N, 2), px, or Grid, optional
        Measure at these points (x, y), or on this grid, in place of the usual one. Of a subset that
        the image cuts the pixels on it count, if half of them are left.
    device : str, optional
        Where torch shall measure the frames, such as "cuda", for a grid. Without it compiled loops
        do. On a GPU that is an order of magnitude faster than on a core, on torch's processor
        slower: "cpu" is for tests.
    prefilter : Prefilter or float, px, optional
        Standard deviation of the Gaussian that every image passes first, 0 for none. Without it the
        spectrum of the pattern and its noise decide (`Reference.prefilter.reason`).

    Raises
    ------
    ValueError
        One sentence on what cannot be used.
    """
    given = check_reference(image)
    rest = Rest(given, 1, clipping.levels(given))
    return prepare_rest(rest, subset, step, order, roi, points, device, prefilter)


def prepare_rest(
    rest: Rest,
    subset: int,
    step: int,
    order: int,
    roi: ArrayLike | None,
    points: ArrayLike | Grid | None,
    device: str | None,
    prefilter: Prefilter | float | None,
) -> Reference:
    """Prepare the specimen at rest, as `prepare` does a single image of it."""
    image = rest.image
    subset, step, order = check_options(image.shape, subset, step, order)
    weight = read_roi(roi, image.shape)
    grid = (
        grid_over(image.shape, subset, step) if points is None else read_grid(points, subset, step)
    )
    xy = read_points(points if grid is None else grid.xy, image.shape)
    if device is not None:
        check_served(device, grid)
    centres = np.rint(xy).astype(np.int64)

    status = _status(rest, weight, centres, subset // 2)
    chosen = read_prefilter(prefilter, image, weight, subset)
    texture = _texture(chosen.apply(image), _inner(weight, chosen.sigma))
    noise = chosen.noise / rest.stills**0.5
    status = _without_bare(texture, centres, status, subset // 2, chosen.sigma, noise)
    sums = _sums(texture, xy, subset // 2, order, grid)
    slope, status = normal.smallest_slope(sums, status, order)
    noise_gain = _noise_gain(texture, centres, subset // 2, chosen.sigma)
    return Reference(
        image=image.astype(np.float32),
        texture=texture,
        xy=xy,
        inverse=normal.inverse(sums, status, order),
        light=sums[:, -3:].copy(),
        slope=slope,
        noise_gain=noise_gain,
        block_gain=expected_gain(
            texture, noise_gain[status == Status.OK], order, subset, chosen.sigma
        ),
        status=status,
        subset=subset,
        order=order,
        grid=grid,
        subsets=gather(texture, xy, subset // 2) if grid is None else None,
        device=device,
        prefilter=chosen,
        stills=rest.stills,
    )


def _inner(weight: Mask, sigma: float) -> Mask:
    """Pixels of the ROI on which what lies beyond it has no effect through spline and prefilter."""
    if weight.all():
        return weight
    from scipy.ndimage import binary_erosion

    reach = _margin(sigma)
    square = np.ones((2 * reach + 1, 2 * reach + 1), dtype=bool)
    return np.asarray(binary_erosion(weight, square, border_value=1), dtype=bool)


def _margin(sigma: float) -> int:
    return _LEAK + round(2 * sigma)


def _texture(image: AnyArray, weight: Mask) -> F32:
    grey = np.subtract(image, image.mean(dtype=np.float64), dtype=np.float32)
    texture = np.empty((4, *grey.shape), dtype=np.float32)
    texture[0], texture[1] = spline_gradient(prefilter(grey))
    texture[2], texture[3] = grey, weight
    if not weight.all():
        texture *= weight
    return texture


def _status(rest: Rest, weight: Mask, centres: I64, half: int) -> I8:
    image = rest.image
    status = np.zeros(len(centres), dtype=np.int8)
    area = box_areas(centres, half, image.shape)
    enough = (2 * half + 1) ** 2 / 2
    for level, name in rest.levels:
        clipped = image == level
        if np.count_nonzero(clipped) > clipping.UNUSABLE * enough:
            status[box_sums(clipped, centres, half) > clipping.UNUSABLE * area] = name
    if not weight.all():
        status[box_sums(weight, centres, half) < enough] = Status.EXCLUDED
    status[area < enough] = Status.OUTSIDE
    status[~weight[centres[:, 1], centres[:, 0]]] = Status.EXCLUDED
    return status


def _without_bare(
    texture: F32, centres: I64, status: I8, half: int, sigma: float, noise: float
) -> I8:
    """Name FLAT the points with no pattern of their own, such as those in a hole near its rim.

    The rim alone can be followed, but it says nothing of the place of the point. Noise has a
    gradient as well, whose mean square over n pixels is known to 2/√n of it. Where the ROI, and not
    the pattern, leaves too little about the point, it is EXCLUDED.
    """
    usable = status == Status.OK
    if not usable.any():
        return status
    steepness = np.square(texture[0]) + np.square(texture[1])
    own = box_sums(steepness, centres[usable], half // 2)
    used = box_sums(texture[3], centres[usable], half // 2)
    pixels = box_areas(centres[usable], half // 2, steepness.shape)
    own /= pixels
    variance = np.nan_to_num(noise) ** 2 * gaussian_power(sigma)
    of_noise = 2.0 * noise_slope(sigma) * variance
    # A pattern that is itself white is taken for noise; it is so everywhere.
    usual = np.median(own)
    by_noise = np.minimum((1.0 + _FAR * 2.0 / np.sqrt(pixels)) * of_noise, _HALF * usual)
    bare, left_out = own < np.maximum(_BARE * usual, by_noise), used < _ENOUGH * pixels
    status = status.copy()
    status[np.flatnonzero(usable)[bare]] = Status.FLAT
    status[np.flatnonzero(usable)[bare & left_out]] = Status.EXCLUDED
    return status


def _noise_gain(texture: F32, centres: I64, half: int, sigma: float) -> F64:
    """Variance of Σ ∇f n over that of white noise of the same variance, (N, 2), h being the filter.

    It is Σ (h * ∇f)²/(Σ h² Σ ∇f²).
    """
    if not sigma:
        return np.ones((len(centres), 2))
    gain = np.empty((len(centres), 2))
    for axis in (0, 1):
        slope = texture[axis]
        smooth = box_sums(np.square(smooth_image(slope, sigma)), centres, half)
        plain = box_sums(np.square(slope), centres, half)
        gain[:, axis] = smooth / np.maximum(plain, 1e-30)
    return np.maximum(gain, 0.0) / gaussian_power(sigma)


def _sums(texture: F32, xy: F64, half: int, order: int, grid: Grid | None) -> F64:
    if grid is not None:
        return moments.sums_on_grid(texture, *grid.pixels, half, order)
    return moments.sums_at_points(texture, xy, half, order)
