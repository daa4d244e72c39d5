"""Image motions of a bench of which more is known, or less, than a scene says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import fe
import models
import synthetic
from dic import Tiles
from rig.plates.cached import modal


def on_bench(
    known: models.BenchEstimate,
    plate: fe.Plate,
    camera: synthetic.AnyCamera,
    tiles: Tiles,
    report: Callable[[int, int], None],
) -> models.ImageMotions:
    """Prepare the motions of a plate whose bench is `known`, through the camera described.

    What the camera sees otherwise is taken in, and its tilts are free.
    """
    height, plate_numbers = plate.thickness / 2, len(fe.BENCH_PARAMETERS)
    bench = fe.BenchPlate(modal(plate, report), known.values[:plate_numbers])
    fields = models.BenchFields(bench)
    motions = models.prepare_motions(fields, camera, height, tiles, fields, models.with_tilts)
    values, thicker = known.values[plate_numbers:], known["thickness"][0]
    seen = models.CameraChange(motions, fields.whole, camera, height).at(values, thicker)
    through = models.BenchFields(bench, seen, values)
    return replace(motions, modes=through, large=through)
