"""Presses on the plate, out of images and a list of them: what they tell of the bench."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from math import hypot, inf, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

import models
from rig.calibration.bench_refusal import require_places
from rig.calibration.press_images import PressImages, read_press_images
from rig.calibration.store import Calibration
from rig.live.baseline import still_reference
from rig.live.bench import Bench, build_bench
from rig.live.chain import Chain
from rig.live.frame_estimate import STRANGE
from rig.live.known_bench import KnownBench
from rig.live.registration import (
    Registered,
    jumped,
    register,
    shown_fixed_pattern,
    strangeness,
)
from rig.scene import Scene
from rig.scene.sensing import PatternEstimator
from rig.system.arrays import F32, F64, Mask
from rig.system.timing import Stopwatch

PLACE, FORCE = 0.3, 0.02
"""Standard deviations of a place, mm, and of a force, as a fraction, that a list states."""

LARGEST = {"x_mm": 1e6, "y_mm": 1e6, "force_n": 1e6, "first_frame": 1e9, "last_frame": 1e9}
"""What no number of a list is beyond, in its unit."""
SMALLEST_FORCE = 1e-9  # N

COLUMNS = ("press", "first_frame", "last_frame", "x_mm", "y_mm", "force_n")
_START = 1.5  # N, where the force of a press is not known


@dataclass(frozen=True)
class Listed:
    """One press of a list: its frames, and what is known of place and force.

    Attributes
    ----------
    press : str
    frames : tuple of int
        First and last, counted from 0 over all images.
    place : tuple of float or None, mm
    force : float or None, N
    """

    press: str
    frames: tuple[int, int]
    place: tuple[float, float] | None
    force: float | None


def read_list(path: Path) -> list[Listed]:
    """Read a list of presses; place and force may be empty.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If a column or a number is missing, with its line.
    """
    with path.open(newline="", encoding="utf-8-sig") as file:
        rows = csv.DictReader(file)
        try:
            missing = [name for name in COLUMNS if name not in (rows.fieldnames or ())]
            named = [(f"'{path}' line {number}", row) for number, row in enumerate(rows, 2)]
        except (UnicodeDecodeError, csv.Error) as error:
            raise ValueError(f"'{path}' is no CSV in UTF-8 ({error}); save it as such") from None
    if missing:
        raise ValueError(
            f"'{path}' lacks the column {missing[0]}; its first line must hold {','.join(COLUMNS)}"
        )
    if not named:
        raise ValueError(f"'{path}' lists no press; write a line for each")
    return [_listed(row, where) for where, row in named]


def _listed(row: dict[str, str], where: str) -> Listed:
    first, last = (_frame(row, name, where) for name in ("first_frame", "last_frame"))
    x, y, force = (_number(row, name, where) for name in ("x_mm", "y_mm", "force_n"))
    if not first <= last:
        raise ValueError(
            f"{where}: frames must run from first_frame to last_frame, got {first} to {last};"
            " correct them there"
        )
    if (x is None) != (y is None):
        raise ValueError(f"{where}: x_mm and y_mm must both be given, or neither; correct it there")
    if force is not None and not force > SMALLEST_FORCE:
        raise ValueError(f"{where}: force_n must be positive, got {force:g} N; leave it empty")
    place = None if x is None or y is None else (x, y)
    return Listed(row["press"], (first, last), place, force)


def _frame(row: dict[str, str], name: str, where: str) -> int:
    value = _number(row, name, where)
    if value is None or value < 0 or not value.is_integer():
        raise ValueError(
            f"{where}: {name} must be the number of an image, from 0, got '{row[name]}'; correct it"
            " there"
        )
    return int(value)


def _number(row: dict[str, str], name: str, where: str) -> float | None:
    text = (row[name] or "").strip()
    if not text:
        return None
    try:
        value = float(text)
    except ValueError:
        value = nan
    if not abs(value) <= LARGEST[name]:
        raise ValueError(
            f"{where}: {name} must be a number of at most {LARGEST[name]:g}, or empty, got"
            f" '{text}'; correct it there"
        )
    return value


def identify_bench(
    scene: Scene,
    known: Calibration,
    listed: list[Listed],
    source: Path,
    free: tuple[str, ...],
    report: Callable[[int, int], None],
) -> models.BenchEstimate:
    """Find the bench of a scene from listed presses and the images of a folder or video.

    Raises
    ------
    OSError
        If an image is missing.
    ValueError
        If the scene cannot run live, a press is listed among the first images or something moves
        in them, or no touch is found where one is listed.
    """
    images = listed_images(scene, listed, source)
    bench = usual_bench(scene, known, report)
    chain = bench.prepare(still_reference(images.reference))[0]
    seen = list(zip(listed, images.means, strict=True))
    return identify_by_images(bench, chain, seen, free, report)


def listed_images(scene: Scene, listed: list[Listed], source: Path) -> PressImages:
    """Read the images of listed presses, and those before them, from a folder or video.

    Raises
    ------
    OSError
        If an image is missing.
    ValueError
        If the scene has no [dic], or a press is listed among the first images.
    """
    if scene.dic is None:
        raise ValueError(
            f"scene '{scene.title}' has no [dic] to see presses with; add it, as twin has it"
        )
    references = scene.dic.reference_frames
    _require_untouched(listed, references)
    return read_press_images(source, references, [one.frames for one in listed])


def _require_untouched(listed: list[Listed], reference_frames: int) -> None:
    """Refuse a press in the images that show the plate at rest."""
    for one in listed:
        if one.frames[0] < reference_frames:
            raise ValueError(
                f"press {one.press} begins with frame {one.frames[0]}, and the first"
                f" {reference_frames} images show the plate untouched (dic.reference_frames);"
                " correct the list"
            )


def identify_by_images(
    bench: Bench,
    chain: Chain,
    seen: Sequence[tuple[Listed, F32]],
    free: tuple[str, ...],
    report: Callable[[int, int], None],
) -> models.BenchEstimate:
    """Find a bench from presses and the mean image (H, W) of the frames of each.

    Parameters
    ----------
    bench : Bench
        That of `usual_bench`.
    chain : Chain
        Prepared for the reference that was taken before the presses.

    Raises
    ------
    ValueError
        If the bench is exact, no touch is found where one is listed, or most are found elsewhere.
    """
    chain = knowing_presses(chain, seen)
    shown = [(one, shown_press(chain, one, image)) for one, image in seen]
    return identify_shown(bench, chain, shown, free, report)


def identify_shown(
    bench: Bench,
    chain: Chain,
    shown: Sequence[tuple[Listed, ShownPress]],
    free: tuple[str, ...],
    report: Callable[[int, int], None],
) -> models.BenchEstimate:
    """Find a bench from presses and what the images of each show, see `identify_by_images`."""
    forward = chain.pattern.forward(chain.noise)
    if not isinstance(forward, models.BenchForward) or bench.known is None:
        raise ValueError("the bench has no estimator of kind 'pattern'; give the scene one")
    placed = [(one.place, each.touch[:2]) for one, each in shown if one.place is not None]
    places, found = np.array([place for place, _ in placed]), np.array([at for _, at in placed])
    require_places(places, found, bench.plate.size)
    frames = bench.reference_frames
    place = hypot(PLACE, 0.5 * bench.friction * bench.plate.thickness)
    presses = [_press(one, each, place, frames) for one, each in shown]
    look = KnownBench(bench.known, bench.camera).look(chain.pattern)
    names = free or tuple(name for name, _ in models.BENCH)
    known = replace(bench.known, fixed_pattern=chain.fixed_pattern.stated)
    return models.identify(forward, presses, known, look, names, report)


def usual_bench(scene: Scene, known: Calibration, report: Callable[[int, int], None]) -> Bench:
    """Build the bench before these presses."""
    return bench_as_known(scene, known.model_copy(update={"bench": None, "presses": None}), report)


def bench_as_known(scene: Scene, known: Calibration, report: Callable[[int, int], None]) -> Bench:
    """Build the bench as it is calibrated, or else a usual one, to measure single touches on."""
    estimator = scene.estimator
    if not isinstance(estimator, PatternEstimator):
        raise ValueError(
            f"scene '{scene.title}' estimates no touches from the whole pattern; set"
            " estimator.kind to 'pattern'"
        )
    usual = estimator.model_copy(update={"bench": "usual"})
    built = build_bench(scene.model_copy(update={"estimator": usual}), report, known)
    return replace(built, strain=False, max_touches=1)


class ShownPress(NamedTuple):
    """What the images of a press show.

    Attributes
    ----------
    touch : (3,) float64, mm, mm, N
    sigma : (3,) float64, mm, mm, N
        Standard deviations of the touch by the noise of one frame.
    seen : (m,) float64
        The whitened measurement.
    whitening : (m, K + U) float64
    moved : (R,) float64 or None
        By how much the camera has moved; see `models.Press`.
    errors : MotionErrors
        Of one frame.
    evident : bool
        Whether a frame like it would show a touch by itself, and not only where one is sought.
    hidden : (T,) bool
        Tiles that do not show the pattern.
    """

    touch: F64
    sigma: F64
    seen: F64
    whitening: F64
    moved: F64 | None
    errors: models.MotionErrors
    evident: bool
    hidden: Mask


def shown_press(chain: Chain, one: Listed, image: F32) -> ShownPress:
    """Measure a press in the mean of its frames, and find its touch wherever the list has it.

    Raises
    ------
    ValueError
        If the image cannot be used, or shows no touch.
    """
    return measured(chain, image, _start(one), one.press)


def _start(one: Listed) -> F64 | None:
    """Touch (1, 3) of a press as it is listed; None where its place is not known."""
    return None if one.place is None else np.array([[*one.place, one.force or _START]])


def knowing_presses(chain: Chain, seen: Iterable[tuple[Listed, F32]]) -> Chain:
    """Let a chain know what the images of all presses show of the sensor."""
    return with_fixed_pattern(chain, ((image, _start(one)) for one, image in seen))


def _press(one: Listed, shown: ShownPress, place: float, reference_frames: int) -> models.Press:
    """Return a press with what the list knows of it, a place to a standard deviation in mm."""
    (first, last), touch = one.frames, shown.touch.copy()
    if one.place is not None:
        touch[:2] = one.place
    if one.force is not None:
        touch[2] = one.force
    along = inf if one.place is None else place
    sigma = np.array([along, along, inf if one.force is None else FORCE * one.force])
    frames = last - first + 1, reference_frames
    return models.Press.of_frames(
        shown.seen, touch, sigma, frames, shown.whitening, shown.moved, shown.errors
    )


def measured(chain: Chain, image: F32, start: F64 | None, name: str) -> ShownPress:
    """Find the touch of an image, and what it is found by.

    The reference is moved to the image; where that of a strong touch would be lost, the start of
    one may be given, (1, 3). The touch is searched for everywhere.

    Raises
    ------
    ValueError
        If the image cannot be used, or shows no touch.
    """
    seen = _registered(chain, image, start)
    if seen.unusable_reason:
        raise ValueError(f"images of press {name} cannot be used: {seen.unusable_reason}")
    if not seen.settled:
        raise ValueError(
            f"images of press {name} move the pattern farther than it can be followed: it is found"
            f" {seen.off:.1f} px on; press less hard"
        )
    pattern, estimator = chain.masked_models.for_mask(seen.hidden)
    white = pattern.whiten(seen.right, chain.noise)
    estimate = estimator.fit_whitened(white, count=1)
    touch = np.column_stack([estimate.xy, estimate.force]).ravel()
    if touch.size != 3 or not touch[2] > 0:
        raise ValueError(f"no touch is found in the images of press {name}; press harder")
    whitening = np.ascontiguousarray(pattern.factor.T) / chain.noise
    moved = pattern.uncorrected(seen.motion)
    errors = chain.motion_errors(seen.motion, seen.hidden, seen.pixel_variance(chain.noise))
    sigma = np.sqrt(np.diag(estimate.touch_covariance(0)))
    evident = estimator.fit_whitened(white).count > 0
    return ShownPress(touch, sigma, white, whitening, moved, errors, evident, seen.hidden)


def with_fixed_pattern(chain: Chain, images: Iterable[tuple[F32, F64 | None]]) -> Chain:
    """Let a chain know what images show of the sensor, each with a start as `measured` takes it."""
    fixed = chain.fixed_pattern
    for image, start in images:
        with suppress(ValueError):  # an image that cannot be used is named where it is measured
            fixed = fixed.with_frame(shown_fixed_pattern(chain, _registered(chain, image, start)))
    return replace(chain, fixed_pattern=fixed)


def _registered(chain: Chain, image: F32, start: F64 | None) -> Registered:
    """Move the reference to an image; the camera may have jumped since, or the plate moved far."""
    still, watch = chain.pattern.still(), Stopwatch(lambda: 0.0)
    seen = register(chain, image, still, watch)
    if seen.hidden_fraction <= STRANGE:
        return seen
    starts = [jumped(chain, image, still, watch)]
    if start is not None:
        pressed = still.copy()
        motions = chain.pattern.motions
        pressed[: motions.fields] = motions.modal_amplitudes(start[:, :2], start[:, 2])
        starts.append(pressed)
    others = [register(chain, image, moved, watch) for moved in starts]
    return min(seen, *others, key=strangeness)
