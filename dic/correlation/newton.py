"""One Gauss-Newton step of a subset, the iteration of points one by one, and their state."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from dic.arrays import F32, F64, I64, AnyArray, Mask
from dic.compiled import njit
from dic.correlation.blocks import block_count, sum_blocks
from dic.correlation.deformed_image import DeformedImage
from dic.correlation.reference import Reference
from dic.correlation.subset import (
    LOST,
    SHIFTED,
    Tools,
    correlate_with,
    lay_out,
    make_tools,
    subsets_of,
    subtract_fit,
    warp,
)
from dic.fields import shape
from dic.fields.displacement import Status
from dic.per_thread import PerThread

Known: TypeAlias = tuple[F64, F64, int]  # inverse, light and half of a reference
Image: TypeAlias = tuple[AnyArray, bool]
"""Pixels of a frame, and whether they are coefficients."""

Blocks: TypeAlias = tuple[Mask, F64, int]  # points looked at, `Points.blocks`, blocks along a side
State: TypeAlias = tuple[F64, F64, F64, F64, NDArray[np.int16], Mask]  # arrays of `Points`

STILL = 1e-3  # px, a fifth of the usual noise: what is left then is less than a tenth of it
STRIDE = 2.0  # px, longest step believed: half a speckle
_ITERATIONS = 20  # of a point alone
_TRIAL = 6  # iterations after each of which a point must look more alike, or it is lost
_SAMPLES = 48  # points whose residual is looked at
_LIKE = 0.4  # ZNCC that it must gain each time
NOWHERE = -1 << 40  # px, where no part of a frame lies


class Points:
    """State of the N points of a reference while they are iterated."""

    def __init__(self, motion: F64) -> None:
        count = len(motion)
        self.motion = motion  # (N, 2, P) coefficients of the shape function of u and of v
        self.change = np.full(count, np.nan)  # px, in the last iteration
        self.zncc = np.full(count, np.nan)
        self.residual = np.full(count, np.nan)  # variance, (grey levels of the reference)²
        self.iterations = np.zeros(count, dtype=np.int16)
        self.still = np.zeros(count, dtype=bool)
        self.blocks = np.full((count, 2), np.nan)  # of some points: see `sum_blocks`
        self.repeats = np.zeros(count, dtype=bool)  # another motion is as good

    def step(self, ref: Reference, sums: AnyArray, base: tuple[int, int]) -> None:
        """Take one Gauss-Newton step of all points, from sums of motion less `base`."""
        _step_all(sums, np.array(base, dtype=np.float64), normal_of(ref), self._state())

    def iterate(self, ref: Reference, frame: DeformedImage, here: I64) -> None:
        """Iterate the points `here` one by one until they stand still."""
        seen = np.zeros(len(ref.xy), dtype=bool)
        if ref.grid is None:
            seen[sampled(ref, ref.status == Status.OK, _SAMPLES)] = True
        _iterate(
            subsets_of(ref, here), (frame.pixels, frame.filtered), ref.xy, here, normal_of(ref),
            self._state(), (seen, self.blocks, block_count(ref.subset)), bench_tools(ref),
        )  # fmt: skip

    def _state(self) -> State:
        return (
            self.motion,
            self.change,
            self.zncc,
            self.residual,
            self.iterations,
            self.still,
        )


_TOOLS = PerThread(make_tools)


def normal_of(ref: Reference) -> Known:
    """Take what the normal equations of the points need of a reference."""
    return ref.inverse, ref.light, ref.half


def bench_tools(ref: Reference) -> Tools:
    """Arrays of this thread in which the subsets of a reference are worked on."""
    return _TOOLS(ref.half, shape.count(ref.order), ref.prefilter.sigma)


def sampled(ref: Reference, among: Mask, count: int) -> I64:
    """Take some of the points `among` (N,) bool that have all their pixels, `count` at most."""
    whole = np.flatnonzero(among & (ref.light[:, 2] == ref.subset**2))
    if len(whole) <= count:
        return whole
    return whole[np.arange(count) * (len(whole) - 1) // (count - 1)]


@njit(cache=True, nogil=True, error_model="numpy")
def _step_all(sums: F64, base: F64, known: Known, state: State) -> None:
    """Step every point from the sums of `dic.correlation.frame_moments`."""
    motion, size = state[0], known[0].shape[1]
    p = motion.shape[2]
    towards, total = np.empty(size), np.empty(size)
    dense, aside = np.empty(size), np.empty(size)
    for n in range(sums.shape[0]):
        s = sums[n]
        fg, g, fq, q, gg, gq, qq = s[4 * p : 4 * p + 7]
        gain = _gain(n, fg, g, gg, known, state)
        if gain == 0.0:
            continue
        for k in range(2 * p):
            dense[k] = -s[2 * p + k]
            towards[k] = s[k] / gain + dense[k]
        dense[2 * p], dense[2 * p + 1] = fq, q
        towards[2 * p], towards[2 * p + 1] = fq - fg / gain, q - g / gain
        _solve_normal(n, towards, gg / gain**2 - 2 * gq / gain + qq, known, state, total)
        _solve(n, dense, known, aside)
        for k in range(2 * p):
            total[k] -= aside[k]
            aside[k] -= motion[n, k // p, k % p]
        aside[0] += base[0]
        aside[p] += base[1]
        _move(n, total, aside, known, state)


@njit(cache=True, nogil=True, error_model="numpy")
def _iterate(
    subsets: F32,
    image: Image,
    xy: F64,
    here: I64,
    known: Known,
    state: State,
    blocks: Blocks,
    tools: Tools,
) -> None:
    motion, change, zncc, half, still = state[0], state[1], state[2], known[2], state[5]
    size, (frame, filtered), (seen, of_blocks, count) = known[0].shape[1], image, blocks
    towards, total, aside = np.empty(size), np.empty(size), np.zeros(size)
    sums, r = np.empty((2, count, count)), np.empty(subsets.shape[2], np.float32)
    for m in range(here.shape[0]):
        n, pixels = here[m], subsets[m]
        lay_out(pixels, xy[n], tools)
        tools[9][:], gain = NOWHERE, 0.0
        for tries in range(_ITERATIONS):
            if tries % _TRIAL == 0 and tries <= 2 * _TRIAL and zncc[n] < _LIKE * tries / _TRIAL:
                break
            done = warp(frame, filtered, xy[n], motion[n], half, tools)
            if done == LOST:
                change[n], zncc[n] = np.nan, 0.0
                break
            gg = correlate_with(pixels, tools, towards)
            gain = _gain(n, float(-towards[size - 2]), float(-towards[size - 1]), gg, known, state)
            if gain == 0.0:
                break
            for k in range(size):
                towards[k] /= gain
            _solve_normal(n, towards, gg / gain**2, known, state, total)
            _set_aside(motion[n], done == SHIFTED, aside)
            _move(n, total, aside, known, state)
            if still[n]:
                break
        if still[n] and seen[n] and gain > 0.0:
            squares = subtract_fit(pixels, total, gain, tools, r)
            variance = squares / max(known[1][n, 2] - size, 1.0)
            sum_blocks(pixels, r, 2 * half + 1, variance, sums, of_blocks[n])


@njit(cache=True, nogil=True)
def _set_aside(c: F64, shifted: bool, aside: F64) -> None:
    """Take off all of the motion but the shift, if the subset was warped by its shift alone."""
    for a in range(2):
        for k in range(1, c.shape[1]):
            aside[a * c.shape[1] + k] = -c[a, k] if shifted else 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def _gain(n: int, fg: float, g: float, gg: float, known: Known, state: State) -> float:
    """Write the ZNCC of a point and return the gain of its light; 0 where there is no contrast."""
    light, (_, change, zncc, residual, iterations, still) = known[1], state
    iterations[n] += not still[n]
    pixels = max(light[n, 2], 1.0)
    var_f = light[n, 0] - light[n, 1] ** 2 / pixels
    var_g = gg - g**2 / pixels
    if var_f <= 0 or var_g <= 1e-9 * gg:
        change[n], zncc[n], residual[n], still[n] = 0.0, 0.0, 0.0, True
        return 0.0
    zncc[n] = (fg - light[n, 1] * g / pixels) / np.sqrt(var_f * var_g)
    # The gain only scales the step: the ratio of contrasts is good enough, and never negative.
    return np.sqrt(var_g / var_f)


@njit(cache=True, nogil=True, error_model="numpy")
def _solve_normal(
    n: int, towards: F64, squares: float, known: Known, state: State, total: F64
) -> None:
    """Solve the normal equations of a point into `total` (K,), and write what they leave over."""
    light = known[1]
    _solve(n, towards, known, total)
    for i in range(towards.shape[0]):
        squares += towards[i] * total[i]
    state[3][n] = squares / max(light[n, 2] - towards.shape[0], 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _solve(n: int, towards: F64, known: Known, total: F64) -> None:
    inverse = known[0]
    for i in range(towards.shape[0]):
        total[i] = 0.0
        for k in range(towards.shape[0]):
            total[i] -= inverse[n, i, k] * towards[k]


@njit(cache=True, nogil=True, error_model="numpy")
def _move(n: int, step: F64, aside: F64, known: Known, state: State) -> None:
    """Move a point by the `step` of its shape function, and by what the warp was `aside` of it.

    The step was measured with ∇f in place of the gradient of the frame, so it is that of the
    inverse composition: the deformation gradient F = 1 + ∇U turns it into the additive one, and
    Newton's convergence is kept at large strain and rotation.
    """
    half, c, change, still = known[2], state[0][n], state[1], state[5]
    p = c.shape[1]
    reach = np.sqrt((step[0] + aside[0]) ** 2 + (step[p] + aside[p]) ** 2)
    brake = STRIDE / reach if reach > STRIDE else 1.0
    f11, f12, f21, f22 = 1 + c[0, 1], c[0, 2], c[1, 1], 1 + c[1, 2]
    moved, size = 0.0, 1.0
    for k in range(p):
        if k == 1 or k == 3:
            size *= half
        step_u = brake * (f11 * step[k] + f12 * step[p + k] + aside[k])
        step_v = brake * (f21 * step[k] + f22 * step[p + k] + aside[p + k])
        c[0, k] += step_u
        c[1, k] += step_v
        moved = max(moved, max(abs(step_u), abs(step_v)) * size)
    # Where the steps shrink in proportion, the next one would be moved²/change.
    still[n] = moved < STILL or moved * moved < STILL * change[n]
    change[n] = moved
