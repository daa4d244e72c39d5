"""What a calibration holds of each part, and which numbers of it can be.

A file that someone edited, or that a disk has damaged, is refused where a number is none that a
bench can have: bounds are wide, by a factor of ten or more beyond any bench that works.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

import numpy as np
from pydantic import (
    AfterValidator,
    AwareDatetime,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
)
from pydantic_core import PydanticCustomError

from rig.calibration.found_on import FoundOn
from rig.scene.quantity import LARGEST_SIDE, Count
from rig.scene.section import Section

LARGE = 1e9  # of any number for which nothing nearer is known
NEAREST, FARTHEST = 1.0, 1e5  # mm from a camera to a plate
FLAT = 1e-9  # of the largest number of a matrix, that counts as zero
Number = Annotated[float, Field(ge=-LARGE, le=LARGE)]
Spread = Annotated[float, Field(ge=0, le=LARGE)]
Row = tuple[Number, ...]
Rows = tuple[Row, ...]
Side = Annotated[Count, Field(ge=1, le=LARGEST_SIDE)]


def _refusal(wanted: str) -> PydanticCustomError:
    return PydanticCustomError("matrix", "give {wanted}", {"wanted": wanted})


def _shaped(height: int, width: int) -> Callable[[Rows], Rows]:
    """Refuse rows that are no matrix of a shape."""

    def check(rows: Rows) -> Rows:
        if [len(row) for row in rows] != [width] * height:
            raise _refusal(f"{height} × {width} numbers")
        return rows

    return check


def _rigid(rows: Rows) -> Rows:
    """Refuse what is no turn and shift."""
    matrix = np.array(rows)
    turn = matrix[:3, :3]
    turns = np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) and np.linalg.det(turn) > 0
    if not turns or not np.allclose(matrix[3], (0, 0, 0, 1), atol=1e-9):
        raise _refusal("a turn and a shift: a rotation of 3 × 3, and 0, 0, 0, 1 in the last row")
    return rows


def _before_camera(rows: Rows) -> Rows:
    """Refuse a plate that lies behind or within a camera, or farther off than any."""
    x, y, z = (row[3] for row in rows[:3])
    if not (NEAREST <= z <= FARTHEST and max(abs(x), abs(y)) <= FARTHEST):
        raise _refusal(f"a shift that puts the plate {NEAREST:g} to {FARTHEST:g} mm before it")
    return rows


def _sure_pose(rows: Rows) -> Rows:
    """Refuse a covariance by which the plate could lie anywhere."""
    turns, shifts = np.split(np.diag(np.array(rows)), 2)
    if turns.max() > np.pi**2 or shifts.max() > FARTHEST**2:
        raise _refusal(f"standard deviations up to π rad and {FARTHEST:g} mm")
    return rows


def _covariance(rows: Rows) -> Rows:
    """Refuse what is not symmetric or has a negative variance in any direction."""
    matrix = np.array(rows)
    largest = np.abs(matrix).max(initial=0.0)
    if not np.allclose(matrix, matrix.T, rtol=0, atol=1e-6 * largest):
        raise _refusal("a covariance, which is symmetric")
    if np.linalg.eigvalsh(matrix).min(initial=0.0) < -1e-6 * largest:
        raise _refusal("a covariance, which has no negative variance")
    return rows


def _invertible(rows: Rows) -> Rows:
    """Refuse a map of the plate that puts all of it on a line."""
    matrix = np.array(rows)
    singular = np.linalg.svd(matrix / np.maximum(np.abs(matrix).max(), FLAT), compute_uv=False)
    if singular[-1] < FLAT:
        raise _refusal("a map that can be inverted")
    return rows


def _near_identity(rows: Rows) -> Rows:
    """Refuse a map that mirrors the plate, or makes it ten times larger or smaller."""
    linear = np.array(rows)[:, :2]
    singular = np.linalg.svd(linear, compute_uv=False)
    if np.linalg.det(linear) <= 0 or singular[0] > 10 or singular[-1] < 0.1:
        raise _refusal("a map of the plate onto itself: no mirror, factors of 0.1 to 10")
    return rows


class Dated(Section):
    """What every part of a calibration says of itself."""

    model_config = ConfigDict(strict=True)

    date: AwareDatetime = Field(description="when it was made, UTC")
    residual: Spread = Field(default=0.0, description="RMS of its fit, px; a fraction for noise")

    @field_validator("date")
    @classmethod
    def _of_this_age(cls, date: AwareDatetime) -> AwareDatetime:
        if not 2000 <= date.year < 2200:
            raise PydanticCustomError("date", "give a date from 2000 on")
        return date


class Entry(Dated):
    """A part whose error is known."""

    error: Spread = Field(
        description="what it leaves, mm; s for the latency, N for creep, else a ratio"
    )


class LensEntry(Entry):
    """A lens."""

    size: tuple[Side, Side] = Field(description="width and height, px")
    focal: float = Field(ge=1, le=1e6, description="focal length, px")
    sigma_focal: Spread = Field(description="its standard deviation, px")
    centre: tuple[Number, Number] = Field(description="principal point, px")
    distortion: tuple[Number, Number, Number, Number, Number] = Field(
        description="k1, k2, p1, p2, k3"
    )
    covariance: (
        Annotated[Rows, AfterValidator(_shaped(8, 8)), AfterValidator(_covariance)] | None
    ) = Field(None, description="of ln focal, centre, px, k1, k2, p1, p2, k3; None in older files")

    @field_validator("sigma_focal")
    @classmethod
    def _known(cls, sigma: float, info: ValidationInfo) -> float:
        if sigma > info.data.get("focal", LARGE):
            raise _refusal("no more than the focal length itself")
        return sigma

    @field_validator("distortion")
    @classmethod
    def _keeps_corners(cls, distortion: Row, info: ValidationInfo) -> Row:
        """Refuse a lens that would fold its image."""
        if not {"size", "focal", "centre"} <= info.data.keys():
            return distortion
        ends = np.array([(0.0, 0.0), info.data["size"]])
        x, y = np.abs(ends - info.data["centre"]).max(axis=0) / info.data["focal"]
        k1, k2, p1, p2, k3 = distortion
        square = float(x * x + y * y)
        moved = abs(((k3 * square + k2) * square + k1) * square)
        if moved + 3.0 * (abs(p1) + abs(p2)) * np.sqrt(square) > 1.0:
            raise _refusal("numbers that move a corner of the image by less than it lies off")
        return distortion


class PoseEntry(Entry):
    """Where the plate lies before the camera; it holds for its lens alone."""

    T_cam_plate: Annotated[
        Rows, AfterValidator(_shaped(4, 4)), AfterValidator(_rigid), AfterValidator(_before_camera)
    ] = Field(description="from plate to camera, 4 × 4, mm")
    covariance: Annotated[
        Rows, AfterValidator(_shaped(6, 6)), AfterValidator(_covariance), AfterValidator(_sure_pose)
    ] = Field(description="of turn, rad, and shift, mm, 6 × 6")


class ProjectorEntry(Entry):
    """Where the projector's light falls."""

    size: tuple[Side, Side] = Field(description="width and height, px")
    T_px_plate: Annotated[Rows, AfterValidator(_shaped(3, 3)), AfterValidator(_invertible)] = Field(
        description="from the touched face, mm, to px, 3 × 3"
    )
    strength: float = Field(0.0, ge=0, le=1e4, description="its white over the light of the room")
    black: float = Field(0.0, ge=-255, le=65535, description="grey level without any light")


class NoiseEntry(Entry):
    """Noise of the camera."""

    gain: float = Field(gt=0, le=1e4, description="grey levels per electron")
    read: float = Field(ge=0, le=65535, description="standard deviation in the dark, grey levels")


class LatencyEntry(Entry):
    """Delay from a command to the first frame that shows it."""

    median: float = Field(ge=0, le=60, description="s")
    p95: float = Field(ge=0, le=60, description="s")

    @field_validator("p95")
    @classmethod
    def _above(cls, p95: float, info: ValidationInfo) -> float:
        if p95 < info.data.get("median", 0.0):
            raise _refusal("no less than the median")
        return p95


class DampingEntry(Entry):
    """How the plate rings, from a tap."""

    density: float = Field(
        gt=0, le=1e5, description="with which the modes have the frequencies seen, kg/m³"
    )
    damping: float = Field(gt=0, lt=0.5, description="ratio to critical damping")


class CreepEntry(Entry):
    """How the plate creeps, from a press that was held."""

    parts: tuple[Annotated[float, Field(ge=0, lt=0.5)], ...] = Field(
        description="what each term adds to the deflection in the end, parts of it"
    )
    times: tuple[Annotated[float, Field(gt=0, le=LARGE)], ...] = Field(
        description="of each term, s"
    )

    @field_validator("times")
    @classmethod
    def _one_a_part(cls, times: tuple[float, ...], info: ValidationInfo) -> tuple[float, ...]:
        count = len(info.data.get("parts", ()))
        if len(times) != count:
            raise _refusal(f"{count} times, one for each part")
        return times


class PressesEntry(Entry):
    """What known presses correct."""

    matrix: Annotated[Rows, AfterValidator(_shaped(2, 3)), AfterValidator(_near_identity)] = Field(
        description="affine map of places, 2 × 3, mm"
    )
    gain: float = Field(ge=0.01, le=100, description="true over estimated force")
    sigma_gain: Spread = Field(description="its standard deviation")
    error_force: Spread = Field(description="RMS of the force that is left, as a fraction")


class BenchEntry(Dated):
    """What presses say of plate, edges and camera."""

    error: Spread | None = Field(default=None, description="RMS of held-out places, mm")

    names: tuple[str, ...] = Field(description="of the numbers, in their order")
    values: Row = Field(description="most likely, in the units of the glossary")
    covariance: Rows = Field(description="theirs")
    prior: tuple[Spread, ...] = Field(description="standard deviations before any press")
    measured: tuple[str, ...] = Field(
        (), description="numbers that boards have shown before any press"
    )
    discrepancy: float = Field(ge=0, lt=1, description="error of the model beside them, a fraction")
    memory: float = Field(
        default=0.05, ge=0, lt=1, description="fraction of a touch left when it ended, its σ"
    )
    fixed_pattern: tuple[Spread, Annotated[Spread, Field(gt=0)]] | None = Field(
        default=None,
        description="variance of a pattern of the sensor and its standard deviation, grey levels²",
    )
    error_force: Spread | None = Field(
        default=None, description="RMS of held-out forces, as a fraction"
    )
    converged: bool = Field(True, description="whether the descent ended by itself")
    outliers: tuple[Count, ...] = Field(
        (), description="presses that contradict the others, from 0 in the order of their list"
    )
    found_on: FoundOn | None = Field(
        None, description="plate and camera from which the numbers count; None in older files"
    )

    @field_validator("values", "prior")
    @classmethod
    def _one_a_name(cls, row: Row, info: ValidationInfo) -> Row:
        count = len(info.data.get("names", ()))
        if len(row) != count:
            raise _refusal(f"{count} numbers, one for each name")
        return row

    @field_validator("covariance")
    @classmethod
    def _of_the_names(cls, rows: Rows, info: ValidationInfo) -> Rows:
        count = len(info.data.get("names", ()))
        return _covariance(_shaped(count, count)(rows))
