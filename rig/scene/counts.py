"""How much of everything a scene has, counted from the file alone."""

from __future__ import annotations

from math import comb, isinf

from rig.scene.bench import LatticeSection, RingSection
from rig.scene.dataset import DatasetSection
from rig.scene.edges import SIDES, Edges, ElasticSection, Mixed
from rig.scene.plate import PlateSection
from rig.scene.scene import Scene
from rig.scene.sensing import DicSection, TrainingSection

ELEMENTS, FEWEST, ACROSS = 120, 6, 16
"""Elements along a side of a square, and the fewest between borders of patches and across a long
plate, as in `fe.even_grid`."""

TWIN_ELEMENTS = 64
"""Elements of the twin along the longer side, as in `rig.sources.twin`."""

SHELL_ELEMENTS = 40
"""Elements of the shell along a side of a square, as in `fe.shell`."""

BASE_ELEMENTS = 20, 36
"""The same of those that a live loop presses and makes images of, as in `rig.on_base`."""

TILE_MARGIN = 8
"""Border that tiles leave free, px, as in `dic.tiles`."""


def even_elements(plate: PlateSection | None, side: int) -> tuple[int, int]:
    """Elements along x and y, as in `fe.even_grid`."""
    sides = plate.size if plate else (1.0, 1.0)
    aspect = max(sides) / min(sides)
    return elements(plate, max(round(side * aspect**0.5), round(min(ACROSS, side) * aspect)))


def elements(plate: PlateSection | None, longer: int) -> tuple[int, int]:
    """Elements along x and y, as in `fe.grid`."""
    sides = plate.size if plate else (1.0, 1.0)
    patches = plate.patches if plate else ()
    borders = (
        {v for patch in patches for v in (patch.x, patch.y)[axis]} - {0.0, side}
        for axis, side in enumerate(sides)
    )
    columns, rows = (
        max(2 * round(longer / 2 * side / max(sides)), FEWEST * (len(between) + 1))
        for side, between in zip(sides, borders, strict=True)
    )
    return columns, rows


def unknowns(plate: PlateSection) -> int:
    """Return deflection, slopes and twist at each node, less those that the edges hold."""
    columns, rows = even_elements(plate, ELEMENTS)
    west, east, south, north = (_held(plate.edges, side) for side in SIDES)
    return (2 * columns + 2 - west - east) * (2 * rows + 2 - south - north)


def _held(edges: Edges, side: str) -> int:
    """Of deflection and rotation, how many an edge holds."""
    edge = getattr(edges, side) if isinstance(edges, Mixed) else edges
    if isinstance(edge, ElasticSection):
        return isinf(edge.deflection) + isinf(edge.rotation)
    return {"clamped": 2, "supported": 1, "free": 0}[edge.kind]


def tiles(dic: DicSection, scene: Scene) -> int:
    """Return the number of tiles on an image of the scene's camera."""
    width, height = scene.camera.pixels if scene.camera else (0, 0)
    return ((width - 2 * TILE_MARGIN) // dic.tile) * ((height - 2 * TILE_MARGIN) // dic.tile)


def gauges(section: RingSection | LatticeSection, plate: PlateSection | None) -> int:
    """Return the number of gauges of a scene."""
    sides = plate.size if plate else (0.0, 0.0)
    columns, rows = (round((side - 2 * section.margin) / section.spacing) for side in sides)
    return 2 * (columns + rows) if isinstance(section, RingSection) else (columns + 1) * (rows + 1)


def training_counts(training: TrainingSection, scene: Scene) -> tuple[int, int, int]:
    """Return the touches that a net learns from, watches and is tested on."""
    if training.bases:
        learnt, watched = training.bases.count, training.bases.count // 6
        each = training.bases.touches
        return learnt * each, watched * each, watched * each
    sides = scene.plate.size if scene.plate else (0.0, 0.0)
    along = [round((side - 2 * training.margin) / training.spacing) + 1 for side in sides]
    learnt = training.samples or along[0] * along[1]
    return learnt, training.validation_side**2, training.test_samples


def combinations(section: DatasetSection, plate: PlateSection | None) -> int:
    """Return the number of different samples of a data set on its grid."""
    sides = plate.size if plate else (0.0, 0.0)
    along = [round((side - 2 * section.margin) / section.spacing) + 1 for side in sides]
    if section.places == "between":
        along = [section.midpoint_side] * 2
    choices = comb(along[0] * along[1], section.touches)
    return choices * section.magnitudes**section.touches
