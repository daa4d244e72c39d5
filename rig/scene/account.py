"""The account of a scene: what is in and what it costs, what is left out and why.

Everything is counted from the file alone; nothing is built, so no part is imported.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from rig.scene.bench import Pattern, Pinhole, Plate, Ring, Sensor, Touches
from rig.scene.loop import Page, Projector, Twin
from rig.scene.scene import Scene
from rig.scene.section import Section
from rig.scene.sensing import Dic, NetEstimator, PatternEstimator, StrainEstimator, Training

ELEMENTS, FEWEST = 100, 6
"""Elements along the longer side and the fewest along the other, as in the default mesh of `fe`."""

FINENESS = 0.64
"""Elements of the twin along a side over those, as in `rig.twin`."""

TILE_MARGIN = 8
"""Border that tiles leave free, px, as in `dic.tiles`."""

CENTRE_LOAD = ((1.0, 0.005612), (1.2, 0.00647), (1.4, 0.00691), (1.6, 0.00712), (2.0, 0.00722))
"""w D/(P b²) of a clamped a × b rectangle under a load in its middle, by a/b.

S. Timoshenko and S. Woinowsky-Krieger, Theory of Plates and Shells, table 37; the square to more
places. Beyond the table the value for a long plate, 0.00725, is near enough.
"""


@dataclass(frozen=True)
class Part:
    """A part that is in: its section, what it is, what it costs, what it imports."""

    name: str
    what: str
    cost: str
    imports: tuple[str, ...]


@dataclass(frozen=True)
class LeftOut:
    """A part that is not in, and why."""

    name: str
    why: str


@dataclass(frozen=True)
class Account:
    """What a scene contains and what it leaves out.

    Attributes
    ----------
    relative_deflection : float or None
        Estimate of w/h under the largest force in the middle of the plate, linear theory.
    """

    title: str
    parts: tuple[Part, ...]
    left_out: tuple[LeftOut, ...]
    relative_deflection: float | None


def account(scene: Scene) -> Account:
    """Return the account of a scene."""
    named = [(name, getattr(scene, name)) for name in type(scene).model_fields]
    parts = tuple(_part(name, s, scene) for name, s in named if isinstance(s, Section))
    absent = tuple(name for name, section in named if section is None)
    deflection = relative_deflection(scene.plate, scene.touches)
    return Account(scene.title, parts, _left_out(scene, absent, deflection), deflection)


def relative_deflection(plate: Plate | None, touches: Touches | None) -> float | None:
    """Return w/h of linear theory under the largest force in the middle of the plate."""
    if plate is None or touches is None:
        return None
    short, long = sorted(plate.size)
    rigidity = plate.young * plate.thickness**3 / (12 * (1 - plate.poisson**2))
    return _centre_load(long / short) * touches.force[1] * short**2 / rigidity / plate.thickness


def _centre_load(aspect: float) -> float:
    for (left, low), (right, high) in pairwise(CENTRE_LOAD):
        if aspect <= right:
            return low + (high - low) * (aspect - left) / (right - left)
    return 0.00725


def linear_error(deflection: float) -> str:
    """Say how far linear theory is off in strain, by w/h of a clamped plate."""
    if deflection < 0.02:
        return "less than 1 %"
    if deflection <= 0.05:
        return "about 1 %"
    if deflection < 0.2:
        return "1 to 10 %"
    return "about 10 %" if deflection <= 0.35 else "more than 10 %"


def _part(name: str, section: Section, scene: Scene) -> Part:
    match section:
        case Plate() | Touches() | Ring():
            return _mechanics(name, section, scene)
        case Pinhole() | Pattern() | Sensor():
            return _optics(name, section, scene)
        case PatternEstimator() | StrainEstimator() | NetEstimator() | Training() | Dic():
            return _sensing(name, section, scene)
        case Twin():
            what = f"rendered pictures, script '{section.script}', seed {section.seed}"
            columns, rows = _elements(scene.plate, FINENESS)
            cost = f"{columns} × {rows} elements solved and one picture a frame, in its own process"
            return Part(name, what, cost, ("fe", "synthetic"))
        case Page():
            what = f"http://127.0.0.1:{section.port}" if section.port else "any free port"
            return Part(name, what, "one JPEG a frame and viewer", ("starlette", "uvicorn"))
        case Projector():
            width, height = section.size
            what = f"{width} × {height} px on display {section.display}"
            return Part(name, what, "one window, in its own process", ("pygame",))
    raise TypeError(f"no account of a {type(section).__name__}")


def _mechanics(name: str, section: Plate | Touches | Ring, scene: Scene) -> Part:
    match section:
        case Plate(size=(a, b), thickness=h):
            what = (
                f"{a:g} × {b:g} × {h:g} mm, E {section.young:g} MPa, ν {section.poisson:g},"
                f" {section.edges.kind} edges"
            )
            columns, rows = _elements(section)
            unknowns = 4 * (columns - 1) * (rows - 1)
            return Part(name, what, f"{columns} × {rows} elements, {unknowns} unknowns", ("fe",))
        case Touches(most=most, force=(low, high)):
            noun = "touch" if most == 1 else "touches"
            return Part(name, f"up to {most} {noun} of {low:g} to {high:g} N", "", ())
        case Ring():
            count = _gauge_count(section, scene.plate)
            what = f"ring of {count} gauges, reading {section.reading}"
            cost = f"one factoring and {3 * count} solves, kept in the cache"
            return Part(name, what, cost, ("fe",))


def _optics(name: str, section: Pinhole | Pattern | Sensor, scene: Scene) -> Part:
    match section:
        case Pinhole(pixels=(width, height)):
            what = f"{section.kind}, {width} × {height} px at {section.stand_off:g} mm"
            cost = f"{width * height / 1e6 * section.rate:.3g} million pixels a second"
            return Part(name, what, cost, ("synthetic",))
        case Pattern():
            what = f"speckles of {section.diameter:g} mm over {section.density:.0%} of the face"
            return Part(name, what, "drawn once, kept in the cache", ("synthetic",))
        case Sensor():
            what = f"noise {section.noise:g} grey levels, {section.bits} bit"
            return Part(name, what, "", ("synthetic",))


def _sensing(
    name: str,
    section: PatternEstimator | StrainEstimator | NetEstimator | Training | Dic,
    scene: Scene,
) -> Part:
    match section:
        case Dic(tile=tile, reference_frames=frames):
            what = f"sums over tiles of {tile} px; reference of {frames} pictures"
            return Part(name, what, f"{_tiles(section, scene)} tiles a frame", ("dic", "numba"))
        case PatternEstimator(modes=modes):
            what = "touches from the whole pattern, rigid motion of the camera free"
            return Part(name, what, f"{modes} modes, kept in the cache", ("models",))
        case StrainEstimator():
            return _strain(name, scene)
        case NetEstimator(layers=layers):
            what = f"net of {' × '.join(map(str, layers))}, {section.activation}"
            return Part(name, what, f"{section.epochs} epochs", ("models", "torch"))
        case Training():
            counts = _training_counts(section, scene)
            what = "{} training, {} validation and {} test touches".format(*counts)
            return Part(name, what, "", ("models",))


def _strain(name: str, scene: Scene) -> Part:
    if scene.dic is None:
        return Part(name, "touches from strain alone", "", ("models",))
    block, window = scene.dic.block, scene.dic.window
    what = (
        f"touches from strain alone: blocks of {block} × {block} tiles, windows of"
        f" {window} × {window} blocks"
    )
    return Part(name, what, f"strain at {_tiles(scene.dic, scene)} places a frame", ("models",))


def _elements(plate: Plate | None, fineness: float = 1.0) -> tuple[int, int]:
    """Elements along x and y: as even as in the default mesh, then made coarser."""
    sides = plate.size if plate else (1.0, 1.0)
    usual = (max(2 * round(ELEMENTS / 2 * side / max(sides)), FEWEST) for side in sides)
    columns, rows = (max(FEWEST, round(fineness * count)) for count in usual)
    return columns, rows


def _tiles(dic: Dic, scene: Scene) -> int:
    width, height = scene.camera.pixels if scene.camera else (0, 0)
    return ((width - 2 * TILE_MARGIN) // dic.tile) * ((height - 2 * TILE_MARGIN) // dic.tile)


def _gauge_count(ring: Ring, plate: Plate | None) -> int:
    sides = plate.size if plate else (0.0, 0.0)
    return 2 * sum(round((side - 2 * ring.margin) / ring.spacing) for side in sides)


def _training_counts(training: Training, scene: Scene) -> tuple[int, int, int]:
    sides = scene.plate.size if scene.plate else (0.0, 0.0)
    along = [round((side - 2 * training.margin) / training.spacing) + 1 for side in sides]
    return along[0] * along[1], training.validation**2, training.test


def _left_out(
    scene: Scene, absent: tuple[str, ...], deflection: float | None
) -> tuple[LeftOut, ...]:
    left = [LeftOut(name, "the scene names none") for name in absent]
    if scene.plate:
        left.append(LeftOut("nonlinear shell", _why_no_shell(deflection)))
    if scene.touches and scene.touches.most == 1:
        left.append(LeftOut("counting of touches", "one touch at most is expected"))
    if scene.dic:
        why = f"sums over {_tiles(scene.dic, scene)} tiles keep what the pixels know"
        left.append(LeftOut("subset matching", why))
        if not isinstance(scene.comparison, StrainEstimator):
            left.append(LeftOut("strain map", "the scene names no [comparison] by strain"))
    if "net" not in (e.kind for e in (scene.estimator, scene.comparison) if e):
        left.append(LeftOut("torch", "no net in this scene"))
    if scene.source:
        left.append(LeftOut("camera device", "pictures are rendered"))
    return tuple(left)


def _why_no_shell(deflection: float | None) -> str:
    if deflection is None:
        return "the scene names no forces, so small ones are taken: linear theory"
    return (
        f"the plate is taken as linear: w/h up to about {deflection:.2g}, where strain is off by"
        f" {linear_error(deflection)}"
    )
