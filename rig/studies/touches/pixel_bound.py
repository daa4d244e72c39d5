"""The bound of Cramér and Rao that every pixel sets, beside derivatives of rendered images.

Parts: bound. Truth is the image itself, rendered exactly without noise: it is differentiated
numerically along the motion of place and force of each touch, by shift, turn and scale of the
image and by gain and offset of the light, and the information of all pixels is inverted. Plates are
bent on a grid of equal elements that no bound knows, and their motion is given to the renderer at
every pixel: near edges a cubic over its usual 8 px is too coarse. Touches lie 5 mm from an edge,
5 mm from both edges of a corner, and in pairs 20 mm apart anywhere.
"""

from collections.abc import Callable, Iterator

import numpy as np

import fe
import models
from rig.report.figure import Bar, Figure, at_most
from rig.studies.study import line, run
from rig.studies.touches.pattern import EDGES, MODES, NOISE, SENSOR, Bench, stand
from rig.system.arrays import F64

THICKNESS, PIXELS = 2.0, 1024
NEAR, APART, INSET = 5.0, 20.0, 30.0  # mm
FORCES = (1.0, 4.0)  # N
ELEMENTS = 254  # so that a line of them lies 5 mm from each edge
SPACING = 1  # px
DRAWN = 4  # of each kind and of each plate
STEPS = (0.2, 0.2, 0.1)  # mm, mm, N
SHIFT, SLANT = 0.2, 0.25  # px; largest slope of a ray
BAR = at_most(1.0)
TABLE = "Bound of all pixels against derivatives of rendered images"


def bound() -> Iterator[Figure]:
    """Compare standard deviations of x, y and F, in parts of those by derivatives."""
    every: list[F64] = []
    for edges, clamped in EDGES.items():
        bench = stand(THICKNESS, PIXELS, clamped, SPACING)
        still = bench.light(np.zeros((len(bench.warper.points), 3)))
        span = (SENSOR.white - SENSOR.black) * SENSOR.top
        height = bench.camera.face_height(THICKNESS)
        pattern = models.pixel_level(
            fe.modes(bench.plate, MODES), bench.camera, height, span * still
        )
        solver = fe.Linear(bench.plate, fe.grid(bench.plate, ELEMENTS))
        for kind, scenes in drawn().items():
            true = [_deviations(by_derivatives(bench, solver, span, touches)) for touches in scenes]
            off = [
                _deviations(pixel_bound(bench, span * still, touches)) / least - 1.0
                for touches, least in zip(scenes, true, strict=True)
            ]
            modal = [
                _deviations(models.cramer_rao(pattern, touches, NOISE)) / least - 1.0
                for touches, least in zip(scenes, true, strict=True)
            ]
            every += off
            case = f"{edges} clamped edges, {kind}"
            yield from _line(case, off, None)
            yield from _line(f"{case}, by {MODES} modes", modal, None)
    yield from _line("5 mm from edges, in corners, and pairs at 20 mm", every, BAR)


def _deviations(covariance: F64) -> F64:
    return np.sqrt(np.diag(covariance))


def pixel_bound(bench: Bench, image: F64, touches: F64) -> F64:
    """Give the bound that is on trial."""
    height = bench.camera.face_height(THICKNESS)
    return models.pixel_bound(bench.plate, bench.camera, height, image, touches, NOISE)


def _line(case: str, off: list[F64], bar: Bar | None) -> Iterator[Figure]:
    parts = 100.0 * np.abs(np.concatenate(off))
    yield from line(
        TABLE,
        case,
        off=(float(parts.max()), "%", bar, len(off)),
        **{"off, median": (float(np.median(parts)), "%", None, len(parts))},
    )


def drawn() -> dict[str, list[F64]]:
    """Touches (n, 3) of each kind, mm, mm, N."""
    rng, side = np.random.default_rng(21), 254.0
    scenes: dict[str, list[F64]] = {"near an edge": [], "in a corner": [], "pairs": []}
    for number in range(DRAWN):
        along = rng.uniform(INSET, side - INSET)
        near = NEAR if number % 2 else side - NEAR
        place = (near, along) if number % 4 < 2 else (along, near)
        scenes["near an edge"].append(np.array([[*place, rng.uniform(*FORCES)]]))
        corner = np.where(rng.random(2) < 0.5, NEAR, side - NEAR)
        scenes["in a corner"].append(np.array([[*corner, rng.uniform(*FORCES)]]))
        turn = rng.uniform(0.0, 2.0 * np.pi)
        aside = 0.5 * APART * np.array([np.cos(turn), np.sin(turn)])
        middle = rng.uniform(INSET, side - INSET, 2)
        places = np.array([middle - aside, middle + aside])
        scenes["pairs"].append(np.column_stack([places, rng.uniform(*FORCES, 2)]))
    return scenes


def by_derivatives(bench: Bench, solver: fe.Linear, span: float, touches: F64) -> F64:
    """Least covariance (3n, 3n) by derivatives of rendered images, mm and N."""
    points = bench.warper.points

    def moved(at: F64) -> F64:
        pressed = [fe.Touch(*touch) for touch in at.tolist()]
        return solver.deflect(pressed).displacement(points, bench.camera.face)

    here, columns = moved(touches), list[F64]()
    for index in np.ndindex(touches.shape):
        step: F64 = np.zeros(touches.shape)
        step[index] = STEPS[index[1]]
        ends = moved(touches + step) - moved(touches - step)
        columns.append(_along(bench, here, ends / (2.0 * float(step[index]))))
    columns += [_by_shift(bench, here, axis) for axis in (0, 1)]
    x, y = (points[:, :2] - 0.5 * np.array(bench.plate.size)).T
    none = np.zeros_like(x)
    turn: F64 = np.column_stack([-y, x, none])
    growth: F64 = np.column_stack([x, y, none])
    columns += [_along(bench, here, turn), _along(bench, here, growth)]
    image = bench.light(here)
    columns += [image, np.ones_like(image)]
    slopes = span * np.array([column.ravel() for column in columns])
    units = np.linalg.norm(slopes, axis=1)
    information = slopes @ slopes.T / np.outer(units, units)
    covariance = np.linalg.inv(information) / np.outer(units, units)
    return NOISE**2 * covariance[: touches.size, : touches.size]


def _by_shift(bench: Bench, moved: F64, axis: int) -> F64:
    """Differentiate the image by a shift, per px."""
    one = np.eye(2)[axis]

    def shifted(step: float) -> F64:
        return bench.light(moved, (float(step * one[0]), float(step * one[1])))

    return _derivative(shifted, SHIFT)


def _along(bench: Bench, moved: F64, field: F64) -> F64:
    """Differentiate the image along a displacement field (K, 3), by steps of about `SHIFT` px."""
    across, normal = np.abs(field[:, :2]).max(), np.abs(field[:, 2]).max()
    pixel = max(bench.plate.size) / PIXELS
    step = float(SHIFT * pixel / max(across, SLANT * normal))
    return _derivative(lambda t: bench.light(moved + t * field), step)


def _derivative(image: Callable[[float], F64], step: float) -> F64:
    """Differentiate at 0, to the fourth order: small steps would show how images are rounded."""
    near, far = image(step) - image(-step), image(2.0 * step) - image(-2.0 * step)
    return (8.0 * near - far) / (12.0 * step)


PARTS = {"bound": bound}

if __name__ == "__main__":
    run(PARTS, __doc__)
