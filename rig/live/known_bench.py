"""Image motions of a bench of which more is known, or less, than a scene says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import fe
import models
import synthetic
from dic import Tiles
from rig.plates.cached import modal

_PLATE = len(fe.BENCH_PARAMETERS)


def motions_on_bench(
    known: models.BenchEstimate,
    plate: fe.Plate,
    camera: synthetic.AnyCamera,
    tiles: Tiles,
    report: Callable[[int, int], None],
) -> models.ImageMotions:
    """Prepare the motions of a plate whose bench is `known`, through the camera described.

    The tilts of the camera are free.
    """
    fields = models.BenchFields(fe.BenchPlate(modal(plate, report), known.values[:_PLATE]))
    height = camera.face_height(plate.thickness)
    return models.prepare_motions(fields, camera, height, tiles, fields, models.with_tilts)


@dataclass(frozen=True, eq=False)
class KnownBench:
    """What is known of a bench, and the camera that is described.

    Attributes
    ----------
    estimate : models.BenchEstimate
    camera : synthetic.AnyCamera
    """

    estimate: models.BenchEstimate
    camera: synthetic.AnyCamera

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
        numbers, look = self.estimate.values[_PLATE:], self.look(pattern)
        seen = look.at(numbers, self.estimate["thickness"][0])
        through = _fields(pattern).through(seen, numbers)
        return replace(pattern, motions=replace(pattern.motions, modes=through, large=through))


def _fields(pattern: models.TilePattern) -> models.BenchFields:
    fields = pattern.motions.large
    if not isinstance(fields, models.BenchFields):
        raise ValueError("the pattern was prepared for an exact bench; use motions_on_bench")
    return fields
