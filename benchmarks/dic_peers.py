"""Other codes on the same pictures."""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np


@dataclass(frozen=True)
class Peer:
    """CPU time of a frame, median and spread, s, and mean displacement found, px."""

    timing: tuple[float, float]
    mean: tuple[float, float]


def pyvale_field(first, second, order, repeats=3):
    """Correlate the full field with pyvale, one thread, subset 21, step 5, as it comes; or None."""
    try:
        import pyvale.dic as peer
    except ImportError:
        return None
    times = []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(repeats):
            start = time.process_time()
            peer.calculate_2d(
                first,
                second,
                np.ones(first.shape, dtype=bool),
                [first.shape[1] // 2, first.shape[0] // 2],
                subset_size=21,
                subset_step=5,
                shape_function="AFFINE" if order == 1 else "QUAD",
                num_threads=1,
                output_basepath=folder,
                print_level=0,
            )
            times.append(time.process_time() - start)
        (result,) = Path(folder).glob("*.csv")
        table = np.genfromtxt(result, delimiter=",", skip_header=1, usecols=(2, 3))
    return Peer((np.median(times), np.ptp(times)), tuple(np.nanmean(table, axis=0)))


def pyramid(first, second, places):
    """Motion (N, 2) px by the pyramid of Lucas and Kanade in OpenCV, window 31."""
    start = places.astype(np.float32)
    moved, _, _ = cv2.calcOpticalFlowPyrLK(first, second, start, None, winSize=(31, 31))
    return moved - start
