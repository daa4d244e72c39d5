"""From light to grey levels: gain, noise and quantisation."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.random import Generator
from scipy.special import ndtri

from synthetic.arrays import F32, F64, AnyArray
from synthetic.compiled import njit


@dataclass(frozen=True)
class Sensor:
    """An image sensor with read noise and, where its electrons are counted, shot noise.

    Attributes
    ----------
    noise : standard deviation of the read noise, grey levels.
    bits : depth of a pixel, 8 to 16; images are uint8 at 8 bits and uint16 above.
    black, white : grey level of intensity 0 and 1 as fractions of full scale. The default leaves
        room for noise on both sides and gives the default speckle a spread of 50 to 56 levels.
        What is at `black` does not change with the light: spots that shall get brighter with the
        lamp take a contrast below 1 and a small `black`.
    full_well : electrons of the span from grey level 0 to the largest; the count of electrons of a
        pixel has a variance as large as itself. None for a sensor without shot noise.

    Raises
    ------
    ValueError
        Negative noise, a depth outside 8 to 16 bits, a full well that is not positive, or not
        0 ≤ black < white ≤ 1.
    """

    noise: float = 2.0
    bits: int = 8
    black: float = 0.2
    white: float = 0.72
    full_well: float | None = None

    def __post_init__(self):
        if not 0 <= self.noise < np.inf:
            raise ValueError(f"read noise must be at least 0, got {self.noise} grey levels")
        if not 8 <= self.bits <= 16:
            raise ValueError(f"pixel depth must lie in 8 to 16, got {self.bits} bits")
        if not 0 <= self.black < self.white <= 1:
            raise ValueError(
                "black and white must satisfy 0 ≤ black < white ≤ 1 of full scale, "
                f"got {self.black} and {self.white}"
            )
        if self.full_well is not None and not 0 < self.full_well < np.inf:
            raise ValueError(f"full well must be positive, got {self.full_well} electrons")

    @property
    def top(self) -> int:
        """The largest grey level."""
        return 2**self.bits - 1

    @property
    def dtype(self) -> type[np.uint8] | type[np.uint16]:
        """Type of a pixel."""
        return np.uint8 if self.bits == 8 else np.uint16

    def capture(
        self, intensity: F32 | F64, rng: Generator | None, out: AnyArray | None = None
    ) -> AnyArray:
        """Expose, add noise, round and clip.

        Parameters
        ----------
        intensity : (H, W) float, light on each pixel, 0 to 1; what is brighter may saturate.
        rng : source of the noise; None takes an image without noise.
        out : (H, W) of the sensor's type, reused when given.

        Returns
        -------
        (H, W) uint8 or uint16, grey levels.

        Notes
        -----
        A frame draws 64 bits from `rng`; splitmix64 stretches them over the pixels, and 16 bits
        choose one of 65536 equally likely normal deviates. Mean 0 and variance 1 are exact, the
        largest deviate is 4.4; that is far below what rounding to a grey level can show, and
        several times faster than a deviate by ziggurat. Shot noise is drawn as normal too, with
        the variance of the count; below some 50 electrons a count is not.
        """
        if out is None:
            out = np.empty(intensity.shape, self.dtype)
        if out.shape != intensity.shape or out.dtype != self.dtype:
            raise ValueError(
                f"out must be {intensity.shape} {self.dtype.__name__}, got {out.shape} {out.dtype}"
            )
        read = self.noise if rng is not None else 0.0
        shot = self.top / self.full_well if rng is not None and self.full_well else 0.0
        seed = rng.integers(2**64, dtype=np.uint64) if rng is not None else np.uint64(0)
        gain, offset = self.top * (self.white - self.black), self.top * self.black
        light = np.ascontiguousarray(intensity)
        line = np.array([gain, offset, self.top, read**2, shot], np.float32)
        _digitise(light.ravel(), line, _deviates(), seed, out.reshape(-1))
        return out


@cache
def _deviates() -> F32:
    """Means of 65536 equally likely slices of the normal distribution, scaled to variance 1."""
    edges = ndtri(np.linspace(0, 1, 65537))
    density = np.exp(-(edges**2) / 2)
    means = density[:-1] - density[1:]
    return (means / means.std()).astype(np.float32)


@njit(cache=True, nogil=True)
def _digitise(light: AnyArray, line: F32, deviates: F32, seed: Any, out: AnyArray) -> None:
    """`line` holds gain, offset, top, read variance and shot variance per level."""
    gain, offset, top, read, shot = line
    half = np.float32(0.5)
    for start in range(0, light.size, 4):
        word = seed + np.uint64(start + 1) * np.uint64(0x9E3779B97F4A7C15)
        word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        word ^= word >> np.uint64(31)
        for i in range(start, min(start + 4, light.size)):
            mean = gain * np.float32(light[i])
            spread = np.sqrt(read + shot * max(mean, np.float32(0)))
            level = mean + offset + half + spread * deviates[word & np.uint64(0xFFFF)]
            out[i] = np.uint16(min(max(level, np.float32(0)), top))
            word >>= np.uint64(16)
