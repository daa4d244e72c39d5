"""Image motions of a bench of which more is known, or less, than a scene says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import fe
import models
import synthetic
from dic import Tiles
from rig.plates.cached import modal
from rig.scene.bench import CameraSection

_PLATE = len(fe.BENCH_PARAMETERS)


def motions_on_bench(
    known: models.BenchEstimate,
    plate: fe.Plate,
    camera: synthetic.AnyCamera,
    tiles: Tiles,
    report: Callable[[int, int], None],
) -> models.ImageMotions:
    """Prepare the motions of a plate whose bench is `known`, through the camera described.

    The tilts of the camera are free, and it moves as the one that is known does.
    """
    fields = models.BenchFields(fe.BenchPlate(modal(plate, report), known.values[:_PLATE]))
    height = camera.face_height(plate.thickness)
    a, b = plate.size
    moves = models.moving(known.values[_PLATE:], (0.5 * a, 0.5 * b, 0.0), height)
    return models.prepare_motions(fields, camera, height, tiles, fields, moves)


@dataclass(frozen=True, eq=False)
class KnownBench:
    """What is known of a bench, and the camera that is described.

    Attributes
    ----------
    estimate : models.BenchEstimate
    camera : synthetic.AnyCamera
    row_time : float, s
        From the reading of one row of an image to that of the next; 0 for a global shutter.
    """

    estimate: models.BenchEstimate
    camera: synthetic.AnyCamera
    row_time: float = 0.0

    def look(self, pattern: models.TilePattern) -> models.CameraChange:
        """Prepare what the camera makes of the plate's fields, as a pattern shows them.

        Raises
        ------
        ValueError
            If the pattern was not prepared on a bench.
        """
        fields = _fields(pattern)
        height = self.camera.face_height(fields.plate.thickness)
        return models.CameraChange(pattern, fields.whole, self.camera, height)

    def seen(self, pattern: models.TilePattern) -> models.TilePattern:
        """Return the pattern as the camera sees it, which may stand otherwise than described."""
        values, look = self.estimate.values, self.look(pattern)
        seen = look.at(values[_PLATE:], self.estimate["thickness"][0])
        fields = _fields(pattern)
        # What is known may have been learned since the motions were prepared.
        plate = fe.BenchPlate(fields.bench.modal, values[:_PLATE])
        through = replace(fields, bench=plate).through(seen, values[_PLATE:])
        motions, shutter = replace(pattern.motions, modes=through, large=through), None
        if self.row_time:
            height = self.camera.face_height(fields.plate.thickness)
            shutter = models.rolling_shutter(self.camera, height, motions.tiles, self.row_time)
        return replace(pattern, motions=motions, shutter=shutter)


def require_bench(camera: CameraSection, *, exact: bool) -> None:
    """Refuse a rolling shutter where touches are those of an exact bench, at rest in each image.

    Raises
    ------
    ValueError
        If a row is read after another, and nothing is uncertain of the bench.
    """
    if camera.row_time and exact:
        raise ValueError(
            f"camera.row_time is {1e6 * camera.row_time:g} µs, and touches that change while rows"
            " are read are known of a usual bench alone; set estimator.kind to 'pattern' and"
            " estimator.bench to 'usual', or camera.row_time to 0"
        )


def _fields(pattern: models.TilePattern) -> models.BenchFields:
    fields = pattern.motions.large
    if not isinstance(fields, models.BenchFields):
        raise ValueError("the pattern was prepared for an exact bench; use motions_on_bench")
    return fields
