"""How noisy a still camera is: what the bench can hope for before anything is touched."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from rig.camera.camera import Camera

FRAMES = 30
PATIENCE = 2.0  # s for a frame
SATURATED = 250  # grey levels: brighter than this may be cut off
DARK = 5


@dataclass(frozen=True)
class Noise:
    """Figures of a series of pictures of a scene that does not move.

    Attributes
    ----------
    frames, dropped : int
    rate : float, frames a second
    mean : float, grey levels
    sigma : float, grey levels
        Standard deviation of a pixel over time, without what all pixels do together.
    flicker : float
        Standard deviation of the mean brightness over its mean: light or exposure that changes.
    contrast : float, grey levels
        Standard deviation over the mean picture: that of the speckle.
    clipped : float
        Share of the pixels that are too bright or too dark to say anything.
    age : float, s
        Median age of a frame when it was given.
    """

    frames: int
    dropped: int
    rate: float
    mean: float
    sigma: float
    flicker: float
    contrast: float
    clipped: float
    age: float


def measure_noise(camera: Camera, frames: int = FRAMES) -> Noise:
    """Grab frames of a still scene and say how they differ.

    The sums are kept and not the pictures, so that any number of frames fits into memory.

    Raises
    ------
    OSError
        If the camera gives no frame for two seconds.
    ValueError
        If fewer than two frames are asked for.
    """
    if frames < 2:
        raise ValueError(f"noise needs 2 frames or more, got {frames}; take {FRAMES}")
    first = np.zeros(0)
    total = squares = np.zeros(0)
    levels, ages, times = [], [], []
    for index in range(frames):
        frame = camera.grab(PATIENCE)
        if frame is None:
            raise OSError(f"{camera.status}; no picture came for {PATIENCE:g} s")
        ages.append(time.monotonic() - frame.captured)
        times.append(frame.captured)
        levels.append(float(frame.image.mean()))
        image = frame.image.astype(np.float64) - levels[-1]
        if index == 0:
            first, total, squares = image, np.zeros_like(image), np.zeros_like(image)
        image = image - first  # small numbers: the squares of large ones would lose the noise
        total += image
        squares += image * image
    mean = first + total / frames + np.mean(levels)
    variance = (squares - total * total / frames) / (frames - 1)
    return Noise(
        frames=frames,
        dropped=camera.dropped,
        rate=(frames - 1) / (times[-1] - times[0]),
        mean=float(np.mean(levels)),
        sigma=float(np.sqrt(variance.mean())),
        flicker=float(np.std(levels, ddof=1) / max(np.mean(levels), 1e-9)),
        contrast=float(mean.std()),
        clipped=float(np.mean((mean > SATURATED) | (mean < DARK))),
        age=float(np.median(ages)),
    )
