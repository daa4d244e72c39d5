"""Photographs and drawings of others: an open hole, a rotation of 170°, star 5.

Parts: hole, rotation, star. They need ``--data FOLDER`` with `open_hole`, `rotation` and `star5`,
which are not in this repository.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import dic
from rig.report.figure import Figure, at_least, at_most
from rig.studies.study import line, rms, run_on_data

HOLE = (145.0, 472.0, 52.0)  # px, place and radius of the hole
SHORTEST = 18.0  # px, period from which the wave of star 5 is looked at
BANDS = (10, 20, 30, 40, 60, 80, 120, 200, 300)  # px of period
OFF = at_most(10.0)  # mpx
VALID = at_least(99.0)  # % of the points that the image allows


def hole(data: Path) -> Iterator[Figure]:
    """Compare a real tensile test of a plate with a hole with another code, radius 16, order 1."""
    folder = data / "open_hole"
    first, second = (dic.read_image(folder / f"oht_cfrp_{n}.bmp") for n in (0, 4))
    path = folder / "oht_cfrp_4_fftcc_icgn1_r16.csv"
    other = np.genfromtxt(path, delimiter=",", names=True, dtype=float)
    found = dic.correlate(dic.prepare(first, subset=33, step=2), second)
    here = {(x, y): n for n, (x, y) in enumerate(found.xy.astype(int))}
    place = np.array([here[int(x), int(y)] for x, y in zip(other["x"], other["y"], strict=True)])
    plate = np.hypot(*(found.xy[place] - HOLE[:2]).T) > HOLE[2]
    ours = found.valid[place]
    both = ours & (other["convergence"] <= 1e-3)
    table = "Open hole in carbon fibre, subset 33, step 2"
    for name, points, bar in (("all", ours, at_least(95.0)), ("on the plate", ours[plate], VALID)):
        valid = 100 * float(points.mean())
        yield from line(table, f"points of the other code, {name}", valid=(valid, "%", bar))
    for part in "uv":
        off = getattr(found, part)[place] - other[part]
        difference = 1e3 * rms(off[both]), "mpx, rms", OFF, int(both.sum())
        yield from line(table, f"{part} less that of the other code", difference=difference)


def rotation(data: Path) -> Iterator[Figure]:
    """Compare with the affine motion that the field itself follows: the image only turns."""
    first, second = (
        dic.read_image(data / "rotation" / f"rotation_{n}.tif") for n in ("000", "170")
    )
    for order in (1, 2):
        found = dic.correlate(dic.prepare(first, order=order), second)
        known = np.column_stack([found.xy, np.ones(len(found.xy))])
        moved = found.xy + np.column_stack([found.u, found.v])
        turn = np.linalg.lstsq(known[found.valid], moved[found.valid], rcond=None)[0]
        reach = found.subset // 2 * np.abs(turn[:2]).sum(axis=0)
        limit = np.array(second.shape[::-1]) - 0.5 - reach
        seen = np.all((known @ turn >= reach - 0.5) & (known @ turn <= limit), axis=1)
        off = (moved - known @ turn)[found.valid]
        yield from line(
            "Rotation of 170°",
            f"order {order}",
            valid_of_those_seen=(100 * float(found.valid[seen].mean()), "%", VALID),
            off=(1e3 * rms(off.ravel()), "mpx, rms", OFF),
            angle=(float(np.degrees(np.arctan2(turn[0, 1], turn[0, 0]))), "°"),
        )


def star(data: Path) -> Iterator[Figure]:
    """Noise × period at 10 % loss, as the peers do it and smoothed; and the error by period."""
    folder = data / "star5"
    for subset, order, windows in ((21, 1, (11,)), (15, 1, (9,)), (21, 2, ()), (31, 2, ())):
        found, period, wave = _star(folder, subset, order)
        fields: dict[str, dic.DisplacementField | dic.SmoothField] = {f"order {order}": found}
        fields |= {f"order {order}, {n} points smoothed": dic.smooth(found, n) for n in windows}
        for name, field in fields.items():
            measured = measure_star(field, period, wave)
            yield from line(
                "Star 5: metrological efficiency",
                f"subset {subset}, {name}",
                MEI=(measured.mei, "px²", at_most(0.34)),
                noise=(1e3 * measured.noise, "mpx"),
                period_at_10_percent_loss=(measured.period, "px"),
            )
    found, period, wave = _star(folder, 21, 1)
    for low, high in pairwise(BANDS):
        some = found.valid & (period >= low) & (period < high)
        yield from line(
            "Star 5: error by period, subset 21, order 1",
            f"{low} to {high} px",
            error=(1e3 * rms((found.v - wave)[some]), "mpx, rms"),
            stated_σ=(1e3 * rms(found.sigma_v[some]), "mpx, rms"),
        )


def _star(
    folder: Path, subset: int, order: int, step: int = 5
) -> tuple[dic.DisplacementField, NDArray[np.float64], NDArray[np.float64]]:
    """Field, period and true v at its points: v = 0.5 cos(2π (y - 250)/p) (Reu et al. 2022)."""
    first, second = (
        dic.read_image(folder / f"DIC_Challenge_Star_Noise_{n}.tiff") for n in ("Ref", "Def")
    )
    found = dic.correlate(dic.prepare(first, subset, step, order), second)
    x, y = found.xy.T
    period = 10 + 290 / 4000 * x
    return found, period, 0.5 * np.cos(2 * np.pi * (y - 250) / period)


@dataclass(frozen=True)
class Efficiency:
    """Metrological efficiency: noise, px, period at 10 % loss, px."""

    noise: float
    period: float

    @property
    def mei(self) -> float:
        """Their product, px²."""
        return self.noise * self.period


def measure_star(
    field: dic.DisplacementField | dic.SmoothField,
    period: NDArray[np.float64],
    wave: NDArray[np.float64],
    shortest: float = SHORTEST,
) -> Efficiency:
    """Period at which the crest of the wave keeps 90 %, and the noise of the crest beyond it.

    What is kept is a polynomial in 1/period through all of the crest: a point alone is known to a
    few per cent only.
    """
    crest = field.valid & (np.abs(field.xy[:, 1] - 250) <= 2.5) & (period > shortest)
    kept = field.v[crest] / wave[crest]
    through = np.polynomial.Polynomial.fit(1 / period[crest], kept, 6)
    every = np.geomspace(shortest, 290, 2000)
    limit = every[np.flatnonzero(through(1 / every) < 0.9).max()]
    far = period[crest] > 1.3 * limit
    noise = np.std((kept - through(1 / period[crest]))[far]) / 2  # of a crest of 0.5 px
    return Efficiency(float(noise), float(limit))


PARTS = {"hole": hole, "rotation": rotation, "star": star}

if __name__ == "__main__":
    run_on_data(PARTS, __doc__)
