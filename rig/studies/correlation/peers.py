"""Other codes on the same images."""

import tempfile
import time
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from rig.system.arrays import F64, AnyArray

EDGE = 12  # px, border that al-dic is asked to leave out


@dataclass(frozen=True)
class Peer:
    """What another code found of an image, and how long it took.

    Attributes
    ----------
    seconds : float
        CPU time of a frame, median.
    xy, moved : (N, 2) float64, px
        Points and their motion.
    """

    seconds: float
    xy: F64
    moved: F64


def pyvale_field(first: AnyArray, second: AnyArray, order: int, repeats: int = 3) -> Peer | None:
    """Correlate the full field with pyvale, one thread, subset 21, step 5, as it comes.

    None where it is not installed.
    """
    try:
        peer: Any = import_module("pyvale.dic")
    except ImportError:
        return None
    times: list[float] = []
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
    return Peer(float(np.median(times)), table[:, :2], table[:, 2:])


def al_dic_field(first: AnyArray, second: AnyArray) -> Peer | None:
    """Correlate with al-dic without its global step, subset 20, step 4, as it comes.

    None where it is not installed.
    """
    try:
        peer: Any = import_module("al_dic")
        structures: Any = import_module("al_dic.core.data_structures")
    except ImportError:
        return None
    height, width = first.shape
    options = peer.dicpara_default(
        winsize=20,
        winstepsize=4,  # a power of 2
        winsize_min=4,
        use_global_step=False,
        img_size=first.shape,
        gridxy_roi_range=structures.GridxyROIRange(
            (EDGE, width - 1 - EDGE), (EDGE, height - 1 - EDGE)
        ),
    )
    pair, masks = [first / 255.0, second / 255.0], [np.ones(first.shape)] * 2
    peer.run_aldic(options, pair, masks, compute_strain=False)  # compiles
    start = time.process_time()
    result = peer.run_aldic(options, pair, masks, compute_strain=False)
    spent = time.process_time() - start
    return Peer(spent, result.dic_mesh.coordinates_fem, result.result_disp[0].U.reshape(-1, 2))


def pyramid(first: AnyArray, second: AnyArray, places: F64, window: int = 31) -> F64:
    """Motion (N, 2) px by the pyramid of Lucas and Kanade in OpenCV."""
    start = places.astype(np.float32)
    size = window, window
    moved, _, _ = cv2.calcOpticalFlowPyrLK(first, second, start, start.copy(), winSize=size)
    return np.asarray(moved - start, dtype=np.float64)
