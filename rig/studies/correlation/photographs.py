"""Photographs and drawings of others: an open hole, a rotation of 170°, star 5."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

import dic

HOLE = (145.0, 472.0, 52.0)  # px, place and radius of the hole
SHORTEST = 18.0  # px, period from which the wave of star 5 is looked at


def photograph_rows(folder):
    """Measure all three: figure, value, bar, met."""
    yield from open_hole_rows(folder / "open_hole")
    yield from rotation_rows(folder / "rotation")
    yield from star_rows(folder / "star5")


@dataclass(frozen=True)
class OpenHole:
    """How our displacements compare with those of another code (order 1, radius 16).

    `valid` is the share of all its points, `on_plate` of those that do not lie in the hole.
    """

    points: int
    valid: float
    on_plate: float
    rms_u: float
    rms_v: float


def compare_open_hole(folder):
    """Compare a real tensile test of a plate with a hole, at subset 33, step 2."""
    pair = [dic.read_image(folder / f"oht_cfrp_{n}.bmp") for n in (0, 4)]
    other = np.genfromtxt(
        folder / "oht_cfrp_4_fftcc_icgn1_r16.csv", delimiter=",", names=True, dtype=float
    )
    disp = dic.correlate(dic.prepare(pair[0], subset=33, step=2), pair[1])
    here = {(x, y): n for n, (x, y) in enumerate(disp.xy.astype(int))}
    place = np.array([here[int(x), int(y)] for x, y in zip(other["x"], other["y"], strict=True)])
    plate = np.hypot(*(disp.xy[place] - HOLE[:2]).T) > HOLE[2]
    ours = disp.valid[place]
    both = ours & (other["convergence"] <= 1e-3)
    rms = [np.sqrt(np.mean((getattr(disp, k)[place] - other[k])[both] ** 2)) for k in "uv"]
    return OpenHole(len(place), ours.mean(), ours[plate].mean(), *rms)


def open_hole_rows(folder):
    hole = compare_open_hole(folder)
    share = hole.on_plate
    yield ("open hole, valid of those on the plate", f"{share:.2%}", "≥ 99 %", share >= 0.99)
    for part, rms in (("u", hole.rms_u), ("v", hole.rms_v)):
        yield (
            f"open hole, rms of {part} less the other",
            f"{rms:.4f} px",
            "≤ 0.01 px",
            rms <= 0.01,
        )


def rotation_rows(folder):
    """Compare with the affine motion that the field itself follows: the picture only turns."""
    pair = [dic.read_image(folder / f"rotation_{n}.tif") for n in ("000", "170")]
    for order in (1, 2):
        disp = dic.correlate(dic.prepare(pair[0], order=order), pair[1])
        known = np.column_stack([disp.xy, np.ones(len(disp.xy))])
        moved = disp.xy + np.column_stack([disp.u, disp.v])
        turn = np.linalg.lstsq(known[disp.valid], moved[disp.valid], rcond=None)[0]
        reach = disp.subset // 2 * np.abs(turn[:2]).sum(axis=0)
        limit = np.array(pair[1].shape[::-1]) - 0.5 - reach
        seen = np.all((known @ turn >= reach - 0.5) & (known @ turn <= limit), axis=1)
        angle = np.degrees(np.arctan2(turn[0, 1], turn[0, 0]))
        share, off = disp.valid[seen].mean(), (moved - known @ turn)[disp.valid]
        rms = np.sqrt(np.mean(off**2))
        yield (
            f"rotation, order {order}: valid of those seen",
            f"{share:.2%}, angle {angle:.5f}°",
            "≥ 99 %",
            share >= 0.99,
        )
        yield (f"rotation, order {order}: rms", f"{rms:.4f} px", "≤ 0.01 px", rms <= 0.01)


@dataclass(frozen=True)
class Star:
    """Error of v against the closed form; bands of period: low, high, rms error, rms σ, px."""

    valid: float
    bands: tuple[tuple[int, int, float, float], ...]
    rms: float


def compare_star(folder):
    """Compare star 5 of the DIC Challenge 2.0 with its truth, subset 21, order 1, step 5."""
    disp, period, wave = _star(folder, 21, 1)
    error, bands = disp.v - wave, []
    for low, high in pairwise((10, 20, 30, 40, 60, 80, 120, 200, 300)):
        some = disp.valid & (period >= low) & (period < high)
        bands.append((low, high, *(np.sqrt(np.mean(a[some] ** 2)) for a in (error, disp.sigma_v))))
    return Star(disp.valid.mean(), tuple(bands), np.sqrt(np.mean(error[disp.valid] ** 2)))


def _star(folder, subset, order, step=5):
    """Field, period and true v at its points: v = 0.5 cos(2π (y - 250)/p) (Reu et al. 2022)."""
    pair = [dic.read_image(folder / f"DIC_Challenge_Star_Noise_{n}.tiff") for n in ("Ref", "Def")]
    disp = dic.correlate(dic.prepare(pair[0], subset, step, order), pair[1])
    x, y = disp.xy.T
    period = 10 + 290 / 4000 * x
    return disp, period, 0.5 * np.cos(2 * np.pi * (y - 250) / period)


@dataclass(frozen=True)
class Efficiency:
    """Metrological efficiency: noise, px, period at 10 % loss, px."""

    noise: float
    period: float

    @property
    def mei(self):
        return self.noise * self.period


def measure_star(field, period, wave):
    """Period at which the crest of the wave keeps 90 %, and the noise of the crest beyond it.

    `field` is a `DisplacementField` or a `SmoothField`. What is kept is a polynomial in 1/period
    through all of the crest: a point alone is known to a few per cent only.
    """
    crest = field.valid & (np.abs(field.xy[:, 1] - 250) <= 2.5) & (period > SHORTEST)
    kept = field.v[crest] / wave[crest]
    through = np.polynomial.Polynomial.fit(1 / period[crest], kept, 6)
    every = np.geomspace(SHORTEST, 290, 2000)
    limit = every[np.flatnonzero(through(1 / every) < 0.9).max()]
    far = period[crest] > 1.3 * limit
    noise = np.std((kept - through(1 / period[crest]))[far]) / 2  # of a crest of 0.5 px
    return Efficiency(float(noise), float(limit))


def star_rows(folder):
    """Print noise × period at 10 % loss, lower is better: as the peers do it, and smoothed."""
    for subset, order, windows in ((21, 1, (11,)), (15, 1, (9,)), (21, 2, ()), (31, 2, ())):
        disp, period, wave = _star(folder, subset, order)
        fields = {f"order {order}": disp}
        fields |= {f"{n} points smoothed": dic.smooth(disp, n) for n in windows}
        for name, field in fields.items():
            star = measure_star(field, period, wave)
            yield (
                f"star 5, subset {subset}, {name}: MEI",
                f"{star.mei:.3f} = {1e3 * star.noise:.2f} mpx × {star.period:.1f} px",
                "≤ 0.34",
                star.mei <= 0.34,
            )
