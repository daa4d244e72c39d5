"""The parts of a scene: what each is, what it costs and what it imports.

Everything is counted from the file alone; nothing is built.
"""

from __future__ import annotations

from dataclasses import dataclass

from rig.scene import counts
from rig.scene.alarms import AlarmsSection
from rig.scene.bench import (
    CameraSection,
    GaugesSection,
    LatticeSection,
    PatternSection,
    RingSection,
    SensorSection,
)
from rig.scene.board import BoardSection
from rig.scene.dataset import DatasetSection
from rig.scene.departure import DepartureSection
from rig.scene.dynamics import DynamicsSection
from rig.scene.edges import SIDES, Mixed
from rig.scene.field_net import FieldNetSection
from rig.scene.image_net import ImageNetSection
from rig.scene.loop import Outputs, Page, ProjectorSection
from rig.scene.plate import BaseSection, PlateSection, TouchesSection
from rig.scene.scene import Scene
from rig.scene.section import Section
from rig.scene.sensing import (
    DicSection,
    NetEstimator,
    PatternEstimator,
    RegressionEstimator,
    StrainEstimator,
    TrainingSection,
)
from rig.scene.source import (
    Basler,
    DeviceSection,
    Files,
    Folder,
    Genicam,
    OpenCv,
    Recorded,
    TwinSection,
    V4l2,
    Video,
)
from rig.scene.touch_net import TouchNetSection

DRIVERS = {"opencv": "cv2", "v4l2": "linuxpy", "basler": "pypylon", "genicam": "harvesters"}
"""What reads each kind of camera."""

PLACEMENTS = {"edges": "on the edges", "inside": "inside the edges"}
"""Where the gauges of a ring lie."""

OUTPUTS = {
    "tuio": "",
    "osc": "",
    "websocket": "starlette",
    "lsl": "pylsl",
    "mqtt": "paho",
    "ros": "rclpy",
}
"""Ways out for touches, and what each imports."""


@dataclass(frozen=True)
class Part:
    """A part that is in: its section, what it is, what it costs, what it imports."""

    name: str
    what: str
    cost: str
    imports: tuple[str, ...]


def describe(name: str, section: Section, scene: Scene) -> Part:
    """Return the part that a section of a scene stands for."""
    match section:
        case PlateSection() | BaseSection() | TouchesSection() | GaugesSection() | DatasetSection():
            return _mechanics(name, section, scene)
        case CameraSection() | PatternSection() | SensorSection():
            return _optics(name, section, scene)
        case (
            PatternEstimator()
            | StrainEstimator()
            | NetEstimator()
            | RegressionEstimator()
            | TrainingSection()
            | DicSection()
        ):
            return _sensing(name, section, scene)
        case TwinSection() | DeviceSection() | Folder() | Files() | Video() | Recorded():
            return _images(name, section, scene)
        case BoardSection():
            return _board(name, section)
        case DynamicsSection():
            return _in_time(name, section)
        case FieldNetSection() | ImageNetSection() | TouchNetSection():
            return _trained_net(name, section)
        case Page() | ProjectorSection() | Outputs():
            return _shown(name, section)
        case AlarmsSection():
            bounds = ", ".join(section.model_dump(exclude_none=True)) or "none"
            return Part(name, bounds, "microseconds a frame", ())
        case _:
            raise TypeError(f"no account of a {type(section).__name__}")


def _trained_net(name: str, section: FieldNetSection | ImageNetSection | TouchNetSection) -> Part:
    match section:
        case FieldNetSection(steps=steps, pairs=pairs, side=side):
            what = f"{steps} steps of {2 * pairs} drawn fields of {side} × {side} tiles"
            needs = ("dic", "fe", "torch")
        case ImageNetSection(steps=steps, pairs=pairs, side=side):
            what = f"{steps} steps, {pairs} pairs of {side} × {side} px rendered in each"
            needs = ("dic", "fe", "synthetic", "torch")
        case TouchNetSection(steps=steps, head_steps=later, batch=batch):
            what = f"{steps} steps of {batch} drawn measurements, and {later} after those"
            needs = ("fe", "models", "torch")
    return Part(name, what, "trained by `touchplate train`", needs)


def _mechanics(name: str, section: Section, scene: Scene) -> Part:
    match section:
        case PlateSection():
            columns, rows = counts.even_elements(section, counts.ELEMENTS)
            cost = f"{columns} × {rows} elements, {counts.unknowns(section)} unknowns"
            return Part(name, _plate(section), cost, ("fe",))
        case BaseSection(bend=bend, twist=twist):
            what = f"clamps {bend:g} mm nearer and turned by {twist:g}° before any touch"
            live = isinstance(scene.estimator, PatternEstimator)
            sides = counts.BASE_ELEMENTS if live else (counts.SHELL_ELEMENTS,)
            grids = [counts.even_elements(scene.plate, side) for side in sides]
            cost = " and ".join(f"{columns} × {rows}" for columns, rows in grids)
            return Part(name, what, f"shell on {cost} elements", ("fe",))
        case TouchesSection(max_touches=number, force=(low, high), radius=radius, friction=rubs):
            noun = "touch" if number == 1 else "touches"
            over = f" over a radius of {radius:g} mm" if radius else ""
            over += f", with a friction of {rubs:g}" if rubs else ""
            return Part(name, f"up to {number} {noun} of {low:g} to {high:g} N{over}", "", ())
        case RingSection() | LatticeSection():
            return _gauges(name, section, scene)
        case DatasetSection():
            return _dataset(name, section, scene)
        case _:
            raise TypeError(f"no account of a {type(section).__name__}")


def _gauges(name: str, section: RingSection | LatticeSection, scene: Scene) -> Part:
    count = counts.gauges(section, scene.plate)
    what = f"lattice of {count} gauges"
    if isinstance(section, RingSection):
        what = f"ring of {count} gauges, {PLACEMENTS[section.placement]}"
    if section.subset is None:
        return Part(name, what, f"one factoring and {3 * count} solves, kept in the cache", ("fe",))
    what += f", read by DIC with subsets of {section.subset} px"
    return Part(name, what, f"{count} subsets correlated a frame", ("dic", "models"))


def _plate(plate: PlateSection) -> str:
    (a, b), edges = plate.size, plate.edges
    held = f"{edges.kind} edges"
    if isinstance(edges, Mixed):
        held = ", ".join(f"{side} {getattr(edges, side).kind}" for side in SIDES)
    noun = "patch" if len(plate.patches) == 1 else "patches"
    patches = f", {len(plate.patches)} {noun}" if plate.patches else ""
    along, across = plate.taper
    tapered = f" tapered by {along:.2%} and {across:.2%}" if along or across else ""
    return (
        f"{a:g} × {b:g} × {plate.thickness:g} mm{tapered}, E {plate.young:g} MPa,"
        f" ν {plate.poisson:g}, {held}{patches}{_at_rest(plate)}"
    )


def _at_rest(plate: PlateSection) -> str:
    """Say what tension and shape a plate has before any touch; empty where none."""
    tension = ", ".join(f"{each:.3g}" for each in plate.tension_at_rest)
    under = f", tension {tension} N/mm" if any(plate.tension_at_rest) else ""
    bowed = f", sag {plate.sag:g} mm" if plate.sag else ""
    return f"{under}{bowed}{', warped' if plate.warp else ''}"


def _dataset(name: str, section: DatasetSection, scene: Scene) -> Part:
    noun = "touch" if section.touches == 1 else "touches"
    where = {"grid": "on a grid", "between": "between a grid", "random": "at random places"}
    samples = section.samples or counts.combinations(section, scene.plate)
    rows = samples * (2 if section.order == "doubled" else 1)
    magnitudes = f", {section.magnitudes} magnitudes" if section.magnitudes > 1 else ""
    what = f"{rows} samples of {section.touches} {noun} {where[section.places]}{magnitudes}"
    gauges = counts.gauges(scene.gauges, scene.plate) if scene.gauges else 0
    size = rows * 4 * (3 * gauges + 6 * section.touches)
    return Part(name, what, f"{size / 1e6:.3g} MB on disk", ("fe", "models", "h5py"))


def _optics(
    name: str, section: CameraSection | PatternSection | SensorSection, scene: Scene
) -> Part:
    match section:
        case CameraSection(pixels=(width, height)):
            what = (
                f"{section.kind} {section.side}, {width} × {height} px at {section.stand_off:g} mm"
            )
            if section.row_time:
                what += f", rows read within {1e3 * section.readout:.3g} ms"
            cost = f"{width * height / 1e6 * section.rate:.3g} million pixels a second"
            return Part(name, what, cost, ("synthetic",))
        case PatternSection():
            what = f"speckles of {section.diameter:g} mm over {section.density:.0%} of the face"
            return Part(name, what, "drawn once, kept in the cache", ("synthetic",))
        case SensorSection():
            what = f"noise {section.noise:g} grey levels, {section.bits} bit"
            return Part(name, what, "", ("synthetic",))


def _sensing(
    name: str,
    section: PatternEstimator
    | StrainEstimator
    | NetEstimator
    | RegressionEstimator
    | TrainingSection
    | DicSection,
    scene: Scene,
) -> Part:
    match section:
        case DicSection(tile=tile, reference_frames=frames):
            what = f"sums over tiles of {tile} px; reference of {frames} frames"
            return Part(
                name, what, f"{counts.tiles(section, scene)} tiles a frame", ("dic", "numba")
            )
        case PatternEstimator(modes=modes):
            what = "touches from the whole pattern, rigid motion of the camera free"
            cost = f"{modes} modes, kept in the cache"
            if scene.base is not None:
                cost = "milliseconds a frame, on the response of the shape"
            return Part(name, what, cost, ("models",))
        case StrainEstimator():
            return _strain(name, scene)
        case NetEstimator(layers=layers, solver_steps=steps):
            what = f"net of {' × '.join(map(str, layers))}, {section.activation}"
            what += f", and {steps} steps of the solver after it" if steps else ""
            return Part(name, what, f"{section.epochs} epochs", ("models", "torch"))
        case RegressionEstimator(fit=fit):
            return Part(name, f"{fit} regression on the training touches", "", ("models",))
        case TrainingSection():
            number = counts.training_counts(section, scene)
            what = "{} training, {} validation and {} test touches".format(*number)
            return Part(name, what, "", ("models",))


def _strain(name: str, scene: Scene) -> Part:
    if scene.dic is None:
        return Part(name, "touches from strain alone", "", ("models",))
    block, window = scene.dic.block, scene.dic.window
    what = (
        f"touches from strain alone: blocks of {block} × {block} tiles, windows of"
        f" {window} × {window} blocks"
    )
    return Part(
        name, what, f"strain at {counts.tiles(scene.dic, scene)} places a frame", ("models",)
    )


def _images(
    name: str,
    section: TwinSection | DeviceSection | Folder | Files | Video | Recorded,
    scene: Scene,
) -> Part:
    match section:
        case TwinSection(departure=DepartureSection(), script=script, seed=seed):
            what = f"rendered images of a bench that is otherwise, script '{script}', seed {seed}"
            cost = "states of the whole plate, once; one image a frame, in its own process"
            return Part(name, what, cost, ("fe", "synthetic"))
        case TwinSection(script=script, seed=seed, shape=shape) if scene.base is not None:
            what = f"rendered images of stable shape {shape}, script '{script}', seed {seed}"
            cost = "states of the whole shell, once; one image a frame, in its own process"
            return Part(name, what, cost, ("fe", "synthetic"))
        case TwinSection(script=script, seed=seed):
            columns, rows = counts.elements(scene.plate, counts.TWIN_ELEMENTS)
            cost = f"{columns} × {rows} elements solved and one image a frame, in its own process"
            what = f"rendered images, script '{script}', seed {seed}"
            return Part(name, what, cost, ("fe", "synthetic"))
        case OpenCv(device=place) | V4l2(device=place):
            what = f"camera at {place}"
        case Basler(serial=serial) | Genicam(serial=serial):
            what = f"{section.kind} camera {serial}"
        case Folder(path=path) | Files(path=path) | Video(path=path):
            return Part(name, f"{section.kind} {path}", "nothing is left out", ("cv2",))
        case Recorded(path=path):
            return Part(name, f"recording {path}", "nothing is left out", ("h5py",))
        case _:
            raise TypeError(f"no account of a {type(section).__name__}")
    return Part(name, what, "one copy a frame, in its own thread", (DRIVERS[section.kind],))


def _board(name: str, section: BoardSection) -> Part:
    lamp = f"lamp at {section.lamp:.0%}" if section.lamp is not None else ""
    if section.lamp_follows:
        lamp = f"lamp that follows the {section.lamp_follows}"
    trigger = "trigger of the camera" if section.trigger_width is not None else ""
    foot = f"foot switch: {section.foot_switch}" if section.foot_switch else ""
    what = " and ".join(filter(None, (lamp, trigger, foot))) or "nothing to do"
    often = section.foot_switch or section.lamp_follows
    cost = (
        "50 requests a second, in a thread of its own"
        if often
        else "a request when frames begin and end"
    )
    return Part(name, f"USB board: {what}", cost, ("usb",))


def _in_time(name: str, section: DynamicsSection) -> Part:
    ringing = f"ringing at {section.density:g} kg/m³" if section.density is not None else ""
    noun = "term" if len(section.creep) == 1 else "terms"
    creep = f"creep of {len(section.creep)} {noun}" if section.creep else ""
    what = " and ".join(filter(None, (ringing, creep)))
    cost = "nothing while the plate rests; about 1 ms a frame while it rings"
    return Part(name, what, cost if ringing else "microseconds a frame", ("models",))


def _shown(name: str, section: Page | ProjectorSection | Outputs) -> Part:
    match section:
        case Page(port=port):
            what = f"http://127.0.0.1:{port}" if port else "any free port"
            return Part(name, what, "one JPEG a frame and viewer", ("starlette", "uvicorn"))
        case ProjectorSection(size=(width, height), output=output):
            place = "the output of that size" if output is None else f"output {output}"
            what = f"{section.content}, {width} × {height} px on {place}"
            return Part(name, what, "one window, in its own process", ("pygame",))
        case Outputs():
            ways = [way for way in OUTPUTS if getattr(section, way)]
            imports = tuple(OUTPUTS[way] for way in ways if OUTPUTS[way])
            return Part(name, ", ".join(ways) or "none", "one message a frame each", imports)
