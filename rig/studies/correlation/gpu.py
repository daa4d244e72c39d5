"""A GPU against one core in the same run: points and frames a second of a full field.

Parts: field, nets.

Times are those of a clock, with nothing else on the machine. Without a GPU it ends in one sentence.
Images drawn on a GPU are timed by `rig.studies.rendering.exactness rates`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

import dic
from models import image_net_field, net_field
from rig.report.figure import Figure, at_least
from rig.studies.correlation.images import displacement, eight_bit, speckle
from rig.studies.study import line, rms, run
from rig.system.arrays import AnyArray

TABLE = "A GPU beside one core"
SHIFT, STRETCH, NOISE, SUBSET = (0.4, -0.3), (1.004, 0.998), 2.0, 21
REPEATS = 5


class Size(NamedTuple):
    """Side of an image and step of its points, px."""

    side: int
    step: int


SIZES = Size(512, 5), Size(1024, 5), Size(1024, 2)
BARRED = SIZES[1]
NETS = {"field net": net_field, "image net": image_net_field}


def field() -> Iterator[Figure]:
    """Points and frames a second of a full field, from the last frame's."""
    _require_gpu()
    for size in SIZES:
        before, after = _images(size)
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


def nets() -> Iterator[Figure]:
    """Points and frames a second of the field net and of the image net, with all that they need.

    Both start from the adaptive field, which stays on the core: its subsets and the net are on the
    GPU.
    """
    _require_gpu()
    for size in SIZES[:2]:
        for name in NETS:
            here, there = (net_rate(name, size, device) for device in ("cpu", "cuda"))
            for rate in (here, there):
                yield from rate.figures(size)
            over = here.seconds / there.seconds
            case = f"{name}, {size.side}², on a GPU over one core"
            yield from line(TABLE, case, ratio=(over, ""))


class NetRate(NamedTuple):
    """What a net takes for a frame on a device, and its error.

    Attributes
    ----------
    name, device : str
    points : int
    seconds : float, s
    error : float, px
        Of both components, rms.
    """

    name: str
    device: str
    points: int
    seconds: float
    error: float

    def figures(self, size: Size) -> Iterator[Figure]:
        """Make the line of it."""
        yield from line(
            TABLE,
            f"{self.name}, {size.side}², step {size.step}, {self.device}",
            rate=(self.points / self.seconds / 1e6, "million points/s"),
            frames=(1 / self.seconds, "frames/s"),
            error=(1e3 * self.error, "mpx, rms", None, self.points),
        )


def net_rate(name: str, size: Size, device: str) -> NetRate:
    """Time a net on torch's CPU or on a GPU, beside the truth.

    Without a GPU the subsets are measured by the compiled loops, as ever.
    """
    before, after = _images(size)
    ref = dic.prepare(before, SUBSET, size.step, device=None if device == "cpu" else device)
    measure = partial(NETS[name], ref, after)
    found, seconds = measure().field, clock(measure)
    truth = displacement(size.side, found.xy, SHIFT, STRETCH)
    off = np.column_stack([found.u, found.v]) - truth
    return NetRate(name, device, len(found.u), seconds, rms(off[found.valid]))


def _images(size: Size) -> tuple[AnyArray, AnyArray]:
    """Images before and after an even stretch."""
    rng = np.random.default_rng(0)
    before = eight_bit(speckle(size.side), NOISE, rng)
    return before, eight_bit(speckle(size.side, SHIFT, STRETCH), NOISE, rng)


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


PARTS = {"field": field, "nets": nets}

if __name__ == "__main__":
    run(PARTS, __doc__)
