"""A GPU against one core in the same run: a full field, and rendered images.

Parts: field, images. Times are those of a clock, with nothing else on the machine. Without a
GPU each part ends in one sentence.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

import dic
import synthetic
from rig.report.figure import Figure, at_least
from rig.studies.correlation.images import displacement, eight_bit, speckle
from rig.studies.study import line, rms, run

TABLE = "A GPU beside one core"
SHIFT, STRETCH, NOISE, SUBSET = (0.4, -0.3), (1.004, 0.998), 2.0, 21
REPEATS = 5


class Size(NamedTuple):
    """Side of an image and step of its points, px."""

    side: int
    step: int


SIZES = Size(512, 5), Size(1024, 5), Size(1024, 2)
BARRED = SIZES[1]
RENDERED, BATCH = 1024, 32  # px, and images of a batch


def field() -> Iterator[Figure]:
    """Points and frames a second of a full field, from the last frame's."""
    _require_gpu()
    for size in SIZES:
        rng = np.random.default_rng(0)
        before = eight_bit(speckle(size.side), NOISE, rng)
        after = eight_bit(speckle(size.side, SHIFT, STRETCH), NOISE, rng)
        seconds: dict[str | None, float] = {}
        for device in (None, "cuda"):
            ref = dic.prepare(before, SUBSET, size.step, device=device)
            found = dic.correlate(ref, after)
            seconds[device] = clock(partial(dic.correlate, ref, after, found))
            truth = displacement(size.side, found.xy, SHIFT, STRETCH)
            off = np.column_stack([found.u, found.v]) - truth
            yield from line(
                TABLE,
                f"full field, {size.side}², step {size.step}, {device or 'one core'}",
                rate=(len(found.u) / seconds[device] / 1e6, "million points/s"),
                frames=(1 / seconds[device], "frames/s"),
                error=(1e3 * rms(off[found.valid]), "mpx, rms", None, int(found.valid.sum())),
            )
        if size == BARRED:
            rate = len(found.u) / seconds["cuda"] / 1e6
            yield from line(
                TABLE, "full field on a GPU", rate=(rate, "million points/s", at_least(5))
            )
            over = seconds[None] / seconds["cuda"]
            yield from line(
                TABLE, "full field on a GPU over one core", ratio=(over, "", at_least(50))
            )


def images() -> Iterator[Figure]:
    """Images a second of the batch renderer."""
    _require_gpu()
    import torch

    torch.set_num_threads(1)
    plate = (256.0, 256.0)
    camera = synthetic.pinhole_above(plate, 500.0, (RENDERED, RENDERED))
    warper = synthetic.prepare_warp(synthetic.speckle(plate), camera, 0.0)
    motion = warper.forward(np.zeros((len(warper.points), 3)))

    def render(batch: synthetic.BatchWarper, fields: torch.Tensor) -> None:
        with torch.no_grad():
            batch.render(fields)[0, 0, 0, 0].item()

    for device, many in (("cpu", 4), ("cuda", BATCH)):
        batch = synthetic.prepare_batch(warper, device)
        fields = torch.as_tensor(np.stack([motion] * many), device=device).float()
        seconds = clock(partial(render, batch, fields))
        yield from line(
            TABLE,
            f"images of {RENDERED}², {'one core' if device == 'cpu' else device}",
            frames=(many / seconds, "frames/s"),
        )


def clock(work: Callable[[], object]) -> float:
    """Median time of some runs after a first, s."""
    work()
    taken: list[float] = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work()
        taken.append(time.perf_counter() - began)
    return float(np.median(taken))


def _require_gpu() -> None:
    import torch

    if not torch.cuda.is_available():
        sys.exit("torch finds no GPU on this machine; run this study on one that has a GPU")


PARTS = {"field": field, "images": images}

if __name__ == "__main__":
    run(PARTS, __doc__)
