"""The calibration of a bench, kept beside its scene: each part with its date and its error."""

from __future__ import annotations

import os
from datetime import UTC, datetime, timedelta
from importlib import resources
from math import inf
from pathlib import Path

import numpy as np
from pydantic import ValidationError

import fe
import models
import synthetic
from rig.calibration.camera_prior import LENS, camera_covariance
from rig.calibration.entries import (
    BenchEntry,
    CreepEntry,
    DampingEntry,
    Dated,
    LatencyEntry,
    LensEntry,
    NoiseEntry,
    PoseEntry,
    PressesEntry,
    ProjectorEntry,
)
from rig.calibration.found_on import found_on
from rig.calibration.lens import Lens
from rig.calibration.results import Part, bench_entry, entry_of
from rig.live.alignment import Alignment
from rig.projector.light_map import LightMap, prepare_light_map
from rig.projector.markers import Screen
from rig.scene import Scene
from rig.scene.refusal import sentence
from rig.scene.section import Section
from rig.scene.source import DeviceSection, TwinSection

AGE = timedelta(days=30)  # after which a bench has been bumped at least once
CLOCKS = timedelta(days=1)  # by which those of two machines may differ
_AGAIN = "run `touchplate calibrate bench` again"
_NOTHING = 100.0
"""Times as wide as usual: of a number that a calibration says nothing of."""
_OF_PRESSES = ("error", "error_force", "converged", "outliers", "found_on")
"""What presses have shown of a bench that is followed since."""


class Calibration(Section):
    """A bench as it was measured; a part that was not is None."""

    lens: LensEntry | None = None
    pose: PoseEntry | None = None
    projector: ProjectorEntry | None = None
    noise: NoiseEntry | None = None
    latency: LatencyEntry | None = None
    presses: PressesEntry | None = None
    bench: BenchEntry | None = None
    damping: DampingEntry | None = None
    creep: CreepEntry | None = None

    def known_creep(self) -> models.Creep | None:
        """Return how the plate creeps; None if that was not learned."""
        return None if self.creep is None else models.Creep(self.creep.parts, self.creep.times)

    def camera(self) -> synthetic.Camera | None:
        """Return the camera over the plate; None unless lens and pose are known."""
        if self.lens is None or self.pose is None:
            return None
        return self.known_lens().camera(np.array(self.pose.T_cam_plate))

    def known_lens(self) -> Lens:
        """Return the lens.

        Raises
        ------
        ValueError
            If it was not calibrated.
        """
        lens = self.lens
        if lens is None:
            raise ValueError("the lens is not calibrated; run `touchplate calibrate camera` first")
        bent = synthetic.Distortion(*lens.distortion)
        given = lens.size, lens.focal, lens.centre, bent, lens.sigma_focal
        covariance = None if lens.covariance is None else np.array(lens.covariance)
        return Lens(*given, lens.residual, lens.error, left_out=(), covariance=covariance)

    def bench_before(self, plate: fe.Plate, pixels: tuple[int, int]) -> models.BenchEstimate:
        """Return what is known of a bench before any press, its camera as calibrated.

        A camera of other pixels, width and height, is known as usual. A focal length or a
        distortion of which no σ is kept may be off as usual.
        """
        usual, camera = models.bench_before(plate), self.camera()
        if camera is None or self.pose is None or camera.size != pixels:
            return usual
        lens = self.known_lens()
        stored = lens.covariance
        if stored is None:
            unknown = {name: _NOTHING * usual[name][1] for name in ("focal", "k1", "k2")}
            sigma = unknown | {"focal": lens.sigma_focal / lens.focal or unknown["focal"]}
            stored = np.diag([sigma.get(name, 0.0) ** 2 for name in LENS])
        pose = np.array(self.pose.covariance)
        left = camera_covariance(camera, pose, stored, plate.size, plate.thickness)
        return models.with_camera(usual, left)

    def screen(self) -> Screen | None:
        """Return where the projector shows the plate; None if that was not measured."""
        if self.projector is None:
            return None
        return Screen(self.projector.size, np.array(self.projector.T_px_plate))

    def light(self, T_cam_plate: np.ndarray, size: tuple[int, int]) -> LightMap | None:
        """Return what a camera of `size` px sees of the projector; None if not measured."""
        screen = self.screen()
        if self.projector is None or screen is None:
            return None
        part = self.projector
        return prepare_light_map(screen, T_cam_plate, size, part.strength, part.black)

    def alignment(self) -> Alignment | None:
        """Return what known presses correct; None without any."""
        part = self.presses
        if part is None:
            return None
        matrix = np.array(part.matrix)
        return Alignment(matrix, part.gain, part.error, part.error_force, part.sigma_gain, ())

    def known_bench(self) -> models.BenchEstimate | None:
        """Return what presses tell of the bench; None without any.

        Raises
        ------
        ValueError
            If the numbers are not those of today.
        """
        part = self.bench
        if part is None:
            return None
        names, count = tuple(name for name, _ in models.BENCH), len(models.BENCH)
        covariance = np.array(part.covariance)
        shapes = len(part.values), len(part.prior), *covariance.shape
        if part.names != names or shapes != (count,) * 4:
            raise ValueError(
                f"calibration of the bench has other numbers than the {count} of today; run"
                " `touchplate calibrate bench` again"
            )
        values, prior = np.array(part.values), np.array(part.prior)
        known = values, covariance, part.discrepancy, prior, part.memory
        fixed_pattern = part.fixed_pattern or (0.0, inf)
        return models.BenchEstimate(*known, measured=part.measured, fixed_pattern=fixed_pattern)

    def on_bench(self, known: models.BenchEstimate | None) -> Calibration:
        """Return the same with what is known of the bench now, where it is more."""
        if known is None:
            return self
        before, now = self.bench, datetime.now(UTC).replace(microsecond=0)
        entry = bench_entry(known, before.date if before else now, None)
        if before is not None:
            kept = _OF_PRESSES if known.held_out is None else ("found_on",)
            entry = entry.model_copy(update={name: getattr(before, name) for name in kept})
        return self.model_copy(update={"bench": entry})

    def for_scene(self, scene: Scene) -> Calibration:
        """Return the same without its bench, where that is another than the scene's."""
        if self._other_bench(scene) is None:
            return self
        return self.model_copy(update={"bench": None})

    def _other_bench(self, scene: Scene) -> str | None:
        """Say why the bench is another than the scene's; None where it is not."""
        entry = self.bench
        if entry is None:
            return None
        if entry.found_on is not None:
            now = found_on(scene, self)
            return entry.found_on.difference(now) if now else None
        for name, part in (("lens", self.lens), ("pose", self.pose)):
            if part and part.date > entry.date:
                return f"is older than the {name} it stands on"
        return None

    def warnings(self, scene: Scene, now: datetime) -> list[str]:
        """Say in a sentence each what is old or made for another bench.

        The bench of a twin that is otherwise than its scene stands still, and ages in nothing.
        """
        found: list[str] = []
        ages = not isinstance(scene.source, TwinSection) or scene.source.departure is None
        for name in type(self).model_fields:
            entry: Dated | None = getattr(self, name)
            if entry and ages and now - entry.date > AGE:
                days = (now - entry.date).days
                found.append(f"calibration of {name} is {days} days old; repeat it")
            if entry and entry.date - now > CLOCKS:
                days = (entry.date - now).days
                found.append(f"calibration of {name} is of a day {days} days ahead; set the clock")
        if self.lens and scene.camera and self.lens.size != scene.camera.pixels:
            found.append(_other("lens", self.lens.size, "camera", scene.camera.pixels))
        if self.projector and scene.projector and self.projector.size != scene.projector.size:
            found.append(_other("projector", self.projector.size, "window", scene.projector.size))
        if self.lens and self.pose and self.pose.date < self.lens.date:
            found.append("pose of the plate is older than the lens it stands on; find it again")
        if self.pose and self.presses and self.presses.date < self.pose.date:
            found.append("known presses are older than the pose they stand on; collect them again")
        return found + self._bench_warnings(scene)

    def _bench_warnings(self, scene: Scene) -> list[str]:
        """Say in a sentence each what of the bench is of another one, or not sure."""
        entry, other = self.bench, self._other_bench(scene)
        if entry is None:
            return []
        if other is not None:
            return [f"calibration of the bench {other}; it is left aside: {_AGAIN}"]
        found: list[str] = []
        if entry.found_on is None:
            found.append(f"calibration of the bench does not say of which plate it is: {_AGAIN}")
        if not entry.converged:
            found.append(f"calibration of the bench did not converge: {_AGAIN}")
        if entry.outliers:
            found.append(
                f"{len(entry.outliers)} of the presses that show the bench contradict the others;"
                " look at their list"
            )
        return found


def _other(name: str, made: tuple[int, int], what: str, there: tuple[int, int]) -> str:
    return (
        f"calibration of {name} is for {made[0]} × {made[1]} px and the {what} has {there[0]} ×"
        f" {there[1]} px; repeat it"
    )


def calibration_beside(scene: str | Path) -> Calibration:
    """Read the calibration beside a scene, an empty one where there is none.

    Raises
    ------
    OSError, ValueError
        See `read_calibration`.
    """
    path = beside(scene)
    if not path.exists() and not Path(scene).is_file():
        path = shipped(scene)
    return read_calibration(path)


def shipped(scene: str | Path) -> Path:
    """Return where the calibration that comes with a shipped scene lies, if one does."""
    return Path(str(resources.files("rig"))) / "scenes" / f"{Path(scene).name}.calibration.json"


def calibration_warnings(calibration: Calibration, scene: Scene, now: datetime) -> list[str]:
    """Say in a sentence each what a run of a scene should know of its calibration."""
    found = calibration.warnings(scene, now)
    if isinstance(scene.source, DeviceSection) and scene.camera and calibration.camera() is None:
        found.append(
            "calibration holds no lens and pose: the camera is taken to look straight down from"
            f" {scene.camera.stand_off:g} mm; run `touchplate calibrate camera` and `pose`"
        )
    return found


def beside(scene: str | Path) -> Path:
    """Return where the calibration of a scene lies; that of a shipped one in the working folder."""
    path = Path(scene)
    folder = path.parent if path.is_file() else Path()
    return folder / f"{path.stem}.calibration.json"


def read_calibration(path: Path) -> Calibration:
    """Read a calibration, an empty one where there is no file.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it holds no calibration.
    """
    if not path.exists():
        return Calibration()
    try:
        return parse(path.read_text(encoding="utf-8"), f"'{path}'")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"calibration '{path}' is no text in UTF-8; delete the file and calibrate again"
        ) from error


def parse(text: str, name: str) -> Calibration:
    """Read a calibration from JSON; an empty text is an empty one."""
    if not text:  # as recordings hold it that were made without
        return Calibration()
    try:
        return Calibration.model_validate_json(text)
    except ValidationError as error:
        raise ValueError(
            f"calibration {name} is damaged: {_what_is_wrong(error)}, or delete the file and"
            " calibrate again"
        ) from error


def _what_is_wrong(error: ValidationError) -> str:
    if error.errors()[0]["type"] == "json_invalid":
        return "it is no JSON; correct it there"
    return sentence(error, Calibration)


def keep(path: Path, part: Part, scene: Scene | None = None) -> Calibration:
    """Put a new result into a calibration on disk, in the place of the old one of its kind.

    Parameters
    ----------
    path : Path
    part : Part
    scene : Scene, optional
        That a bench was found on; without it nobody can say later of which plate it was.
    """
    now, before = datetime.now(UTC).replace(microsecond=0), read_calibration(path)
    on = None if scene is None else found_on(scene, before)
    calibration = before.model_copy(update=entry_of(part, now, on))
    aside = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        aside.write_text(calibration.model_dump_json(indent=2, exclude_none=True), encoding="utf-8")
        aside.replace(path)
    finally:
        aside.unlink(missing_ok=True)
    return calibration
