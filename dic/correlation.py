"""Correlate a frame with its reference: the moment method.

Once an iteration the whole frame is warped by the dense motion U between the points, and every point
solves for the motion u_p of its subset and the light,

    min Σ_W [ (g(x + U) - B)/A - f - ∇f·U + ∇f·u_p(ξ) - α f - β ]²,

from sums over its subset. Gain A and offset B make it ZNSSD. The fixed point does not depend on how
U is interpolated to first order: whatever g(x + U) misses of the motion is in the residual.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from dic import dense, moments, seeds
from dic.displacement import DisplacementField, Status
from dic.image import check_image, check_pair
from dic.reference import Reference
from dic.spline import coefficients, noise_power, noise_slope

_TOGETHER = 10  # iterations of the whole field
_ITERATIONS = 20  # of a point alone
_STILL = 1e-4  # px, a fiftieth of the usual noise: a point that moves less stands
_STOPPED = 1e-3  # px, more than this in the last iteration is NOT_CONVERGED
_STRIDE = 2.0  # px, longest step believed: half a speckle
_FEW = 0.05  # share of points below which they iterate alone
_FOUND = 0.8  # ZNCC below which the result is not the same pattern
_SEED_SPACING = 40  # px


class _Points:
    """State of the N points of a reference while they are iterated."""

    def __init__(self, motion: NDArray[np.float64]):
        count = len(motion)
        self.motion = motion  # (N, 6) u, ∂u/∂x, ∂u/∂y, v, ∂v/∂x, ∂v/∂y
        self.change = np.full(count, np.nan)  # px, in the last iteration
        self.zncc = np.full(count, np.nan)
        self.residual = np.full(count, np.nan)  # variance, (grey levels of the reference)²
        self.iterations = np.zeros(count, dtype=np.int16)
        self.still = np.zeros(count, dtype=bool)

    def step(self, ref: Reference, sums: NDArray, here) -> None:
        """Take one Gauss-Newton step of the points `here`."""
        self.iterations[here] += ~self.still[here]
        self.motion[here], self.change[here], self.zncc[here], self.residual[here] = _solve(
            sums, ref.xy[here], ref.inverse[here], ref.light[here], self.motion[here], ref.half
        )
        self.still[here] = self.change[here] < _STILL

    def good(self, ref: Reference) -> NDArray[np.bool_]:
        """(N,) True where the pattern was found again on the picture."""
        return (ref.status == Status.OK) & (self.zncc >= _FOUND) & ~_leaves(ref, self.motion)


def correlate(
    ref: Reference, image: ArrayLike, guess: DisplacementField | ArrayLike | None = None
) -> DisplacementField:
    """Measure the displacement of every point of a reference in a frame.

    Parameters
    ----------
    ref : Reference
    image : (H, W) uint8, uint16 or float, grey levels
        The deformed picture, of the size of the reference. Gain and offset of its light are free.
    guess : DisplacementField or (N, 2) px, optional
        Displacement to start from, such as the field of the previous frame. NaN is filled from the
        nearest neighbour. Without it the points are searched for over the whole picture.

    Returns
    -------
    DisplacementField
        A point that cannot be measured has its `Status` and NaN.

    Raises
    ------
    ValueError
        The picture or the guess does not belong to the reference.

    Notes
    -----
    σ: the residual of a subset has the variance σ_f² + κσ_g² = (1 + κ)σ² when both pictures carry noise σ,
    κ ≤ 1 being what interpolation leaves of it between the pixels; σ_u² is 2σ² times the diagonal of
    the inverse of the full Hessian (motion and light), which is 2σ²/SSSIG for a balanced pattern.
    """
    image = check_image(image, "deformed")
    check_pair(ref.image.shape, image.shape)
    usable = ref.status == Status.OK
    motion, known = _start(ref, image, guess, usable)
    spline = coefficients(image - image.mean(dtype=np.float64))
    points = _Points(dense.fill(ref.xy, motion, known)[0])
    if ref.grid is not None and usable.any():
        _together(ref, spline, points)
        good = points.good(ref)
        _alone(ref, spline, points, good & ~points.still)
    else:
        _alone(ref, spline, points, usable)
    return _field(ref, points)


def _start(ref, image, guess, usable) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Motion (N, 6) to start from, and where it is known."""
    motion = np.zeros((len(ref.xy), 6))
    if guess is None:
        places, known = _seed_places(ref, usable), np.zeros(len(usable), dtype=bool)
        motion[places], known[places] = seeds.find(
            ref.image, image.astype(np.float32), ref.xy[places]
        )
        return motion, known
    if isinstance(guess, DisplacementField):
        given = np.column_stack([guess.u, guess.v])
    else:
        given = np.asarray(guess, dtype=np.float64)
    if given.shape != ref.xy.shape:
        raise ValueError(f"guess must be {ref.xy.shape} px, one (u, v) a point, got {given.shape}")
    known = np.isfinite(given).all(axis=1)
    motion[known, 0], motion[known, 3] = given[known].T
    if isinstance(guess, DisplacementField):
        motion[known, 1:3], motion[known, 4:6] = guess.gradient[known, 0], guess.gradient[known, 1]
    return motion, known


def _seed_places(ref: Reference, usable: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Indices of the points to search for: in each cell of the picture the one nearest its middle."""
    places = np.flatnonzero(usable)
    cell, offset = np.divmod(ref.xy[places], _SEED_SPACING)
    nearest = np.argsort(np.abs(offset - _SEED_SPACING / 2).max(axis=1), kind="stable")
    _, first = np.unique(cell[nearest], axis=0, return_index=True)
    return places[nearest[first]]


def _together(ref: Reference, spline: NDArray, points: _Points) -> None:
    """Iterate all points of a grid on the frame warped by their dense motion, until few still move."""
    grid, held = ref.grid, -1
    for _ in range(_TOGETHER):
        net = dense.net(points.motion, grid)
        sums = moments.frame_sums_on_grid(ref.texture, spline, net, grid.xs, grid.ys, ref.half)
        points.step(ref, sums, slice(None))
        good = points.good(ref)
        moving, count = np.count_nonzero(good & ~points.still), np.count_nonzero(good)
        if moving <= _FEW * count and count <= held:
            return
        held = count
        points.motion, _ = dense.fill(ref.xy, points.motion, good)


def _alone(ref: Reference, spline: NDArray, points: _Points, waiting: NDArray) -> None:
    """Iterate the points `waiting` one by one; try those that are lost again beside those found.

    Alone, a point does not feel what a lost neighbour does to the dense motion.
    """
    while waiting.any():
        for _ in range(_ITERATIONS):
            here = np.flatnonzero(waiting & ~points.still)
            if len(here) == 0:
                break
            sums = moments.frame_sums_at_points(
                ref.texture, spline, ref.xy[here], ref.half, points.motion[here]
            )
            points.step(ref, sums, here)
        good = points.good(ref)
        if not (good & waiting).any():
            return
        motion, given = dense.fill(ref.xy, points.motion, good, _SEED_SPACING)
        waiting = given & (ref.status == Status.OK) & ~_leaves(ref, motion) & ~(waiting & good)
        points.motion[waiting], points.still[waiting] = motion[waiting], False


@njit(cache=True, nogil=True)
def _solve(sums, xy, inverse, light, motion, half):
    """One Gauss-Newton step of every point.

    Returns the motion, its change over the subset in px, ZNCC and residual variance in grey levels².
    """
    count = sums.shape[0]
    moved, change = motion.copy(), np.zeros(count)
    zncc, residual = np.zeros(count), np.zeros(count)
    towards, back, total = np.empty(8), np.empty(8), np.empty(8)
    for n in range(count):
        s, pixels = sums[n], max(light[n, 2], 1.0)
        var_f = light[n, 0] - light[n, 1] ** 2 / pixels
        var_g = s[12] - s[9] ** 2 / pixels
        if var_f <= 0 or var_g <= 1e-9 * s[12]:
            continue
        zncc[n] = (s[8] - light[n, 1] * s[9] / pixels) / np.sqrt(var_f * var_g)
        # The gain only scales the step: the ratio of contrasts is good enough, and never negative.
        gain = np.sqrt(var_g / var_f)
        _project(s, xy[n], towards, back)
        target = towards / gain - back
        for i in range(8):
            total[i] = 0.0
            for k in range(8):
                total[i] -= inverse[n, i, k] * target[k]
        squares = s[12] / gain**2 - 2 * s[13] / gain + s[14] + np.dot(target, total)
        residual[n] = squares / max(pixels - 8, 1.0)
        change[n] = _advance(motion[n], total, half, moved[n])
    return moved, change, zncc, residual


@njit(cache=True, nogil=True)
def _project(s, place, towards, back):
    """Jᵀg and Jᵀq of a subset, from sums whose x and y are those of the picture."""
    x, y = place
    for a in range(2):
        k = 3 * a
        towards[k], back[k] = s[a], s[2 + a]
        towards[k + 1], back[k + 1] = s[4 + a] - x * s[a], s[6 + a] - x * s[2 + a]
        towards[k + 2], back[k + 2] = s[15 + a] - y * s[a], s[17 + a] - y * s[2 + a]
    towards[6], towards[7] = -s[8], -s[9]
    back[6], back[7] = -s[10], -s[11]


@njit(cache=True, nogil=True)
def _advance(old, total, half, new):
    """Move from the old motion towards the total; returns the change in px.

    The step was measured with ∇f in place of the gradient of the frame, so it is that of the inverse
    composition: the deformation gradient F = 1 + ∇U turns it into the additive one, and Newton's
    convergence is kept at large strain and rotation.
    """
    du, dv = total[0] - old[0], total[3] - old[3]
    reach = np.sqrt(du * du + dv * dv)
    brake = _STRIDE / reach if reach > _STRIDE else 1.0
    f11, f12, f21, f22 = 1 + old[1], old[2], old[4], 1 + old[5]
    change = 0.0
    for k in range(3):
        a, b = brake * (total[k] - old[k]), brake * (total[3 + k] - old[3 + k])
        step_u, step_v = f11 * a + f12 * b, f21 * a + f22 * b
        new[k], new[3 + k] = old[k] + step_u, old[3 + k] + step_v
        size = max(abs(step_u), abs(step_v)) * (half if k else 1)
        change = max(change, size)
    return change


def _field(ref: Reference, points: _Points) -> DisplacementField:
    noise = np.sqrt(np.maximum(points.residual, 0) / _noise_gain(points.motion, ref.half))
    status = _status(ref, points, noise)
    lost = status != Status.OK
    spread = noise[:, None] * np.sqrt(2 * np.diagonal(ref.inverse, axis1=1, axis2=2)[:, :6])
    motion = points.motion.copy()
    motion[lost], spread[lost] = np.nan, np.nan
    untried = ref.status != Status.OK
    return DisplacementField(
        xy=ref.xy,
        u=motion[:, 0],
        v=motion[:, 3],
        sigma_u=spread[:, 0],
        sigma_v=spread[:, 3],
        gradient=motion[:, [[1, 2], [4, 5]]],
        sigma_gradient=spread[:, [[1, 2], [4, 5]]],
        zncc=np.where(untried, np.nan, points.zncc),
        iterations=np.where(untried, 0, points.iterations).astype(np.int16),
        status=status,
        subset=ref.subset,
        order=ref.order,
        grid=ref.grid,
    )


def _noise_gain(motion: NDArray, half: int) -> NDArray[np.float64]:
    """Variance of the residual over that of the noise of one picture, 1 + κ, (N,).

    κ depends on the fraction of a px by which the subset moved, averaged over what its gradients sweep.
    """
    mean, harmonic = noise_power()
    kept = np.ones(len(motion))
    for shift, along_x, along_y in (motion[:, :3].T, motion[:, 3:].T):
        swept = np.sinc(2 * half * along_x) * np.sinc(2 * half * along_y)
        kept *= mean + harmonic * np.cos(2 * np.pi * shift) * swept
    return 1 + kept


def _status(ref, points, noise) -> NDArray[np.int8]:
    """Name what became of each point; what is named first stands."""
    measured = (ref.status == Status.OK) & (points.zncc >= _FOUND)
    level = np.median(noise[measured]) if measured.any() else 0.0
    status = ref.status.copy()
    for condition, name in (
        # Twice what noise alone would show as slope: there is nothing there but noise.
        (ref.slope < np.sqrt(2 * noise_slope()) * level, Status.FLAT),
        (_leaves(ref, points.motion), Status.OUTSIDE),
        (~(points.zncc >= _FOUND), Status.LOW_CORRELATION),
        (~(points.change <= _STOPPED), Status.NOT_CONVERGED),
    ):
        status[(status == Status.OK) & condition] = name
    return status


def _leaves(ref: Reference, motion: NDArray) -> NDArray[np.bool_]:
    """(N,) True where a corner of the moved subset lies off the area of the picture."""
    outside = np.zeros(len(motion), dtype=bool)
    height, width = ref.image.shape
    for axis, limit in ((0, width), (1, height)):
        u, ux, uy = motion[:, 3 * axis : 3 * axis + 3].T
        centre = np.rint(ref.xy[:, axis]) + u
        along, across = (ux, uy) if axis == 0 else (uy, ux)
        reach = ref.half * (np.abs(1 + along) + np.abs(across))
        outside |= (centre - reach < -0.5) | (centre + reach > limit - 0.5)
    return outside
