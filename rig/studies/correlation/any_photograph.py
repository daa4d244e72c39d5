"""Correlation on images that others made: printed patterns, bad cameras, periods, cracks, refusals.

Parts: prints, dim, cameras, periods, cracks, unusable. Every image is drawn exactly; pyvale (extra
``peers``) stands beside the printed patterns where it is installed. The prefilter is what the
engine chooses; "unfiltered" is the same without one.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

import dic
from rig.report.figure import Bar, Figure, at_least, at_most
from rig.studies.correlation.bars import SIGMAS
from rig.studies.correlation.images import displacement, eight_bit, speckle
from rig.studies.correlation.peers import pyvale_field
from rig.studies.correlation.prints import Print, draw, motion, prints
from rig.studies.study import cpu_seconds, line, rms, run
from rig.system.arrays import F64, AnyArray, Grey

SIDE = 512  # px
SHAPE = (400, 512)  # px, of a print
FIELDS = {"shear": (0.01, 0.0, 1.0, 1.0), "plate": (0.0, 0.005, 240.0, 190.0)}
NOISE = 2.0  # grey levels
HONEST = Bar(0.9, 1.15)  # error over stated σ
SHIFT, STRETCH = (0.4, -0.3), (1.004, 0.997)  # every fraction of a px
WRONG = 0.1  # px, of a point across a crack
DARK = 40.0  # grey level in a crack


@dataclass(frozen=True)
class _Printed:
    """One pattern in one field: rms errors in px, and how many points are wrong by over 5 σ."""

    pattern: str
    found: dic.DisplacementField
    off: F64
    unfiltered: float
    peer: float | None

    @property
    def error(self) -> float:
        return rms(self.off)

    @property
    def in_sigma(self) -> F64:
        return (
            np.abs(self.off)
            / np.column_stack([self.found.sigma_u, self.found.sigma_v])[self.found.valid]
        )

    @property
    def beyond(self) -> int:
        return int((self.in_sigma > SIGMAS).any(axis=1).sum())

    def figures(self) -> Iterator[Figure]:
        yield from line(
            "Patterns as printed",
            self.pattern,
            prefilter=(self.found.prefilter, "px"),
            valid=(100 * float(self.found.valid.mean()), "%"),
            error=(1e3 * self.error, "mpx, rms"),
            error_over_σ=rms(self.in_sigma),
            beyond_5_σ=(self.beyond, "valid points"),
            unfiltered=(1e3 * self.unfiltered, "mpx, rms"),
            pyvale=(self.peer and 1e3 * self.peer, "mpx, rms"),
        )


def printed() -> Iterator[Figure]:
    """Sixteen printed patterns, two fields: error, and beside what the peer and no filter make."""
    rows: dict[float, list[_Printed]] = {0.0: [], NOISE: []}
    for pattern in prints():
        still = draw(pattern, SHAPE)
        for name, field in FIELDS.items():
            moved = draw(pattern, SHAPE, field)
            for noise, found in rows.items():
                found.append(_printed(pattern, (still, moved), name, noise))
                yield from found[-1].figures()
    for noise, found in rows.items():
        yield from _worst(found, noise)


def _worst(rows: list[_Printed], noise: float) -> Iterator[Figure]:
    """Sum up the patterns: the worst beside the peer, and beside no filter where that is better."""
    over = [row.error / row.peer for row in rows if row.peer]
    kept = [row for row in rows if row.peer and row.unfiltered < row.peer]
    yield from line(
        "16 patterns as printed",
        f"noise {noise:g}",
        rms_over_pyvale_worst=(max(over, default=None), "", at_most(1.1), len(over)),
        beyond_5_σ=(
            sum(row.beyond for row in rows),
            "valid points",
            at_most(0),
            sum(len(row.off) for row in rows),
        ),
        rms_over_unfiltered_where_that_is_better=(
            max((row.error / row.unfiltered for row in kept), default=None),
            "",
            at_most(1),
            len(kept),
        ),
    )


def _printed(pattern: Print, images: tuple[F64, F64], name: str, noise: float) -> _Printed:
    rng, field = np.random.default_rng(1), FIELDS[name]
    first, second = (eight_bit(image, noise, rng) for image in images)
    found = dic.correlate(dic.prepare(first), second)
    plain = dic.correlate(dic.prepare(first, prefilter=0), second)
    peer = pyvale_field(first, second, 1, repeats=1)
    theirs = None if peer is None else peer.moved - motion(SHAPE, peer.xy, field)
    return _Printed(
        f"{pattern.name}, {name}, noise {noise:g}",
        found,
        _off(found, name),
        rms(_off(plain, name)),
        None if theirs is None else rms(theirs[np.isfinite(theirs).all(axis=1)]),
    )


def _off(found: dic.DisplacementField, name: str) -> F64:
    off = np.column_stack([found.u, found.v]) - motion(SHAPE, found.xy, FIELDS[name])
    return off[found.valid]


def dim() -> Iterator[Figure]:
    """Correlate a dim and a noisy image with large subsets."""
    plain, moved = speckle(SIDE), speckle(SIDE, SHIFT, STRETCH)
    for case, contrast, noise in (("noise 20", 56.0, 20.0), ("contrast 4", 4.0, 2.0)):
        rng = np.random.default_rng(20)
        first, second = (
            eight_bit(128 + contrast / 56 * (image - 128), noise, rng) for image in (plain, moved)
        )
        for subset in (21, 31, 41):
            found = dic.correlate(dic.prepare(first, subset), second)
            held = subset == 31
            yield from line(
                "Dim and noisy images",
                f"{case}, subset {subset}",
                valid=(100 * float(found.valid.mean()), "%", at_least(95) if held else None),
                error_over_σ=(_over_sigma(found), "", at_most(1.1) if held else None),
                error=(1e3 * rms(_errors(found)), "mpx, rms"),
                prefilter=(found.prefilter, "px"),
            )


def _errors(found: dic.DisplacementField) -> F64:
    off = np.column_stack([found.u, found.v]) - displacement(SIDE, found.xy, SHIFT, STRETCH)
    return off[found.valid]


def _over_sigma(found: dic.DisplacementField) -> float:
    spread = np.column_stack([found.sigma_u, found.sigma_v])[found.valid]
    return rms(_errors(found) / spread)


def _jpeg(quality: int) -> Callable[[AnyArray, np.random.Generator], Grey]:
    def pack(image: AnyArray, rng: np.random.Generator) -> Grey:
        done, packed = cv2.imencode(
            ".jpg", eight_bit(image, NOISE, rng), [cv2.IMWRITE_JPEG_QUALITY, quality]
        )
        if not done:
            raise OSError("OpenCV could not write a JPEG; install it with JPEG support")
        return np.asarray(cv2.imdecode(packed, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)

    return pack


def _dirty(image: AnyArray, rng: np.random.Generator) -> Grey:
    """Dirt of 6 grey levels on the sensor, the same in every image."""
    spots = np.random.default_rng(66).normal(size=image.shape)
    dirt = cv2.GaussianBlur(spots, (0, 0), 2.0)
    return eight_bit(image + 6 * dirt / dirt.std(), NOISE, rng)


def _shot(image: AnyArray, rng: np.random.Generator) -> Grey:
    """Electrons: 10 of them a grey level, and a read noise of one grey level."""
    seen = rng.poisson(10 * np.maximum(image, 0)) / 10
    return eight_bit(seen, 1.0, rng)


def _gamma(image: AnyArray, rng: np.random.Generator) -> Grey:
    noisy = np.clip(image + rng.normal(0, NOISE, image.shape), 0, 255)
    return eight_bit(255 * (noisy / 255) ** (1 / 2.2))


CAMERAS: Mapping[str, Callable[[AnyArray, np.random.Generator], Grey]] = {
    "as it is": lambda image, rng: eight_bit(image, NOISE, rng),
    "JPEG 80": _jpeg(80),
    "JPEG 50": _jpeg(50),
    "JPEG 20": _jpeg(20),
    "fixed pattern of the sensor": _dirty,
    "shot noise": _shot,
    "gamma 2.2": _gamma,
}


CAMERA_SEEDS = range(30, 34)  # of the noise
STILLS = 9


def cameras() -> Iterator[Figure]:
    """Error over stated σ where noise is not white, or not the same everywhere.

    Of one image as the reference, and of the mean of several.
    """
    plain, moved = speckle(SIDE), speckle(SIDE, SHIFT, STRETCH)
    for name, see in CAMERAS.items():
        for stills in (1, STILLS):
            seen: list[dic.DisplacementField] = []
            for seed in CAMERA_SEEDS:
                rng = np.random.default_rng(seed)
                images = [see(plain, rng) for _ in range(stills)]
                several = dic.prepare_stills(images) if stills > 1 else dic.prepare(images[0])
                seen.append(dic.correlate(several, see(moved, rng)))
            yield from _of_camera(name if stills == 1 else f"{name}, {stills} stills", seen)


def _of_camera(name: str, seen: list[dic.DisplacementField]) -> Iterator[Figure]:
    yield from line(
        "Cameras whose noise is not white",
        name,
        error_over_stated_σ=(
            rms([_over_sigma(found) for found in seen]),
            "",
            HONEST,
            sum(int(found.valid.sum()) for found in seen),
        ),
        error=(1e3 * rms([rms(_errors(found)) for found in seen]), "mpx, rms"),
        valid=(100 * float(np.mean([found.valid.mean() for found in seen])), "%"),
    )


def tiled(period: float, shift: tuple[float, float], seed: int = 5) -> F64:
    """Draw spots that repeat after `period` px along both axes, (SIDE, SIDE), grey levels."""
    rng, width = np.random.default_rng(seed), 1.8
    count = int(period**2 / 12)
    centres = rng.uniform(0, period, (count, 2))
    heights = rng.choice([-1.0, 1.0], count) * 56 / np.sqrt(np.pi * width**2 / 12)
    along, down = (_wrapped(a, shift[a], centres, period, width) for a in (0, 1))
    return np.asarray(128 + (down * heights) @ along.T, dtype=np.float64)


def _wrapped(axis: int, shift: float, centres: F64, period: float, width: float) -> F64:
    away = np.arange(SIDE)[:, None] - shift - centres[:, axis]
    away = (away + period / 2) % period - period / 2
    return np.exp(-(away**2) / (2 * width**2))


def grid_lines(period: float, shift: tuple[float, float]) -> F64:
    """Draw a grid of two waves, (SIDE, SIDE), grey levels."""
    waves = [np.cos(2 * np.pi * (np.arange(SIDE) - s) / period) for s in shift]
    return np.asarray(128 + 50 * (waves[1][:, None] + waves[0]), dtype=np.float64)


def periods() -> Iterator[Figure]:
    """Patterns with a period: points that are wrong by a px or more and valid."""
    for name, make, period in (("printed tiles", tiled, 64.0), ("a grid", grid_lines, 16.0)):
        for shift in ((0.4, 0.2), (10.0, 3.0), (40.0, 3.0)):
            rng = np.random.default_rng(40)
            first, second = (eight_bit(make(period, s), NOISE, rng) for s in ((0.0, 0.0), shift))
            reference = dic.prepare(first)
            alone = dic.correlate(reference, second)
            near = dic.correlate(reference, second, np.tile(np.rint(shift), (len(alone.xy), 1)))
            wrong = [_wrong_by_a_px(field, shift) for field in (alone, near)]
            yield from line(
                "Patterns with a period",
                f"{name} of {period:g} px, moved by {shift[0]:g}, {shift[1]:g} px",
                wrong_and_valid=(wrong[0], "%", at_most(1)),
                ambiguous=(100 * float((alone.status == dic.Status.AMBIGUOUS).mean()), "%"),
                wrong_and_valid_from_a_guess=(wrong[1], "%", at_most(1)),
                valid_from_a_guess=(100 * float(near.valid.mean()), "%"),
            )


def _wrong_by_a_px(field: dic.DisplacementField, shift: tuple[float, float]) -> float:
    off = np.hypot(field.u - shift[0], field.v - shift[1])
    return 100 * float((field.valid & (off > 1)).mean())


def cracked(shift: tuple[float, float], angle: float) -> F64:
    """Draw a plate whose right half has moved away, a dark gap between, (SIDE, SIDE)."""
    y, x = np.mgrid[:SIDE, :SIDE] - (SIDE - 1) / 2
    normal = np.array([np.cos(angle), np.sin(angle)])
    left, right, fine = np.zeros_like(x), np.zeros_like(x), (np.arange(6) + 0.5) / 6 - 0.5
    for dx in fine:
        for dy in fine:
            along = (x + dx) * normal[0] + (y + dy) * normal[1]
            left += (along < 0) / 36
            right += (along >= max(float(np.dot(shift, normal)), 0.0)) / 36
    return left * speckle(SIDE) + right * speckle(SIDE, shift) + (1 - left - right) * DARK


CRACK_SEEDS = range(50, 54)  # of the noise


def cracks() -> Iterator[Figure]:
    """Subsets across a crack that opens or slides: wrong by more than 0.1 px, and valid."""
    for name, shift, angle in (
        ("opens by 0.5 px", (0.5, 0.0), 0.0),
        ("opens by 1 px", (1.0, 0.0), 0.0),
        ("opens by 0.7 px, 29° off", (0.61, 0.34), 0.5),
        ("slides by 0.5 px", (0.0, 0.5), 0.0),
        ("slides by 1 px", (0.0, 1.0), 0.0),
        ("slides by 1 px, 29° off", (-0.48, 0.88), 0.5),
    ):
        for noise in (NOISE, 5.0):
            yield from _crack(name, shift, angle, noise)


def _crack(name: str, shift: tuple[float, float], angle: float, noise: float) -> Iterator[Figure]:
    images = speckle(SIDE), cracked(shift, angle)
    seen = [_beside_crack(images, shift, angle, noise, seed) for seed in CRACK_SEEDS]
    wrong, broken, elsewhere = (np.concatenate(part) for part in zip(*seen, strict=True))
    yield from line(
        "Subsets across a crack",
        f"{name}, noise {noise:g}",
        wrong_and_valid=(100 * float(wrong.mean()), "%", at_most(2), len(wrong)),
        broken=(100 * float(broken.mean()), "%"),
        valid_elsewhere=(100 * float(elsewhere.mean()), "%"),
    )


def _beside_crack(
    images: tuple[F64, F64], shift: tuple[float, float], angle: float, noise: float, seed: int
) -> tuple[AnyArray, AnyArray, AnyArray]:
    """Which subsets across a crack are wrong and valid, and BROKEN; and valid ones elsewhere."""
    rng = np.random.default_rng(seed)
    first, second = (eight_bit(image, noise, rng) for image in images)
    found = dic.correlate(dic.prepare(first), second)
    normal = np.array([np.cos(angle), np.sin(angle)])
    beyond = (found.xy - (SIDE - 1) / 2) @ normal
    truth = np.where(beyond[:, None] < 0, 0.0, np.array(shift))
    off = np.linalg.norm(np.column_stack([found.u, found.v]) - truth, axis=1)
    across = np.abs(beyond) <= found.subset // 2 * np.abs(normal).sum()
    inside = np.abs(found.xy - (SIDE - 1) / 2).max(axis=1) < SIDE / 2 - found.subset
    wrong, broken = found.valid & (off > WRONG), found.status == dic.Status.BROKEN
    return wrong[across], broken[across], found.valid[~across & inside]


def unusable() -> Iterator[Figure]:
    """CPU time of frames that cannot be used, over that of a good one."""
    rng = np.random.default_rng(60)
    first, second = (eight_bit(speckle(SIDE, s), NOISE, rng) for s in ((0.0, 0.0), SHIFT))
    reference = dic.prepare(first)
    good = _seconds(reference, second)
    for name, frame in _useless(rng):
        found = dic.correlate(reference, frame)
        yield from line(
            "Frames that cannot be used",
            name,
            time_over_that_of_a_good_one=(_seconds(reference, frame) / good, "", at_most(3)),
            valid=(100 * float(found.valid.mean()), "%"),
        )


def _useless(rng: np.random.Generator) -> Iterator[tuple[str, NDArray[np.uint8]]]:
    moved = speckle(SIDE, SHIFT)
    for blur in (3.0, 5.0):
        blurred = np.asarray(cv2.GaussianBlur(moved, (0, 0), blur), dtype=np.float64)
        yield f"out of focus by {blur:g} px", eight_bit(blurred, NOISE, rng)
    yield "black", np.zeros((SIDE, SIDE), np.uint8)
    yield "white", np.full((SIDE, SIDE), 255, np.uint8)
    yield "another pattern", eight_bit(speckle(SIDE, seed=9), NOISE, rng)
    yield "noise alone", rng.integers(0, 256, (SIDE, SIDE), dtype=np.uint8)


def _seconds(reference: dic.Reference, frame: AnyArray) -> float:
    dic.correlate(reference, frame)  # what compiles does so before
    return cpu_seconds(lambda: dic.correlate(reference, frame), 5)


PARTS = {
    "prints": printed,
    "dim": dim,
    "cameras": cameras,
    "periods": periods,
    "cracks": cracks,
    "unusable": unusable,
}

if __name__ == "__main__":
    cv2.setNumThreads(1)
    run(PARTS, __doc__)
