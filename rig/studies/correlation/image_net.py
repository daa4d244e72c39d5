"""The image net beside the adaptive field and subsets, on motion that is known.

Parts: noisy_star, smooth, sigma, time. Images are 8 bit with noise of 2 grey levels in both, of
spots in closed form that no training has seen. The star is 2000 x 501 px: a wave of 0.5 px along y
whose period grows from 10 to 150 px.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from itertools import pairwise

import cv2
import numpy as np

import dic
from models import NetField, image_net_field
from rig.report.figure import Bar, Figure, at_most
from rig.studies.correlation.adaptive_field import NOISE, pair, true_strain
from rig.studies.correlation.images import eight_bit
from rig.studies.correlation.known_fields import (
    KnownField,
    bumps,
    crack,
    noisy_star,
    noisy_star_period,
    plate,
    shift,
    still,
    waves as known_waves,
)
from rig.studies.correlation.moved_speckle import came_from, moved_speckle
from rig.studies.study import line, rms, run, timed, times
from rig.system.arrays import F64, AnyArray

DRAWS = 2
BANDS = (10, 12, 15, 20, 30, 50, 80, 150)  # px of period
SUBSETS = ((21, 1), (21, 2))  # px, order: on the grid of the others
STATED = Bar(0.9, 1.1)


def net_of(first: AnyArray, second: AnyArray) -> NetField:
    """Measure by the image net."""
    return image_net_field(dic.prepare(first), second)


def adaptive_of(first: AnyArray, second: AnyArray) -> dic.DisplacementField:
    """Measure by the adaptive field, from which the net starts."""
    return dic.adaptive_field(dic.prepare(first), second)


def noisy_star_fields() -> Iterator[Figure]:
    """Mean absolute error of v on the noisy star, over all points that each pair has valid."""
    known = noisy_star()
    off: dict[str, list[F64]] = {}
    periods: list[F64] = []
    by_net: list[float] = []
    for seed in range(DRAWS):
        images = pair(known, seed)
        net = net_of(*images)
        other = adaptive_of(*images)
        found = {"image net": net.field.v, "adaptive field": other.v}
        for subset, order in SUBSETS:
            ref = dic.prepare(images[0], subset, order=order)
            found[f"subset {subset}, order {order}"] = dic.correlate(ref, images[1]).v
        both = net.field.valid & other.valid
        by_net.append(float(net.by_net[both].mean()))
        periods.append(noisy_star_period(other.xy[both, 0]))
        for name, v in found.items():
            off.setdefault(name, []).append((v - known.truth(other.xy)[:, 1])[both])
    yield from star_rows(
        "Noisy star, periods of 10 to 150 px", off, periods, float(np.mean(by_net))
    )
    error = {name: float(np.abs(np.concatenate(each)).mean()) for name, each in off.items()}
    yield Figure(
        "Image net",
        "image net on the noisy star: mean error over the classical one",
        "figure",
        error["image net"] / error["adaptive field"],
        "",
        at_most(1),
        sum(map(len, off["image net"])),
    )


def star_rows(
    table: str, off: dict[str, list[F64]], periods: list[F64], by_net: float
) -> Iterator[Figure]:
    """Mean absolute error of all and of each band of periods, mpx, of what each has measured."""
    period = np.concatenate(periods)
    for name, parts in off.items():
        error = np.abs(np.concatenate(parts))
        yield from line(
            table,
            name,
            mean_error=(1e3 * float(np.nanmean(error)), "mpx", None, len(error)),
            measured=(100 * float(np.isfinite(error).mean()), "%"),
            by_the_net=(100 * by_net, "%") if name == "image net" else None,
        )
        for low, high in pairwise(BANDS):
            here = (period >= low) & (period < high) & np.isfinite(error)
            if here.any():
                mean = 1e3 * float(error[here].mean())
                yield from line(
                    f"{table}, by period", f"{low} to {high} px, {name}", error=(mean, "mpx")
                )


@cache
def _measured(
    kind: Callable[[int], KnownField], seed: int
) -> tuple[NetField, dic.DisplacementField]:
    images = pair(kind(seed), seed)
    return net_of(*images), adaptive_of(*images)


def smooth() -> Iterator[Figure]:
    """Total error over that of the adaptive field, where the motion is smooth and at a crack."""
    for kind in (plate, bumps, crack, shift, still):
        off: dict[str, list[F64]] = {"net": [], "adaptive": []}
        own: list[float] = []
        for seed in range(DRAWS):
            known = kind(seed)
            net, other = _measured(kind, seed)
            here = net.field.valid & other.valid & known.inside(other.xy)
            own.append(float(net.by_net[here].mean()))
            for name, field in (("net", net.field), ("adaptive", other)):
                error = np.column_stack([field.u, field.v]) - known.truth(field.xy)
                off[name].append(error[here].ravel())
        error = {name: rms(np.concatenate(each)) for name, each in off.items()}
        yield from line(
            "Image net over the adaptive field",
            kind(0).name,
            net=(1e3 * error["net"], "mpx, rms"),
            adaptive=(1e3 * error["adaptive"], "mpx, rms"),
            ratio=(error["net"] / error["adaptive"], "", None, sum(map(len, off["net"]))),
            by_the_net=(100 * float(np.mean(own)), "%"),
        )


def sigma() -> Iterator[Figure]:
    """Stated σ over the error, of the points of the net."""
    for kind in (plate, bumps, shift, still):
        off: list[F64] = []
        stated: list[F64] = []
        for seed in range(DRAWS):
            known = kind(seed)
            net, _ = _measured(kind, seed)
            here, field = net.by_net & known.inside(net.field.xy), net.field
            off.append((np.column_stack([field.u, field.v]) - known.truth(field.xy))[here].ravel())
            stated.append(np.column_stack([field.sigma_u, field.sigma_v])[here].ravel())
        ratio = rms(np.concatenate(stated)) / rms(np.concatenate(off))
        yield from line(
            "Image net: stated σ over the error",
            kind(0).name,
            ratio=(ratio, "", STATED, sum(map(len, off))),
        )
    yield from _strain_sigma()


def _strain_sigma() -> Iterator[Figure]:
    """Stated σ of strain over its error, and that error over the adaptive field's.

    Of all points, and of those of the net under a short wave, which it is that changes.
    """
    for name, kind in (("plate", plate), ("bumps", bumps), ("waves of 12 px", waves)):
        off: dict[str, list[F64]] = {"net": [], "adaptive": []}
        stated: list[F64] = []
        for seed in range(DRAWS):
            known = kind(seed)
            net, other = _measured(kind, seed)
            ours, theirs = dic.strain(net.field), dic.strain(other)
            here = ours.valid & theirs.valid & known.inside(ours.xy)
            here &= net.by_net if kind is waves else True
            for of, e in (("net", ours), ("adaptive", theirs)):
                error = np.column_stack([e.exx, e.eyy]) - true_strain(known, e.xy)
                off[of].append(error[here].ravel())
            stated.append(ours.sigma[here, :2].ravel())
        error = {of: rms(np.concatenate(each)) for of, each in off.items()}
        yield from line(
            "Image net: stated σ of strain over the error",
            name,
            ratio=(rms(np.concatenate(stated)) / error["net"], "", None, sum(map(len, stated))),
            error=(1e6 * error["net"], "µε, rms"),
            over_the_adaptive_field=(error["net"] / error["adaptive"], ""),
        )


@cache
def waves(_: int) -> KnownField:
    """Waves along y of 12 px and 0.4 px, which tiles flatten."""
    return known_waves(12.0, 0.4)


def time() -> Iterator[Figure]:
    """Time of 512² from two images, one core: of a smooth field, and with waves of 20 px."""
    rng, speckle = np.random.default_rng(5), moved_speckle((512, 512), 5)
    waves = came_from(lambda x, y: (0 * x, 0.3 * np.cos(2 * np.pi * y / 20)))
    for scene, origin in (("bumps", bumps(5).origin), ("waves of 20 px", waves)):
        first, second = (eight_bit(speckle.draw(o), NOISE, rng) for o in (None, origin))
        for name, estimate, limit in (
            ("adaptive field", adaptive_of, at_most(100.0)), ("image net", net_of, at_most(300.0)),
        ):  # fmt: skip
            estimate(first, second)  # what compiles does so before
            spent = [timed(lambda e=estimate, a=first, b=second: e(a, b))[1] for _ in range(7)]
            table = "Image net: 512² from two images, one core"
            yield from line(table, f"{name}, {scene}", **times(spent, limit))


PARTS = {"noisy_star": noisy_star_fields, "smooth": smooth, "sigma": sigma, "time": time}

if __name__ == "__main__":
    import torch

    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    run(PARTS, __doc__)
