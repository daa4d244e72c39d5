"""One Gauss-Newton step of every point, and the state between steps."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from dic.reference import Reference

STILL = 1e-4  # px, a fiftieth of the usual noise: a point that moves less stands still
_STRIDE = 2.0  # px, longest step believed: half a speckle


class Points:
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
        self.still[here] = self.change[here] < STILL


@njit(cache=True, nogil=True)
def _solve(sums, xy, inverse, light, motion, half):
    """One Gauss-Newton step of every point.

    Returns the motion, its change over the subset in px, ZNCC and residual variance.
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

    The step was measured with ∇f in place of the gradient of the frame, so it is that of the
    inverse composition: the deformation gradient F = 1 + ∇U turns it into the additive one, and
    Newton's convergence is kept at large strain and rotation.
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
