"""Print what `dic` reaches: bias and scatter, real photographs, and the time of a frame.

Usage: ``python benchmarks/dic_bars.py [FOLDER]``. FOLDER holds ``open_hole`` and ``star5``,
pictures of others that are not in this repository; without it only what can be drawn here is
measured.
"""

import sys
import time
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.special import erf

import dic

SIDE = 512  # px
NOISE = 2.0  # grey levels
SPOT = 4.5 / np.sqrt(8 * np.log(2))  # px, standard deviation of a spot 4.5 px wide at half height


def speckle(shift, contrast=50.0, density=1 / 12):
    """Draw Gaussian spots moved by `shift` (2,) px, integrated over each pixel by erf: exact."""
    rng = np.random.default_rng(0)
    count = int((SIDE + 40) ** 2 * density)
    centres = rng.uniform(-20, SIDE + 20, (count, 2)) + shift
    heights = rng.choice([-1.0, 1.0], count) * contrast / np.sqrt(np.pi * SPOT**2 * density)
    edges = np.arange(SIDE + 1) - 0.5
    image = np.full((SIDE, SIDE), 128.0)
    for some in np.array_split(np.argsort(centres[:, 1]), 200):
        below = np.searchsorted(edges, centres[some, 1].min() - 8) - 1
        above = np.searchsorted(edges, centres[some, 1].max() + 8) + 1
        rows = slice(max(below, 0), min(above, SIDE))
        along, down = (
            np.diff(erf((edges[:, None] - centres[some, axis]) / (np.sqrt(2) * SPOT)), axis=0)
            for axis in (0, 1)
        )
        image[rows] += (down[rows] * heights[some]) @ along.T * (np.pi / 2 * SPOT**2)
    return image


def _motion_alone(inverse, order):
    """Variance of u per variance of noise, (N,), with the light held fixed: the full Hessian."""
    unknowns = np.array([0, 1, 2, 3, 4, 5, 6, 7] if order else [0, 3, 6, 7])
    hessian = np.linalg.inv(inverse[:, unknowns[:, None], unknowns])[:, :-2, :-2]
    return np.linalg.inv(hessian)[:, 0, 0]


def report_shifts():
    """Print bias and scatter of rigid shifts against their floor, for both orders."""
    rng, plain = np.random.default_rng(1), speckle((0.0, 0.0))
    print(f"rigid shifts, {SIDE}², subset 21, step 5; bias in mpx, scatter over the floor")
    for order in (0, 1):
        ref = dic.prepare(plain, order=order)
        floor = NOISE * np.sqrt(2 * np.mean(_motion_alone(ref.inverse, order)))
        for shift in np.arange(11) / 10:
            moved = speckle((shift, shift / 2))
            clean = dic.correlate(ref, moved)
            first, second = (i + rng.normal(0, NOISE, i.shape) for i in (plain, moved))
            noisy = dic.correlate(dic.prepare(first, order=order), second)
            print(
                f"  order {order}  shift {shift:.1f}"
                f"  bias {1e3 * np.nanmean(clean.u - shift):+.2f}"
                f" (noisy {1e3 * np.nanmean(noisy.u - shift):+.2f})  scatter"
                f" {1e3 * np.nanstd(noisy.u):.2f} = {np.nanstd(noisy.u) / floor:.3f} floors"
                f"  predicted {1e3 * np.nanmedian(noisy.sigma_u):.2f}"
            )


def seconds(work, repeats=7):
    """Median and spread of CPU time, s, after one warm-up."""
    work()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return np.median(times), np.ptp(times)


def report_times():
    """Print what a frame costs; the error stands in the shifts above."""
    rng = np.random.default_rng(2)
    plain = speckle((0.0, 0.0)) + rng.normal(0, NOISE, (SIDE, SIDE))
    moved = speckle((0.4, 0.2)) + rng.normal(0, NOISE, (SIDE, SIDE))
    ref = dic.prepare(plain)
    disp, wide = dic.correlate(ref, moved), dic.prepare(plain, subset=61)
    places = rng.uniform(40, SIDE - 40, (400, 2))
    few, many = (dic.prepare(plain, subset=31, points=places[:n]) for n in (72, 400))
    print(f"CPU time, {SIDE}², ms, median ± spread")
    for name, work in {
        "prepare, 21/5": lambda: dic.prepare(plain),
        "correlate from nothing": lambda: dic.correlate(ref, moved),
        "correlate from the last frame": lambda: dic.correlate(ref, moved, guess=disp),
        "from nothing, subset 61": lambda: dic.correlate(wide, moved),
        "strain, window 5": lambda: dic.strain(disp),
        "72 points, subset 31, guessed": lambda: dic.correlate(few, moved, np.full((72, 2), 0.3)),
        "400 points, subset 31, guessed": lambda: dic.correlate(
            many, moved, np.full((400, 2), 0.3)
        ),
    }.items():
        median, spread = seconds(work)
        print(f"  {name:32s} {1e3 * median:7.1f} ± {1e3 * spread:.1f}")


@dataclass(frozen=True)
class OpenHole:
    """How our displacements compare with those of another code (order 1, radius 16)."""

    points: int
    valid: float
    converged: float
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
    ours, theirs = disp.valid[place], other["convergence"] <= 1e-3
    both = ours & theirs
    rms = [np.sqrt(np.mean((getattr(disp, k)[place] - other[k])[both] ** 2)) for k in "uv"]
    return OpenHole(len(place), ours.mean(), theirs.mean(), *rms)


@dataclass(frozen=True)
class Star:
    """Error of v against the closed form; bands of period: low, high, rms error, rms σ, px."""

    valid: float
    bands: tuple[tuple[int, int, float, float], ...]
    rms: float


def compare_star(folder):
    """Compare star 5 of the DIC Challenge 2.0 with its truth, subset 21, order 1, step 5."""
    pair = [dic.read_image(folder / f"DIC_Challenge_Star_Noise_{n}.tiff") for n in ("Ref", "Def")]
    disp = dic.correlate(dic.prepare(pair[0]), pair[1])
    x, y = disp.xy.T
    period = 10 + 290 / 4000 * x
    error = disp.v - 0.5 * np.cos(2 * np.pi * (y - 250) / period)
    bands = []
    for low, high in pairwise((10, 20, 30, 40, 60, 80, 120, 200, 300)):
        some = disp.valid & (period >= low) & (period < high)
        bands.append((low, high, *(np.sqrt(np.mean(a[some] ** 2)) for a in (error, disp.sigma_v))))
    return Star(disp.valid.mean(), tuple(bands), np.sqrt(np.mean(error[disp.valid] ** 2)))


def report_photographs(folder):
    """Print both comparisons."""
    hole = compare_open_hole(folder / "open_hole")
    print(
        f"open hole: {hole.points} points of the other code, valid here {hole.valid:.1%}, "
        f"converged there {hole.converged:.1%}; "
        f"rms difference u {hole.rms_u:.4f} v {hole.rms_v:.4f} px"
    )
    star = compare_star(folder / "star5")
    print(f"star 5: valid {star.valid:.1%}; period px: rms error of v, rms predicted σ, px")
    for low, high, rms, sigma in star.bands:
        print(f"  {low:3d} to {high:3d}: {rms:.4f}  {sigma:.4f}")
    print(f"  whole picture: {star.rms:.4f}")


def main(folder: str | None = None) -> None:
    """Print every figure that can be had."""
    report_shifts()
    report_times()
    if folder is not None:
        report_photographs(Path(folder))


if __name__ == "__main__":
    main(*sys.argv[1:])
