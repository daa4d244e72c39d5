"""Other codes on the same pictures."""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

EDGE = 12  # px, border that al-dic is asked to leave out


@dataclass(frozen=True)
class Peer:
    """CPU time of a frame, median and spread, s; points (N, 2) px and their motion (N, 2) px."""

    timing: tuple[float, float]
    xy: NDArray[np.float64]
    moved: NDArray[np.float64]


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
        table = np.genfromtxt(result, delimiter=",", skip_header=1, usecols=(0, 1, 2, 3))
    return Peer((np.median(times), np.ptp(times)), table[:, :2], table[:, 2:])


def al_dic_field(first, second):
    """Correlate with al-dic without its global step, subset 20, step 4, as it comes; or None."""
    try:
        import al_dic as peer
        from al_dic.core.data_structures import GridxyROIRange
    except ImportError:
        return None
    height, width = first.shape
    options = peer.dicpara_default(
        winsize=20,
        winstepsize=4,  # a power of 2
        winsize_min=4,
        use_global_step=False,
        img_size=first.shape,
        gridxy_roi_range=GridxyROIRange((EDGE, width - 1 - EDGE), (EDGE, height - 1 - EDGE)),
    )
    pair, times = [first / 255.0, second / 255.0], []
    for _ in range(2):
        start = time.process_time()
        result = peer.run_aldic(options, pair, [np.ones(first.shape)] * 2, compute_strain=False)
        times.append(time.process_time() - start)
    moved = result.result_disp[0].U.reshape(-1, 2)
    # The first run compiles.
    return Peer((times[-1], 0.0), result.dic_mesh.coordinates_fem, moved)


def pyramid(first, second, places, window=31):
    """Motion (N, 2) px by the pyramid of Lucas and Kanade in OpenCV."""
    start = places.astype(np.float32)
    moved, _, _ = cv2.calcOpticalFlowPyrLK(first, second, start, None, winSize=(window, window))
    return moved - start
