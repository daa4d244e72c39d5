"""The adaptive field and the field net beside every fixed subset, on motion that is known.

Parts: bands, efficiency, sigma, strain, time, held. Images are 8 bit with noise of 2 grey levels in
both. The best fixed setting is that of each band by itself: of subsets of 15 to 45 px, orders 1 and
2, and of polynomials through them (`dic.smooth`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial

import cv2
import numpy as np

import dic
from models import image_net_field, net_field
from rig.report.figure import Bar, Figure, at_most
from rig.studies.correlation.images import eight_bit
from rig.studies.correlation.known_fields import (
    KnownField,
    bumps,
    crack,
    hole,
    period,
    plate,
    shift,
    star,
    still,
    waves,
)
from rig.studies.correlation.moved_speckle import moved_speckle
from rig.studies.study import line, rms, run, timed, times
from rig.system.arrays import F64, AnyArray, Mask

NOISE = 2.0  # grey levels
DRAWS = 3
STATED_SEEDS = range(100, 116)  # a field that hardly bends errs by a few numbers, new in each
SUBSETS, WINDOWS = (15, 21, 31, 45), (9, 15, 21)
STRAIN_WINDOWS = (5, 9, 15, 21, 31, 41)
BANDS_BAR = {"adaptive": (at_most(0.75), at_most(0.7)), "net": (at_most(0.5), at_most(0.5))}
STATED = Bar(0.9, 1.1)
Field = dic.DisplacementField | dic.SmoothField
Estimate = Callable[[AnyArray, AnyArray], dic.DisplacementField]
Pair = tuple[AnyArray, AnyArray]

ESTIMATES: dict[str, Estimate] = {
    "adaptive": lambda a, b: dic.adaptive_field(dic.prepare(a), b),
    "net": lambda a, b: net_field(dic.prepare(a), b).field,
}


@cache
def pair(known: KnownField, seed: int, width: float = 1.8) -> Pair:
    """Draw reference and deformed image of a field."""
    rng, speckle = np.random.default_rng((seed, 9)), moved_speckle(known.shape, seed, width)
    first = known.pierced(speckle.draw(), False)
    second = known.pierced(speckle.draw(known.origin), True)
    return eight_bit(first, NOISE, rng), eight_bit(second, NOISE, rng)


def fixed(known: KnownField, seed: int) -> Iterator[tuple[str, Field]]:
    """Measure a field by every fixed setting."""
    # The widest polynomials lose every wave of the star, and cost seconds where points are missing.
    windows = WINDOWS if known.name in ("plate", "bumps") else WINDOWS[:-1]
    yield from fixed_settings(*pair(known, seed), windows)


def fixed_settings(
    first: AnyArray, second: AnyArray, windows: tuple[int, ...]
) -> Iterator[tuple[str, Field]]:
    """Measure a pair by every fixed subset and by polynomials over these windows of points."""
    for subset in SUBSETS:
        for order in (1, 2):
            found = dic.correlate(dic.prepare(first, subset, order=order), second)
            yield f"{subset}/{order}", found
            if order == 1 and subset < 45:
                for window in windows:
                    yield f"{subset}/1 smoothed over {window}", dic.smooth(found, window)


def _errors(found: Field, known: KnownField) -> dict[str, F64]:
    """Squared errors of u and v of the valid points of each band, of what they should be."""
    squares = np.square(np.column_stack([found.u, found.v]) - known.truth(found.xy))
    parts = known.parts(found.xy)
    columns = slice(1, 2) if known.name == "star" else slice(None)
    return {name: squares[here & found.valid, columns].ravel() for name, here in parts.items()}


def _best(fields: list[KnownField], seeds: list[int]) -> dict[str, tuple[float, str]]:
    """Least rms error over the fixed settings, px, and the setting, of each band."""
    sums: dict[str, dict[str, list[F64]]] = {}
    for known, seed in zip(fields, seeds, strict=True):
        for name, found in fixed(known, seed):
            for band, squares in _errors(found, known).items():
                sums.setdefault(band, {}).setdefault(name, []).append(squares)
    return {
        band: min((float(np.sqrt(np.concatenate(s).mean())), name) for name, s in by_name.items())
        for band, by_name in sums.items()
    }


def cases() -> Iterator[tuple[list[KnownField], list[int]]]:
    """Fields of each kind, and the seeds of their patterns."""
    seeds = list(range(DRAWS))
    yield [star()] * DRAWS, seeds
    for kind in (plate, bumps, crack):
        yield [kind(seed) for seed in seeds], seeds


def bands() -> Iterator[Figure]:
    """Total error over that of the best fixed setting of each band."""
    worst: dict[str, dict[bool, list[float]]] = {name: {} for name in ESTIMATES}
    for fields, seeds in cases():
        best = _best(fields, seeds)
        for name, estimate in ESTIMATES.items():
            found = [estimate(*pair(f, s)) for f, s in zip(fields, seeds, strict=True)]
            for band, (least, setting) in best.items():
                each = [_errors(f, k)[band] for f, k in zip(found, fields, strict=True)]
                error = float(np.sqrt(np.concatenate(each).mean()))
                plain = fields[0].name in ("plate", "bumps")
                worst[name].setdefault(plain, []).append(error / least)
                yield from line(
                    "Beyond one window: total error by band",
                    f"{band}, {name}",
                    error=(1e3 * error, "mpx, rms"),
                    best_fixed=(1e3 * least, "mpx, rms"),
                    setting=setting,
                    ratio=(error / least, "", BANDS_BAR[name][plain], sum(map(len, each))),
                )
    yield from _near_crack()
    for name, ratios in worst.items():
        title = {"adaptive": "adaptive field", "net": "field net"}[name]
        for plain, case in ((False, "of each band, worst band"), (True, "plate and bumps")):
            yield from line(
                "Beyond one window",
                f"{title} over the best fixed setting, {case}",
                ratio=(max(ratios[plain]), "", BANDS_BAR[name][plain]),
            )


def _near_crack() -> Iterator[Figure]:
    """Points within half a subset of the crack, of which subsets measure none."""
    for name, estimate in (("subset 21", _subset), *ESTIMATES.items()):
        known, off = 0, [np.zeros(0)]
        total = 0
        for seed in range(DRAWS):
            field = crack(seed)
            found = estimate(*pair(field, seed))
            near = field.inside(found.xy) & _close(field, found.xy)
            error = np.hypot(*(np.column_stack([found.u, found.v]) - field.truth(found.xy)).T)
            total, known = total + int(near.sum()), known + int((near & found.valid).sum())
            off.append(error[near & found.valid])
        every = np.concatenate(off)
        yield from line(
            "Beyond one window: within 10 px of a crack",
            name,
            measured=(100 * known / total, "%"),
            error=(1e3 * rms(every) if len(every) else None, "mpx, rms"),
            wrong_by_a_fifth_of_the_jump=(
                100 * float((every > 0.2).mean()) if len(every) else None, "%", at_most(1), total,
            ),
        )  # fmt: skip


def _subset(
    first: AnyArray, second: AnyArray, subset: int = 21, order: int = 1
) -> dic.DisplacementField:
    return dic.correlate(dic.prepare(first, subset, order=order), second)


def _image_net(first: AnyArray, second: AnyArray) -> dic.DisplacementField:
    return image_net_field(dic.prepare(first), second).field


_FIXED: dict[str, Estimate] = {
    "subset 15": partial(_subset, subset=15),
    "subset 21": _subset,
    "subset 21, order 2": partial(_subset, order=2),
    "subset 31": partial(_subset, subset=31),
}


def _close(field: KnownField, xy: F64) -> Mask:
    """Points of which a neighbour 10 px away moves by another amount, as across a crack."""
    here, close = field.truth(xy), np.zeros(len(xy), bool)
    for step in ((10, 0), (-10, 0), (0, 10), (0, -10)):
        close |= np.linalg.norm(field.truth(xy + np.array(step)) - here, axis=1) > 0.5
    return close


def efficiency() -> Iterator[Figure]:
    """Noise x period at 10 % loss: noise of a still pair, and in situ over three draws."""
    known, nothing = star(), still(0)
    for name, estimate in (("subset 21", _subset), *ESTIMATES.items()):
        found = [estimate(*pair(known, seed)) for seed in range(DRAWS)]
        xy, v = found[0].xy, np.array([f.v for f in found])
        limit, columns = _limit(xy, v.mean(axis=0), known.truth(xy)[:, 1])
        calm = estimate(*pair(nothing, 0))
        quiet = float(np.nanstd(calm.v[nothing.inside(calm.xy)]))
        near = known.inside(xy) & (np.abs(period(xy[:, 0]) / limit - 1) < 0.1)
        spread = np.asarray(np.nanvar(v[:, near], axis=0, ddof=1))
        noise = float(np.sqrt(np.nanmean(spread)))
        asked = name in ESTIMATES
        yield from line(
            "Beyond one window: noise × period at 10 % loss",
            name,
            period=(limit, "px"),
            noise_in_situ=(1e3 * noise, "mpx"),
            MEI_in_situ=(noise * limit, "px²", at_most(0.2) if asked else None, DRAWS),
            noise_of_the_still_pair=(1e3 * quiet, "mpx"),
            MEI_of_the_still_pair=(quiet * limit, "px²", at_most(0.05) if asked else None, columns),
        )


def _waves(_: int, length: float) -> KnownField:
    """Waves of 0.3 px, of a pattern of any seed."""
    return waves(length, 0.3)


def _limit(xy: F64, v: F64, wave: F64) -> tuple[float, int]:
    """Period at which a column keeps 90 % of the wave, px, and the number of columns."""
    columns = np.unique(xy[:, 0])
    kept: list[float] = []
    periods: list[float] = []
    for x in columns:
        here = (xy[:, 0] == x) & np.isfinite(v)
        if here.sum() > 20:
            kept.append(float(v[here] @ wave[here] / (wave[here] @ wave[here])))
            periods.append(float(period(x)))
    through = np.polynomial.Polynomial.fit(1 / np.array(periods), kept, 6)
    every = np.geomspace(min(periods), max(periods), 2000)
    below = np.flatnonzero(np.asarray(through(1 / every)) < 0.9)
    return float(every[below.max()] if len(below) else every[0]), len(periods)


# Waves that tiles cannot follow, which limits.md speaks of: no bar holds there.
_SHORT: tuple[Callable[[int], KnownField], ...] = tuple(
    partial(_waves, length=length) for length in (8.0, 10.0, 12.0, 15.0)
)


def sigma() -> Iterator[Figure]:
    """Stated σ over the error, in situ, of displacement and strain."""
    kinds = ((kind, STATED) for kind in (still, shift, plate, bumps))
    for kind, bar in (*kinds, *((short, None) for short in _SHORT)):
        for name, estimate in ESTIMATES.items():
            stated: dict[str, list[F64]] = {"u, v": [], "strain": []}
            off: dict[str, list[F64]] = {"u, v": [], "strain": []}
            for seed in STATED_SEEDS:
                known = kind(seed)
                found = estimate(*pair(known, seed))
                here = known.inside(found.xy) & found.valid
                off["u, v"].append(
                    (np.column_stack([found.u, found.v]) - known.truth(found.xy))[here]
                )
                stated["u, v"].append(np.column_stack([found.sigma_u, found.sigma_v])[here])
                e = dic.strain(found)
                off["strain"].append(
                    (np.column_stack([e.exx, e.eyy]) - true_strain(known, e.xy))[here]
                )
                stated["strain"].append(e.sigma[here, :2])
            for part, errors in off.items():
                ratio = rms(np.concatenate(stated[part])) / rms(np.concatenate(errors))
                yield from line(
                    "Beyond one window: stated σ over the error",
                    f"{kind(0).name}, {name}, {part}",
                    ratio=(ratio, "", bar, sum(map(len, errors))),
                )


def true_strain(known: KnownField, xy: F64) -> F64:
    """Take the true exx and eyy at points, (N, 2)."""
    x, y = xy.T
    (right, _), (left, _) = known.displacement(x + 0.5, y), known.displacement(x - 0.5, y)
    (_, below), (_, above) = known.displacement(x, y + 0.5), known.displacement(x, y - 0.5)
    return np.column_stack([right - left, below - above])


def strain() -> Iterator[Figure]:
    """Strain of a plate under touches over the best window of a fixed subset."""
    off: dict[str, list[F64]] = {}
    for seed in range(DRAWS):
        known = plate(seed)
        images = pair(known, seed)
        plain = _subset(*images)
        here = known.inside(plain.xy)
        fields = {f"window {n}": dic.strain(plain, n) for n in STRAIN_WINDOWS}
        fields |= {name: dic.strain(estimate(*images)) for name, estimate in ESTIMATES.items()}
        for name, e in fields.items():
            errors = np.column_stack([e.exx, e.eyy]) - true_strain(known, e.xy)
            off.setdefault(name, []).append(errors[here & e.valid].ravel())
    error = {name: rms(np.concatenate(each)) for name, each in off.items()}
    smallest = min(value for name, value in error.items() if name.startswith("window"))
    for name, value in error.items():
        bar = at_most(0.6) if name in ESTIMATES else None
        yield from line(
            "Beyond one window: strain of a plate under touches",
            name,
            error=(1e6 * value, "µε, rms"),
            over_the_best_window=(value / smallest, "", bar, sum(map(len, off[name]))),
        )


def time() -> Iterator[Figure]:
    """Time of 512² from two images, one core, and the error: fixed, adaptive and learned."""
    yield from _times(bumps(5), "")
    yield from _times(waves(20.0, 0.3), ", waves of 20 px")


def _times(known: KnownField, case: str) -> Iterator[Figure]:
    rng, speckle = np.random.default_rng(5), moved_speckle((512, 512), 5)
    first, second = (eight_bit(speckle.draw(o), NOISE, rng) for o in (None, known.origin))
    limits = {"adaptive": at_most(100.0), "net": at_most(300.0), "image net": at_most(300.0)}
    for name, estimate in (*_FIXED.items(), *ESTIMATES.items(), ("image net", _image_net)):
        estimate(first, second)  # what compiles does so before
        spent = [timed(lambda e=estimate: e(first, second))[1] for _ in range(9)]
        error = rms(np.sqrt(np.concatenate(list(_errors(estimate(first, second), known).values()))))
        yield from line(
            "Beyond one window: 512² from two images, one core",
            f"{name}{case}",
            **times(spent, limits.get(name)),
            time=(float(np.median(spent)), "ms"),
            error=(1e3 * error, "mpx, rms"),
        )


def held() -> Iterator[Figure]:
    """Total error of the field net over the adaptive field, on patterns and fields held out."""
    ratios: list[float] = []
    for kind in (plate, bumps, crack, hole, shift, still):
        for width in (1.4, 2.4):
            squares: dict[str, list[F64]] = {name: [] for name in ESTIMATES}
            for seed in range(100, 102):
                known = kind(seed)
                fields = {n: e(*pair(known, seed, width)) for n, e in ESTIMATES.items()}
                both = np.logical_and.reduce([f.valid for f in fields.values()])
                for name, found in fields.items():
                    off = np.column_stack([found.u, found.v]) - known.truth(found.xy)
                    squares[name].append(np.square(off[both & known.inside(found.xy)]).ravel())
            error = {name: float(np.sqrt(np.concatenate(s).mean())) for name, s in squares.items()}
            ratios.append(error["net"] / error["adaptive"])
            yield from line(
                "Beyond one window: field net over the adaptive field, held out",
                f"{kind(0).name}, spots of {2.355 * width:.1f} px",
                net=(1e3 * error["net"], "mpx, rms"),
                adaptive=(1e3 * error["adaptive"], "mpx, rms"),
                ratio=(ratios[-1], "", at_most(1.05), sum(map(len, squares["net"]))),
            )
    yield from line(
        "Beyond one window",
        "field net over the adaptive field, held out",
        total_error=(rms(ratios), "", at_most(0.75), len(ratios)),
        worst=(max(ratios), "", at_most(1.05), len(ratios)),
    )


PARTS = {
    "bands": bands,
    "efficiency": efficiency,
    "sigma": sigma,
    "strain": strain,
    "time": time,
    "held": held,
}

if __name__ == "__main__":
    import torch

    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    run(PARTS, __doc__)
