"""How noisy a still camera is: what the bench can hope for before anything is touched."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from rig.camera.camera import LiveCamera
from rig.system.arrays import F64

FRAMES = 30
PATIENCE = 2.0  # s for a frame
SATURATED = 250  # grey levels: brighter than this may be cut off
DARK = 5


@dataclass(frozen=True)
class CameraNoise:
    """Figures of a series of images of a scene that does not move.

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
        Standard deviation over the mean image: that of the speckle.
    clipped : float
        Fraction of the pixels that are too bright or too dark to say anything.
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


def measure_noise(camera: LiveCamera, frames: int = FRAMES) -> CameraNoise:
    """Grab frames of a still scene and say how they differ.

    Mean and squares run along with the frames (Welford, Technometrics 4, 1962), so that any number
    of them fits into memory.

    Raises
    ------
    OSError
        If the camera gives no frame for two seconds.
    ValueError
        If fewer than two frames are asked for.
    """
    if frames < 2:
        raise ValueError(f"noise needs 2 frames or more, got {frames}; take {FRAMES}")
    mean: F64 = np.zeros(())
    squares: F64 = np.zeros(())
    levels: list[float] = []
    ages: list[float] = []
    times: list[float] = []
    for count in range(1, frames + 1):
        frame = camera.grab(PATIENCE)
        if frame is None:
            raise OSError(f"{camera.status}; no image came for {PATIENCE:g} s")
        ages.append(time.monotonic() - frame.captured)
        times.append(frame.captured)
        levels.append(float(frame.image.mean()))
        image = frame.image.astype(np.float64) - levels[-1]
        change = image - mean
        mean = mean + change / count
        squares = squares + change * (image - mean)
    brightness = mean + sum(levels) / frames
    return CameraNoise(
        frames=frames,
        dropped=camera.dropped,
        rate=(frames - 1) / (times[-1] - times[0]),
        mean=float(np.mean(levels)),
        sigma=float(np.sqrt(squares.mean() / (frames - 1))),
        flicker=float(np.std(levels, ddof=1) / max(np.mean(levels), 1e-9)),
        contrast=float(brightness.std()),
        clipped=float(np.mean((brightness > SATURATED) | (brightness < DARK))),
        age=float(np.median(ages)),
    )
