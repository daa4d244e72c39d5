"""An image shifted by its Fourier series, which is exact for what the camera resolves."""

from __future__ import annotations

import numpy as np

from dic.arrays import F64, AnyArray

FADE = 24
"""Pixels at the border that fade to the mean grey level, so that a shifted image does not ring."""


def shifted(image: AnyArray, shift: tuple[float, float]) -> F64:
    """Shift an image (H, W) along x and y by parts of a pixel; its border fades, see `FADE`."""
    mean = float(np.mean(image, dtype=np.float64))
    spectrum = np.fft.rfft2(faded(image - mean))
    along_x, along_y = np.fft.rfftfreq(image.shape[1]), np.fft.fftfreq(image.shape[0])[:, None]
    turn = np.exp(-2j * np.pi * (shift[0] * along_x + shift[1] * along_y))
    return mean + np.asarray(np.fft.irfft2(spectrum * turn, s=image.shape), dtype=np.float64)


def faded(grey: AnyArray) -> F64:
    """Let an image (H, W) of mean zero fade out at its border."""
    for axis in (0, 1):
        count = grey.shape[axis]
        away = np.minimum(np.arange(count), np.arange(count)[::-1])
        fade = np.sin(np.pi / 2 * np.minimum((away + 0.5) / FADE, 1)) ** 2
        grey = grey * np.expand_dims(fade, 1 - axis)
    return np.asarray(grey, dtype=np.float64)
