"""Pictures of a moving plate at the rate of a camera, from one sharp picture of it at rest."""

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import spline_filter

from synthetic.camera import Array, Camera
from synthetic.pattern import Pattern
from synthetic.rendering import mean_light
from synthetic.sensor import Sensor
from synthetic.view import motion

# The displacement is asked for on this spacing of pixels and is a cubic in between.
CONTROL_PX = 8
# The sharp picture is rendered this far beyond the picture, for what moves into it.
BORDER_PX = 16
# Points a side of a pixel of the sharp picture: off by 0.04 grey levels, less than the spline is.
SAMPLES = 3
# The control displacement is turned from forward to backward in this many steps. A step gains
# the slope of the displacement, 1e-2 at most for a plate that bends.
INVERSION_STEPS = 2


@dataclass(frozen=True, eq=False)
class Warper:
    """A plate at rest, ready to be seen under any small displacement.

    Attributes
    ----------
    camera, z : the camera, and the height of the watched face, mm.
    grid : (rows, cols) of the control pixels.
    points : (G, 2) float64, mm, where the caller gives the displacement: the plate points seen at
        the control pixels, row by row. Control pixels that see past the edge of the plate have the
        edge instead, and the mirror images of what they see, inside the plate, come last.
    past : (E,) int64, the control pixels past the edge.
    sharp : float32, cubic spline coefficients of the picture at rest, `oversample` a pixel.
    light : (H, W) float32, the frame in work; a warper serves one thread.
    """

    camera: Camera
    z: float
    grid: tuple[int, int]
    points: Array
    past: NDArray[np.int64]
    sharp: NDArray[np.float32] = field(repr=False)
    oversample: int
    light: NDArray[np.float32] = field(repr=False)

    def render(
        self,
        displacement: ArrayLike,
        sensor: Sensor | None,
        rng: Generator | None,
        shift: tuple[float, float] = (0.0, 0.0),
        out: NDArray | None = None,
    ) -> NDArray:
        """Take a picture of the displaced plate.

        Parameters
        ----------
        displacement : (G, 3) float64, mm, at `points`.
        sensor, rng : as in `render`.
        shift : (x, y) by which the whole picture is moved, px.
        out : (H, W) of the sensor's type, reused when given.

        Returns
        -------
        (H, W) uint8, uint16 or (without a sensor) float64, grey levels.

        Raises
        ------
        ValueError
            A displacement of wrong shape or not finite.
        """
        _sample(self.sharp, self._backward(displacement, shift), self.oversample, self.light)
        if sensor is None:
            return 255 * self.light.astype(np.float64)
        return sensor.capture(self.light, rng, out)

    def _backward(self, displacement: ArrayLike, shift: tuple[float, float]) -> NDArray[np.float32]:
        """Displacement, px, of what is seen at the control pixels: d(x) = D(x − d(x))."""
        forward = motion(self.camera, self.points, displacement, self.z)
        count = self.grid[0] * self.grid[1]
        # Past the edge the field goes on as its point reflection, with equal value and slope.
        forward[self.past] = 2 * forward[self.past] - forward[count:]
        forward = (forward[:count] + shift).reshape(*self.grid, 2).astype(np.float32)
        backward = forward
        for _ in range(INVERSION_STEPS):
            backward = _moved_back(forward, backward)
        return backward


def prepare_warp(pattern: Pattern, camera: Camera, z: float = 0.0, oversample: int = 2) -> Warper:
    """Render the plate at rest once, sharply enough to be sampled anywhere.

    The picture is the mean light over a pixel as a function of the place of the pixel, known at
    `oversample` places a pixel in each direction and a cubic spline in between. Against `render`
    it neglects that the square of a pixel is strained with the plate.

    Parameters
    ----------
    z : height of the face over the plate's middle plane, mm; half the thickness.

    Raises
    ------
    ValueError
        As `render`, and for an `oversample` below 1.
    """
    if oversample < 1:
        raise ValueError(f"oversample must be at least 1 sample a pixel, got {oversample}")
    columns, rows = (_controls(length) for length in camera.size)
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    seen = camera.on_plate(pixels, z)
    edge = np.clip(seen, 0, pattern.speckle.size)
    past = np.flatnonzero((seen != edge).any(axis=1))
    mirrored = np.clip(2 * edge[past] - seen[past], 0, pattern.speckle.size)
    return Warper(
        camera=camera,
        z=z,
        grid=(len(rows), len(columns)),
        points=np.vstack([edge, mirrored]),
        past=past,
        sharp=spline_filter(_sharp_light(pattern, camera, z, oversample)).astype(np.float32),
        oversample=oversample,
        light=np.empty(camera.size[::-1], np.float32),
    )


def _controls(length: int) -> NDArray[np.float64]:
    """Control pixels along one side, one before the picture and two at or past its end."""
    return CONTROL_PX * np.arange(-1.0, (length - 1) // CONTROL_PX + 3)


def _sharp_light(pattern: Pattern, camera: Camera, z: float, oversample: int) -> Array:
    """Mean light over a pixel, at `oversample` places a pixel, with a border on each side."""
    width, height = (length + 2 * BORDER_PX for length in camera.size)
    sharp = np.empty((height, oversample, width, oversample), np.float64)
    for i, j in product(range(oversample), repeat=2):
        offset = (j / oversample, i / oversample)
        sharp[:, i, :, j] = mean_light(pattern, camera, None, z, SAMPLES, offset, BORDER_PX)
    return sharp.reshape(height * oversample, width * oversample)


@njit(cache=True, nogil=True, fastmath=True)
def _cubic(t, weights):
    """Weights of the cubic convolution kernel (Keys 1981, a = −1/2) at fraction t."""
    half = np.float32(0.5)
    weights[0] = half * t * (t * (np.float32(2) - t) - np.float32(1))
    weights[1] = half * (t * t * (np.float32(3) * t - np.float32(5)) + np.float32(2))
    weights[2] = half * t * (t * (np.float32(4) - np.float32(3) * t) + np.float32(1))
    weights[3] = half * t * t * (t - np.float32(1))


@njit(cache=True, nogil=True, fastmath=True)
def _moved_back(forward, backward):
    """Forward field where the backward field came from, at each control point."""
    rows, columns = forward.shape[:2]
    along, down = np.empty(4, np.float32), np.empty(4, np.float32)
    moved = np.zeros_like(forward)
    for r in range(rows):
        for c in range(columns):
            x = min(max(c - backward[r, c, 0] / CONTROL_PX, 0), columns - 1)
            y = min(max(r - backward[r, c, 1] / CONTROL_PX, 0), rows - 1)
            left, top = min(int(x), columns - 2), min(int(y), rows - 2)
            _cubic(np.float32(x - left), along)
            _cubic(np.float32(y - top), down)
            for i in range(4):
                row = min(max(top + i - 1, 0), rows - 1)
                for j in range(4):
                    column = min(max(left + j - 1, 0), columns - 1)
                    weight = down[i] * along[j]
                    moved[r, c, 0] += weight * forward[row, column, 0]
                    moved[r, c, 1] += weight * forward[row, column, 1]
    return moved


@njit(cache=True, nogil=True, fastmath=True)
def _sample(sharp, backward, oversample, light):
    """Light of each pixel: the sharp picture where the pixel came from."""
    height, width = light.shape
    weights = np.empty((CONTROL_PX, 4), np.float32)
    for phase in range(CONTROL_PX):
        _cubic(np.float32(phase / CONTROL_PX), weights[phase])
    line = np.empty(backward.shape[1:], np.float32)
    x, y = np.empty(width, np.float32), np.empty(width, np.float32)
    for r in range(height):
        _row_of_controls(backward, r // CONTROL_PX, weights[r % CONTROL_PX], line)
        _sources(line, weights, r, oversample, sharp.shape, x, y)
        _sample_row(sharp, x, y, light[r])


@njit(cache=True, nogil=True, fastmath=True)
def _row_of_controls(backward, first, weights, line):
    for c in range(line.shape[0]):
        for k in range(2):
            line[c, k] = (
                weights[0] * backward[first, c, k]
                + weights[1] * backward[first + 1, c, k]
                + weights[2] * backward[first + 2, c, k]
                + weights[3] * backward[first + 3, c, k]
            )


@njit(cache=True, nogil=True, fastmath=True)
def _sources(line, weights, r, oversample, shape, x, y):
    """Places in the sharp picture, kept two samples from its rim, of the pixels of row r."""
    scale, low = np.float32(oversample), np.float32(1)
    right, bottom = np.float32(shape[1] - 3), np.float32(shape[0] - 3)
    for c in range(len(x)):
        first, phase = c // CONTROL_PX, c % CONTROL_PX
        dx, dy = np.float32(0), np.float32(0)
        for i in range(4):
            dx += weights[phase, i] * line[first + i, 0]
            dy += weights[phase, i] * line[first + i, 1]
        x[c] = min(max((np.float32(c + BORDER_PX) - dx) * scale, low), right)
        y[c] = min(max((np.float32(r + BORDER_PX) - dy) * scale, low), bottom)


@njit(cache=True, nogil=True, fastmath=True)
def _spline(t):
    """Weights of the cubic B-spline at fraction t."""
    one, sixth = np.float32(1), np.float32(1 / 6)
    s = one - t
    first, last = s * s * s * sixth, t * t * t * sixth
    third = np.float32(2 / 3) - s * s * (one - np.float32(0.5) * s)
    return first, one - first - third - last, third, last


@njit(cache=True, nogil=True, fastmath=True)
def _sample_row(sharp, x, y, light):
    for c in range(len(x)):
        left, top = np.int32(x[c]), np.int32(y[c])
        a0, a1, a2, a3 = _spline(x[c] - np.float32(left))
        d0, d1, d2, d3 = _spline(y[c] - np.float32(top))
        j = left - 1
        r0, r1, r2, r3 = sharp[top - 1], sharp[top], sharp[top + 1], sharp[top + 2]
        light[c] = (
            d0 * (a0 * r0[j] + a1 * r0[j + 1] + a2 * r0[j + 2] + a3 * r0[j + 3])
            + d1 * (a0 * r1[j] + a1 * r1[j + 1] + a2 * r1[j + 2] + a3 * r1[j + 3])
            + d2 * (a0 * r2[j] + a1 * r2[j + 1] + a2 * r2[j + 2] + a3 * r2[j + 3])
            + d3 * (a0 * r3[j] + a1 * r3[j + 1] + a2 * r3[j + 2] + a3 * r3[j + 3])
        )
