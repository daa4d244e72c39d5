"""Rendering: pictures of a dented plate, exact by samples a pixel, warped, and in a batch.

Parts: pictures. CPU times of one thread a picture of 1024²; the error is what least squares on
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


def pictures() -> Iterator[Figure]:
    """Compare every way to make the picture with many samples a pixel."""
    torch.set_num_threads(1)
    displacement = DISPLACEMENTS[NAME]
    fine = exact(displacement, 8)
    for samples in (2, 3, 4, 5):
        name = f"exact, {samples} × {samples} samples" + (" (default)" if samples == 4 else "")
        yield from told(name, partial(exact, displacement, samples), fine)
    warper = synthetic.prepare_warp(PATTERN, CAMERA, TOP)
    motion = displacement(warper.points)
    yield from told("warped one by one", lambda: warper.render(motion, None, None), fine)
    batch = synthetic.prepare_batch(warper)
    fields = torch.as_tensor(np.stack([warper.forward(motion)] * BATCH)).float()

    def together() -> np.ndarray:
        with torch.no_grad():
            return batch.render(fields)[0, 0].numpy()

    yield from told("batch on torch, CPU", together, fine, BATCH)


def told(
    name: str, make: Callable[[], np.ndarray], fine: np.ndarray, count: int = 1
) -> Iterator[Figure]:
    """Time and errors of one way."""
    levels, worst, mean = sizes(fine, make() - fine)
    return line(
        TABLE,
        name,
        time=(f"{cpu_seconds(make, 3) / count:.4f}", "s"),
        error=(f"{1e3 * worst:.2g}", "mpx, worst tile"),
        mean_error=(f"{1e3 * mean:.1g}", "mpx"),
        scatter=(f"{levels:.3f}", "of 255 levels"),
    )


PARTS = {"pictures": pictures}

if __name__ == "__main__":
    run(PARTS, __doc__)
