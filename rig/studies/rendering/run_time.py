"""Rendering: images of a dented plate, exact by samples a pixel, warped, and in a batch.

Parts: images. CPU times of one thread an image of 1024²; the error is what least squares on
tiles of 21 px reads out of the difference to 8 × 8 samples a pixel.
"""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import torch

import synthetic
from rig.report.figure import Figure
from rig.studies.rendering.exactness import CAMERA, DISPLACEMENTS, PATTERN, TOP, exact, sizes
from rig.studies.study import cpu_seconds, line, run

NAME = "dent of 3 mm"
TABLE = "Rendering, 1024², dent of 3 mm"
BATCH = 4


def images() -> Iterator[Figure]:
    """Compare every way to make the image with many samples a pixel."""
    torch.set_num_threads(1)
    displacement = DISPLACEMENTS[NAME]
    fine = exact(displacement, 8)
    for samples in (2, 3, 4, 5):
        name = f"exact, {samples} × {samples} samples" + (" (default)" if samples == 4 else "")
        yield from compared(name, partial(exact, displacement, samples), fine)
    warper = synthetic.prepare_warp(PATTERN, CAMERA, TOP)
    motion = displacement(warper.points)
    yield from compared("warped one by one", lambda: warper.render(motion, None, None), fine)
    batch = synthetic.prepare_batch(warper)
    fields = torch.as_tensor(np.stack([warper.forward(motion)] * BATCH)).float()

    def together() -> np.ndarray:
        with torch.no_grad():
            return batch.render(fields)[0, 0].numpy()

    yield from compared("batch on torch, CPU", together, fine, BATCH)


def compared(
    name: str, make: Callable[[], np.ndarray], fine: np.ndarray, count: int = 1
) -> Iterator[Figure]:
    """Time and errors of one way."""
    levels, worst, mean = sizes(fine, make() - fine)
    return line(
        TABLE,
        name,
        time=(cpu_seconds(make, 3) / count, "s"),
        error=(1e3 * worst, "mpx, worst tile"),
        mean_error=(1e3 * mean, "mpx"),
        scatter=(levels, "of 255 levels"),
    )


PARTS = {"images": images}

if __name__ == "__main__":
    run(PARTS, __doc__)
