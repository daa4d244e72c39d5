"""Correlate a frame with its reference: the moment method.

Once an iteration the whole frame is warped by the dense motion U between the points, and every
point solves for the motion u_p of its subset and the light,

    min Σ_W [ (g(x + U) - B)/A - f - ∇f·U + ∇f·u_p(ξ) - α f - β ]²,

from sums over its subset. Gain A and offset B make it ZNSSD. The fixed point does not depend on how
U is interpolated to first order: whatever g(x + U) misses of the motion is in the residual.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import AnyArray
from dic.correlation import dense_motion, point_status
from dic.correlation.deformed_image import DeformedImage, read_parts, read_whole
from dic.correlation.iteration import (
    begin_again,
    iterate_field,
    iterate_points,
    unsettled,
)
from dic.correlation.newton import Points
from dic.correlation.reference import Reference
from dic.correlation.start import nowhere, start
from dic.fields.displacement import DisplacementField, Status
from dic.images.image import check_image, check_pair
from dic.numbers import check_type

_PART = 2500  # px filtered for one point, in the time that the whole image takes


def correlate(
    ref: Reference, image: ArrayLike, guess: DisplacementField | ArrayLike | None = None
) -> DisplacementField:
    """Measure the displacement of every point of a reference in a frame.

    Parameters
    ----------
    ref : Reference
    image : (H, W) uint8, uint16 or float, grey levels
        The deformed image, of the size of the reference. Gain and offset of its light are free.
    guess : DisplacementField or (N, 2) px, optional
        Displacement to start from, such as the field of the previous frame. NaN is filled from the
        nearest neighbour. Without it, or if all of it is NaN, the points are searched for over the
        whole image.

    Returns
    -------
    DisplacementField
        A point that cannot be measured has its `Status` and NaN.

    Raises
    ------
    ValueError
        The image or the guess does not belong to the reference.

    Notes
    -----
    σ: where both images carry noise σ, the residual of a subset has the variance (1 + κ)σ², κ ≤ 1
    being what interpolation leaves of the noise between the pixels. From it follows σ, and σ_u² is
    2σ² times the diagonal of the inverse of the full Hessian (motion and light): 2σ²/SSSIG for a
    balanced pattern. The fraction of the Hessian that is noise of the reference is taken off, and
    where a field on a grid is rougher than its σ says, σ is that much larger (`roughness`).
    """
    image = _read(ref, image)
    if ref.device is not None:
        return ref.on_device.correlate(image, guess)
    return point_status.displacement_field(ref, *_iterate(ref, image, guess))


def iterate(
    ref: Reference, image: ArrayLike, guess: DisplacementField | ArrayLike | None
) -> tuple[Points, DeformedImage]:
    """Iterate the points of a reference on a frame, as far as they can be followed.

    Raises
    ------
    ValueError
        As `correlate`.
    """
    image = _read(ref, image)
    if ref.device is not None:
        return ref.on_device.iterate(image, guess)
    return _iterate(ref, image, guess)


def _read(ref: Reference, image: ArrayLike) -> AnyArray:
    """Check the image of a frame."""
    check_type(ref, Reference, "ref", "dic.prepare")
    image = check_image(image, "deformed")
    check_pair(ref.image.shape, image.shape)
    return image


def _iterate(
    ref: Reference, image: AnyArray, guess: DisplacementField | ArrayLike | None
) -> tuple[Points, DeformedImage]:
    usable = ref.status == Status.OK
    begun = start(ref, image, guess, usable)
    if not begun.anywhere:
        return nowhere(ref, image, begun)
    points = Points(dense_motion.fill(ref.xy, begun.motion(ref.order), begun.known)[0])
    frame = None
    if ref.grid is None and len(points.motion) * _PART < image.size:
        frame = read_parts(image)
        iterate_points(ref, frame, points, usable)
        usable &= np.isnan(points.change)
    if frame is None or usable.any():
        frame = read_whole(image, ref.prefilter)
        if ref.grid is not None:
            iterate_field(ref, ref.grid, frame.pixels, points)
            usable = unsettled(ref, points)
        iterate_points(ref, frame, points, usable)
        iterate_points(ref, frame, points, begin_again(ref, points, begun))
    return points, frame
