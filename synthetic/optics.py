"""What a lens and an exposure time do to an image: blur, and dark corners."""

from dataclasses import dataclass

import numpy as np
from scipy.special import j1

from synthetic.arrays import F64, AnyArray

# The light beyond the reach of the blur fades out over this many pixels.
_FADE_PX = 8


@dataclass(frozen=True)
class Optics:
    """Blur of a point into a spot, and loss of light towards the corners.

    Attributes
    ----------
    gaussian : standard deviation of a soft lens, px.
    disc : diameter of the disc that an unfocused point becomes, px.
    streak : (x, y) by which the image moves at even speed while it is exposed, px.
    vignetting : fraction of the light that the corners lose; the loss grows as the square of the
        distance from the middle of the image.

    Raises
    ------
    ValueError
        A width that is negative or not finite, or a fraction outside 0 to 1.
    """

    gaussian: float = 0.0
    disc: float = 0.0
    streak: tuple[float, float] = (0.0, 0.0)
    vignetting: float = 0.0

    def __post_init__(self):
        for name, width in (("gaussian", self.gaussian), ("disc", self.disc)):
            if not 0 <= width < np.inf:
                raise ValueError(f"{name} of the blur must be at least 0, got {width} px")
        if not np.isfinite(self.streak).all():
            raise ValueError(f"streak of the blur must be finite, got {self.streak} px")
        if not 0 <= self.vignetting <= 1:
            raise ValueError(f"vignetting must lie in 0 to 1, got {self.vignetting} of the light")

    @property
    def reach(self) -> int:
        """Pixels beyond the image whose light is blurred into it; 0 without blur."""
        far = 5 * self.gaussian + self.disc / 2 + np.hypot(*self.streak) / 2
        return int(np.ceil(far)) + _FADE_PX if far > 0 else 0

    def blur(self, fine: F64, oversample: int) -> F64:
        """Blur light that is known at `oversample` places a pixel in each direction.

        Blur and the mean over the square of a pixel multiply its spectrum. What is neglected is
        the spectrum beyond `oversample`/2 periods a pixel.

        Parameters
        ----------
        fine : (H, W) float64, light at points, with `reach` pixels more on each side than are
            wanted.

        Returns
        -------
        (H, W) float64, means over pixels; within `reach` of its sides it is not to be used.
        """
        rows, columns = (_fade(length, _FADE_PX * oversample) for length in fine.shape)
        # 1 is the bare ground, so that what is beyond the sides is 0.
        spectrum = np.fft.rfft2((fine - 1) * rows[:, None] * columns)
        fy = np.fft.fftfreq(fine.shape[0], 1 / oversample)[:, None]
        fx = np.fft.rfftfreq(fine.shape[1], 1 / oversample)
        return 1 + np.fft.irfft2(spectrum * self._transfer(fx, fy), fine.shape)

    def _transfer(self, fx: AnyArray, fy: AnyArray) -> F64:
        """Spectrum at fx, fy periods per px of the spot that a point makes on square pixels."""
        pixel = np.sinc(fx) * np.sinc(fy)
        soft = np.exp(-2 * (np.pi * self.gaussian * fy) ** 2)
        spot = pixel * soft * np.exp(-2 * (np.pi * self.gaussian * fx) ** 2)
        if self.disc > 0:
            a = np.maximum(np.pi * self.disc * np.hypot(fx, fy), 1e-6)
            spot *= 2 * j1(a) / a
        if any(self.streak):
            spot *= np.sinc(self.streak[0] * fx + self.streak[1] * fy)
        return spot

    def falloff(self, size: tuple[int, int]) -> F64:
        """Fraction of the light that is left in each pixel of an image (width, height): (H, W)."""
        x, y = (np.linspace(-1, 1, length) ** 2 / 2 for length in size)
        return 1 - self.vignetting * (y[:, None] + x)


def _fade(length: int, over: int) -> F64:
    """Ones that fall to zero over the first and the last `over` of `length` values."""
    from_end = np.minimum(np.arange(length), np.arange(length)[::-1])
    return np.sin(np.pi / 2 * np.minimum((from_end + 0.5) / over, 1)) ** 2
