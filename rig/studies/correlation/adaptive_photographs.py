"""The adaptive field and the field net on images of others: star 5 and the open hole.

Parts: star, hole. They need ``--data FOLDER`` with `star5` and `open_hole`, which are not in this
repository. Of two photographs of one still object there are none: a still pair is the reference
beside itself with twice the variance of its noise added, which differs by as much noise.
"""

from collections.abc import Iterator
from itertools import product
from pathlib import Path

import cv2
import numpy as np

import dic
from rig.report.figure import Bar, Figure, at_most
from rig.studies.correlation.adaptive_field import (
    BANDS_BAR,
    ESTIMATES,
    WINDOWS,
    Field,
    fixed_settings,
)
from rig.studies.correlation.photographs import measure_star
from rig.studies.study import line, rms, run_on_data
from rig.system.arrays import F64, AnyArray

BANDS = ((15, 25), (25, 40), (40, 80), (80, 300))  # px of period
ADDED = 3.0  # grey levels, of the noise that is drawn over photographs
DRAWS = 6
EDGE = 30  # px
SHORTEST = 11.0  # px, period from which the crest of star 5 is looked at
Pair = tuple[AnyArray, AnyArray]


def star(data: Path) -> Iterator[Figure]:
    """Total error of v on star 5 by period, over the best fixed setting; noise × period."""
    first, second = (
        dic.read_image(data / "star5" / f"DIC_Challenge_Star_Noise_{n}.tiff")
        for n in ("Ref", "Def")
    )
    best: dict[tuple[int, int], float] = dict.fromkeys(BANDS, np.inf)
    for (_, field), band in product(fixed_settings(first, second, WINDOWS), BANDS):
        best[band] = min(best[band], rms(_errors(field, band)))
    for name, estimate in ESTIMATES.items():
        field = estimate(first, second)
        for band in BANDS:
            off, stated = _errors(field, band), field.sigma_v[_band(field, band)]
            yield from line(
                "Beyond one window: star 5",
                f"{band[0]} to {band[1]} px, {name}",
                error=(1e3 * rms(off), "mpx, rms"),
                best_fixed=(1e3 * best[band], "mpx, rms"),
                ratio=(rms(off) / best[band], "", BANDS_BAR[name][0], len(off)),
                stated_σ_over_error=(rms(stated) / rms(off), ""),
            )
        yield from _efficiency(name, field, (first, second))


def _efficiency(name: str, field: dic.DisplacementField, images: Pair) -> Iterator[Figure]:
    """Noise × period at 10 % loss: noise of a still pair, and redrawn in situ."""
    limit = measure_star(field, _period(field.xy[:, 0]), _wave(field.xy), SHORTEST).period
    noise = _noise(*images, beyond=2500.0)
    quiet, situ = _still(images[0], noise, name), _redrawn(images, noise, limit, name)
    still = "MEI of the reference beside itself, noise drawn"
    for of_it, value, bar in ((still, quiet, 0.05), ("MEI in situ", situ, 0.2)):
        yield from line(
            "Beyond one window",
            f"star 5, {of_it}, {name}",
            noise=(1e3 * value, "mpx"),
            period=(limit, "px"),
            MEI=(value * limit, "px²", at_most(bar)),
        )


def _still(first: AnyArray, noise: float, name: str) -> float:
    """Scatter of v where nothing moves, px."""
    part = first[:, -1500:].astype(np.float64)
    again = part + np.random.default_rng(1).normal(0, np.sqrt(2) * noise, part.shape)
    found = ESTIMATES[name](part, again)
    return float(np.nanstd(found.v[_inside(found.xy, part.shape)]))


def _redrawn(images: Pair, noise: float, limit: float, name: str) -> float:
    """Scatter of v at the period of 10 % loss for the noise of the images, px.

    Noise is drawn over both, `ADDED` strong, and the scatter is scaled to that of the images.
    """
    rng = np.random.default_rng(3)
    stop = round((1.3 * limit - 10) * 4000 / 290) + 100  # px: what lies beyond is not needed
    cut = [image[:, :stop].astype(np.float64) for image in images]
    fields = [
        ESTIMATES[name](*(image + rng.normal(0, ADDED, image.shape) for image in cut))
        for _ in range(4)
    ]
    near = np.abs(_period(fields[0].xy[:, 0]) / limit - 1) < 0.15
    drawn = np.array([f.v[near] for f in fields])
    known = np.isfinite(drawn).all(axis=0)
    scatter = float(np.sqrt(drawn[:, known].var(axis=0, ddof=1).mean()))
    return scatter * noise / ADDED


def _noise(first: AnyArray, second: AnyArray, beyond: float = 0.0) -> float:
    """Noise of one image, grey levels, from what subsets leave over beyond a column."""
    ref = dic.prepare(first)
    found = dic.correlate(ref, second)
    far = found.valid & (found.xy[:, 0] > beyond)
    floor = np.sqrt(2 * np.diagonal(ref.inverse, axis1=1, axis2=2)[far, 0])
    return float(np.median(found.sigma_u[far] / floor))


def _period(x: F64) -> F64:
    return 10 + 290 / 4000 * x


def _wave(xy: F64) -> F64:
    return np.asarray(0.5 * np.cos(2 * np.pi * (xy[:, 1] - 250) / _period(xy[:, 0])))


def _band(field: Field, band: tuple[int, int]) -> np.ndarray:
    period = _period(field.xy[:, 0])
    return field.valid & (period >= band[0]) & (period < band[1])


def _errors(field: Field, band: tuple[int, int]) -> F64:
    return (field.v - _wave(field.xy))[_band(field, band)]


def hole(data: Path) -> Iterator[Figure]:
    """Stated σ over the scatter of redrawn noise, on a still photograph and on a real test."""
    first, second = (dic.read_image(data / "open_hole" / f"oht_cfrp_{n}.bmp") for n in (0, 4))
    own = _noise(first, second)
    for (case, after), (name, estimate) in product(
        (("a photograph beside itself, noise drawn over both", first), ("open hole", second)),
        ESTIMATES.items(),
    ):
        rng = np.random.default_rng(2)
        fields = [
            estimate(*(image + rng.normal(0, ADDED, image.shape) for image in (first, after)))
            for _ in range(DRAWS)
        ]
        here = _inside(fields[0].xy, first.shape) & np.all([f.valid for f in fields], axis=0)
        # Of the noise that σ is stated for, a part is in the photographs and is not redrawn; where
        # both are the same one, it is in neither difference.
        kept = ADDED / np.hypot(ADDED, own if after is second else 0.0)
        for part in "uv":
            drawn = np.array([getattr(f, part)[here] for f in fields])
            stated = np.array([getattr(f, f"sigma_{part}")[here] for f in fields])
            scatter = float(np.sqrt(drawn.var(axis=0, ddof=1).mean()))
            if after is first:
                scatter = rms(drawn)  # all of it is error: nothing moves
            yield from line(
                "Beyond one window: σ on photographs",
                f"{case}, {name}, {part}",
                stated=(1e3 * rms(stated), "mpx, rms"),
                sampled=(1e3 * scatter, "mpx, rms"),
                stated_over_sampled=(
                    kept * rms(stated) / scatter, "", Bar(0.9, 1.1), int(here.sum()) * DRAWS,
                ),
            )  # fmt: skip


def _inside(xy: F64, shape: tuple[int, ...]) -> np.ndarray:
    return np.all((xy >= EDGE) & (xy < np.array(shape[::-1]) - EDGE), axis=1)


PARTS = {"star": star, "hole": hole}

if __name__ == "__main__":
    cv2.setNumThreads(1)
    run_on_data(PARTS, __doc__)
