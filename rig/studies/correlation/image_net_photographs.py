"""The image net beside the adaptive field on images of others: star 5 and the open hole.

Parts: star, hole. They need ``--data FOLDER`` with `star5` and `open_hole`, which are not in this
repository. Of the open hole there is no truth: noise is drawn over it and the scatter is what is
measured, and the field is compared with that of another code.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

import dic
from rig.report.figure import Figure
from rig.studies.correlation.image_net import adaptive_of, net_of, star_rows
from rig.studies.correlation.photographs import HOLE
from rig.studies.study import line, rms, run_on_data
from rig.system.arrays import F64

ADDED = 3.0  # grey levels, of the noise that is drawn over photographs
DRAWS = 4


def star(data: Path) -> Iterator[Figure]:
    """Mean absolute error of v on star 5."""
    first, second = (
        dic.read_image(data / "star5" / f"DIC_Challenge_Star_Noise_{n}.tiff")
        for n in ("Ref", "Def")
    )
    net, other = net_of(first, second), adaptive_of(first, second)
    x, y = other.xy.T
    period = 10 + 290 / 4000 * x
    wave = 0.5 * np.cos(2 * np.pi * (y - 250) / period)
    both = net.field.valid & other.valid
    off = {
        name: [(field.v - wave)[both]]
        for name, field in (("image net", net.field), ("adaptive field", other))
    }
    yield from star_rows(
        "Star 5, periods of 10 to 300 px", off, [period[both]], _own(net.by_net, both)
    )
    ratio = np.abs(off["image net"][0]).mean() / np.abs(off["adaptive field"][0]).mean()
    yield from line(
        "Image net",
        "image net on star 5: mean error over the classical one",
        figure=(float(ratio), "", None, int(both.sum())),
    )


def _own(by_net: np.ndarray, valid: np.ndarray) -> float:
    return float(by_net[valid].mean())


def hole(data: Path) -> Iterator[Figure]:
    """Scatter of redrawn noise, what is stated for it, and the difference from another code."""
    folder = data / "open_hole"
    first, second = (dic.read_image(folder / f"oht_cfrp_{n}.bmp") for n in (0, 4))
    other = np.genfromtxt(
        folder / "oht_cfrp_4_fftcc_icgn1_r16.csv", delimiter=",", names=True, dtype=float
    )
    known = {
        (int(x), int(y)): n for n, (x, y) in enumerate(zip(other["x"], other["y"], strict=True))
    }
    rng = np.random.default_rng(2)
    noisy = [
        [image + rng.normal(0, ADDED, image.shape) for image in (first, second)]
        for _ in range(DRAWS)
    ]
    for name in ("image net", "adaptive field"):
        net = name == "image net"
        fields = [net_of(*images).field if net else adaptive_of(*images) for images in noisy]
        plain = net_of(first, second) if net else None
        field = plain.field if plain else adaptive_of(first, second)
        away = np.hypot(*(field.xy - HOLE[:2]).T) > 1.2 * HOLE[2]
        here = away & field.valid & np.all([f.valid for f in fields], axis=0)
        scatter = [_scatter([getattr(f, part)[here] for f in fields]) for part in "uv"]
        stated = [np.array([getattr(f, f"sigma_{part}")[here] for f in fields]) for part in "uv"]
        at = np.array([known.get((int(x), int(y)), -1) for x, y in field.xy])
        both = here & (at >= 0)
        apart = [getattr(field, part)[both] - other[part][at[both]] for part in "uv"]
        yield from line(
            "Open hole in carbon fibre, 3 grey levels of noise over it",
            name,
            scatter=(1e3 * rms(scatter), "mpx, rms", None, int(here.sum()) * DRAWS),
            stated_over_scatter=(rms(np.concatenate(stated)) / rms(scatter), ""),
            less_another_code=(1e3 * float(np.abs(apart).mean()), "mpx, mean"),
            by_the_net=(100 * _own(plain.by_net, field.valid), "%") if plain else None,
        )


def _scatter(drawn: list[F64]) -> float:
    return float(np.sqrt(np.array(drawn).var(axis=0, ddof=1).mean()))


PARTS = {"star": star, "hole": hole}

if __name__ == "__main__":
    import torch

    cv2.setNumThreads(1)
    torch.set_num_threads(1)
    run_on_data(PARTS, __doc__)
