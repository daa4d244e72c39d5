"""Patterns as a printer makes them, moved by exact fields: dots and noise, hard and soft edges.

Each pixel is the mean of many samples of the ink, and each sample is taken where the material
lay before it moved: no image is ever warped or interpolated.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from dic.compiled import njit
from rig.system.arrays import F32, F64

SAMPLES = 6  # along each side of a pixel
DARK, BRIGHT = 40.0, 215.0  # grey levels of ink and paper
COVER = 0.5  # fraction of the paper under dots
DIAMETERS = (1.5, 2.2, 3.5, 6.0)  # px
EDGES = {"hard": 0.02, "soft": 0.25}  # width of an edge over the diameter of a spot
_ROWS = 24  # px drawn at a time
_NEAR = 3.5  # widths of an edge, or of a spot of noise, from which nothing is left

Field: TypeAlias = tuple[float, float, float, float]
"""Shear; height of a bump, px; its half width and height, px."""

STILL: Field = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True)
class Print:
    """A printed pattern.

    Attributes
    ----------
    kind : {"dots", "noise"}
        Discs laid at random, or a random field cut at one level.
    diameter : float, px
        Of a disc; of noise the width at which it is half correlated.
    edge : float, px
        Standard deviation of the blur of an edge.
    """

    kind: Literal["dots", "noise"]
    diameter: float
    edge: float
    seed: int = 0

    @property
    def name(self) -> str:
        """Kind, size and edge in words."""
        hard = self.edge < 0.1 * self.diameter
        return f"{self.kind} of {self.diameter:g} px, {'hard' if hard else 'soft'}"


def prints() -> Iterator[Print]:
    """List the sixteen patterns of the study."""
    for kind in ("dots", "noise"):
        for diameter in DIAMETERS:
            for width in EDGES.values():
                yield Print(kind, diameter, width * diameter)


def draw(pattern: Print, shape: tuple[int, int], field: Field = STILL) -> F64:
    """Draw a pattern that a field has moved, (H, W) float64, grey levels.

    Parameters
    ----------
    shape : (H, W), px
    field : tuple
        As `motion` takes it.
    """
    centres, heights = _spots(pattern, shape)
    radius, soft = pattern.diameter / 2, pattern.edge
    ink = np.empty(shape)
    middle = (shape[1] - 1) / 2, (shape[0] - 1) / 2
    for top in range(0, shape[0], _ROWS):
        size = min(_ROWS, shape[0] - top) * SAMPLES, shape[1] * SAMPLES
        back = np.empty((2, *size), np.float32)
        _trace(top, middle, field, back)
        band = np.full(size, np.inf if pattern.kind == "dots" else 0.0, np.float32)
        if pattern.kind == "dots":
            _near_dots(centres, radius + _NEAR * soft, top, middle, field, back, band)
            _ink_dots(band, radius, soft)
        else:
            _add_noise(centres, heights, radius, top, middle, field, back, band)
            _cut(band, soft / radius * math.sqrt(2))
        cells = band.reshape(-1, SAMPLES, shape[1], SAMPLES)
        ink[top : top + len(cells)] = cells.mean(axis=(1, 3), dtype=np.float64)
    return BRIGHT + (DARK - BRIGHT) * ink


def motion(shape: tuple[int, int], xy: F64, field: Field) -> F64:
    """Displacement (N, 2) px of points of the reference: shear, and a bump as a camera sees it.

    u = γ y + x b, v = y b with b = B ((1 - (x/a)²)(1 - (y/c)²))² inside the clamped edges, x and y
    from the middle: what a pinhole sees of a clamped plate that is pressed.
    """
    middle = np.array(shape[::-1]) / 2 - 0.5
    return np.array([_move(x, y, field) for x, y in xy - middle])


def _spots(pattern: Print, shape: tuple[int, int]) -> tuple[F64, F64]:
    """Centres (N, 2) px from the middle of the image, and heights (N,) of noise."""
    rng = np.random.default_rng(pattern.seed)
    size = np.array(shape[::-1]) * 1.1 + 60
    radius = pattern.diameter / 2
    if pattern.kind == "dots":
        density = -math.log(1 - COVER) / (math.pi * radius**2)
    else:
        density = 3 / radius**2
    count = int(density * size.prod())
    heights = rng.choice([-1.0, 1.0], count) / math.sqrt(density * math.pi * radius**2)
    return rng.uniform(-0.5, 0.5, (count, 2)) * size, heights


@njit(cache=True, nogil=True)
def _move(x: float, y: float, field: Field) -> tuple[float, float]:
    shear, height, half_x, half_y = field
    p, q = 1 - (x / half_x) ** 2, 1 - (y / half_y) ** 2
    bump = height * (p * q) ** 2 if p > 0 and q > 0 else 0.0
    return shear * y + x * bump, y * bump


@njit(cache=True, nogil=True)
def _before(x: float, y: float, field: Field) -> tuple[float, float]:
    """Place from which the material at (x, y) came."""
    u, v = 0.0, 0.0
    for _ in range(5):  # each leaves a hundredth of the error of the one before
        u, v = _move(x - u, y - v, field)
    return x - u, y - v


@njit(cache=True, nogil=True)
def _span(middle: float, reach: float, count: int) -> tuple[int, int]:
    """First sample of a line, and that behind its last, within `reach` px of a place."""
    first = math.ceil((middle - reach + 0.5) * SAMPLES - 0.5)
    last = math.floor((middle + reach + 0.5) * SAMPLES - 0.5)
    return max(first, 0), min(last + 1, count)


@njit(cache=True, nogil=True)
def _trace(top: int, middle: tuple[float, float], field: Field, back: F32) -> None:
    """Write by how much the material at each sample has moved, (2, rows, columns), px."""
    for j in range(back.shape[1]):
        y = (j + 0.5) / SAMPLES - 0.5 + top - middle[1]
        for i in range(back.shape[2]):
            x = (i + 0.5) / SAMPLES - 0.5 - middle[0]
            here_x, here_y = _before(x, y, field)
            back[0, j, i], back[1, j, i] = x - here_x, y - here_y


@njit(cache=True, nogil=True, fastmath=True)
def _apart(across: float, down: float, back: F32, j: int, out: F32) -> None:
    """Square of the distance (n,) px² of a spot from where samples of a row lay.

    The spot is `across` and `down` px from the first of them; `back` (2, rows, n) is how they
    moved.
    """
    u, v = back[0, j], back[1, j]
    first, height, step = np.float32(-across), np.float32(-down), np.float32(1 / SAMPLES)
    for i in range(out.shape[0]):
        x, y = first + step * np.float32(i) - u[i], height - v[i]
        out[i] = x * x + y * y


@njit(cache=True, nogil=True)
def _window(
    x: float,
    y: float,
    reach: float,
    top: int,
    middle: tuple[float, float],
    field: Field,
    band: F32,
) -> tuple[int, int, int, int]:
    """Columns and rows of the samples that a spot may reach, the last ones excluded."""
    u, v = _move(x, y, field)
    left, right = _span(x + u + middle[0], 1.05 * reach + 0.1, band.shape[1])
    first, last = _span(y + v + middle[1] - top, 1.05 * reach + 0.1, band.shape[0])
    return left, right, first, last


@njit(cache=True, nogil=True, fastmath=True)
def _near_dots(
    centres: F64,
    reach: float,
    top: int,
    middle: tuple[float, float],
    field: Field,
    back: F32,
    band: F32,
) -> None:
    """Write the square of the distance of each sample from the nearest dot, px²."""
    apart = np.empty(band.shape[1], np.float32)
    for n in range(centres.shape[0]):
        x, y = centres[n]
        left, right, first, last = _window(x, y, reach, top, middle, field, band)
        if left >= right:
            continue
        across = x + middle[0] - ((left + 0.5) / SAMPLES - 0.5)
        row = apart[: right - left]
        for j in range(first, last):
            down = y + middle[1] - top - ((j + 0.5) / SAMPLES - 0.5)
            _apart(across, down, back[:, :, left:right], j, row)
            into = band[j, left:right]
            for i in range(row.shape[0]):
                into[i] = min(into[i], row[i])


@njit(cache=True, nogil=True)
def _ink_dots(band: F32, radius: float, edge: float) -> None:
    """Turn squares of distances into ink: dots lie over one another, the darkest one is seen."""
    limit = np.float32((radius + _NEAR * edge) ** 2)
    for j in range(band.shape[0]):
        for i in range(band.shape[1]):
            if band[j, i] < limit:
                away = math.sqrt(band[j, i]) - radius
                band[j, i] = 0.5 * math.erfc(away / (math.sqrt(2) * edge))
            else:
                band[j, i] = 0.0


@njit(cache=True, nogil=True, fastmath=True)
def _add_noise(
    centres: F64,
    heights: F64,
    width: float,
    top: int,
    middle: tuple[float, float],
    field: Field,
    back: F32,
    band: F32,
) -> None:
    """Add Gaussian spots to a random field of variance 1/2."""
    apart, scale = np.empty(band.shape[1], np.float32), np.float32(1 / width**2)
    for n in range(centres.shape[0]):
        x, y = centres[n]
        left, right, first, last = _window(x, y, _NEAR * width, top, middle, field, band)
        if left >= right:
            continue
        across, height = x + middle[0] - ((left + 0.5) / SAMPLES - 0.5), np.float32(heights[n])
        row = apart[: right - left]
        for j in range(first, last):
            down = y + middle[1] - top - ((j + 0.5) / SAMPLES - 0.5)
            _apart(across, down, back[:, :, left:right], j, row)
            into = band[j, left:right]
            for i in range(row.shape[0]):
                into[i] += height * _bell(scale * row[i])


@njit(cache=True, nogil=True, fastmath=True, inline="always")
def _bell(square: np.float32) -> np.float32:
    """exp(-square), 0 beyond `_NEAR` squared: the 16th power of a series, which runs on vectors."""
    far = np.float32(_NEAR**2)
    s = min(square, far) * np.float32(-1 / 16)
    one = np.float32(1)
    p = one + s * np.float32(1 / 7)
    p = one + s * np.float32(1 / 6) * p
    p = one + s * np.float32(1 / 5) * p
    p = one + s * np.float32(1 / 4) * p
    p = one + s * np.float32(1 / 3) * p
    p = one + s * np.float32(1 / 2) * p
    p = one + s * p
    p *= p
    p *= p
    p *= p
    p *= p
    return p if square < far else np.float32(0)


@njit(cache=True, nogil=True)
def _cut(band: F32, softness: float) -> None:
    """Turn a random field into ink: at one level, over `softness` of its values."""
    for j in range(band.shape[0]):
        for i in range(band.shape[1]):
            band[j, i] = 0.5 * math.erfc(-band[j, i] / softness)
