"""How long light takes from the command to the loop: the projector flashes, the camera sees it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.system.arrays import F64, AnyArray, Mask

FEWEST = 3  # flashes
DISTINCT = 6.0  # times the flicker, by which a flash is brighter


@dataclass(frozen=True)
class Latency:
    """Delay from the command to the capture of the first frame that shows it.

    Attributes
    ----------
    median, p95, sigma : float, s
        `sigma` is the standard deviation of the median.
    flashes, missed : int
        Seen and not seen.
    """

    median: float
    p95: float
    sigma: float
    flashes: int
    missed: int


def measure_latency(
    flashed: ArrayLike, captured: ArrayLike, brightness: ArrayLike, longest: float = 1.0
) -> Latency:
    """Find each flash in the brightness of the frames.

    Parameters
    ----------
    flashed : (K,) s
        When light was asked for, in order; dark between.
    captured : (N,) s
        Capture times of the frames, on the same clock.
    brightness : (N,) grey levels
        Mean of the part of each frame that the flash lights.
    longest : float, s
        Delay after which a flash counts as missed.

    Raises
    ------
    ValueError
        If fewer than three flashes are seen.
    """
    times = np.asarray(captured, dtype=np.float64)
    light = np.asarray(brightness, dtype=np.float64)
    dark, bright = np.percentile(light, [10, 99.5])
    flicker = 1.4826 * float(np.median(np.abs(light - np.median(light))))
    threshold = 0.5 * (dark + bright)
    asked = np.asarray(flashed, dtype=np.float64)
    delays = _delays(asked, times, light > threshold, longest)
    clear = bright - dark > DISTINCT * max(flicker, 0.1)
    if len(delays) < FEWEST or not clear:
        raise ValueError(
            f"the camera sees {len(delays) if clear else 0} of {len(asked)} flashes; light the"
            " plate by the projector and darken the room"
        )
    spread = float(np.std(delays, ddof=1))
    return Latency(
        median=float(np.median(delays)),
        p95=float(np.percentile(delays, 95)),
        sigma=1.2533 * spread / float(np.sqrt(len(delays))),
        flashes=len(delays),
        missed=len(asked) - len(delays),
    )


def _delays(flashed: AnyArray, captured: AnyArray, lit: Mask, longest: float) -> F64:
    rises = captured[1:][lit[1:] & ~lit[:-1]]
    found: list[float] = []
    ends = np.minimum(flashed + longest, np.append(flashed[1:], np.inf))
    for start, end in zip(flashed, ends, strict=True):
        after = rises[(rises >= start) & (rises <= end)]
        if len(after):
            found.append(after[0] - start)
    return np.array(found)
