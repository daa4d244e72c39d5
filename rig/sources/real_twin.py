"""A twin whose bench is not as its scene says: the whole plate, seen by a camera that is otherwise.

Nothing of it is the estimator's: the plate of von Kármán is solved on its mesh and not in modes,
and what is wrong with it stands in no calibration but that of presses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from math import exp, expm1, inf, radians

import numpy as np

import fe
import synthetic
from models import varied
from rig.scene.bench import CameraSection, PatternSection, SensorSection
from rig.scene.departure import DepartureSection, GivingSection
from rig.scene.plate import PlateSection
from rig.scene.source import TwinSection
from rig.sources import script
from rig.sources.script import Script
from rig.sources.scripted_states import Lasting, ScriptedStates, scripted_states
from rig.sources.surroundings import Surrounded, Surroundings
from rig.system import cache
from rig.system.arrays import F64, Grey

ELEMENTS = 40  # along the longer side
SIDES = ("west", "east", "south", "north")
MINUTE = 60.0  # s
INSTANTS = 3  # at which a plate is solved while the rows of an image are read
FORGOTTEN = 4.0  # times the time of fading, after which nothing of a touch is left


@dataclass(frozen=True, eq=False)
class RealTwin:
    """Everything that makes a frame of such a bench from its number.

    Attributes
    ----------
    departure : DepartureSection
    states : ScriptedStates
    warper : synthetic.Warper
        The pattern as the true camera sees it on the flat plate.
    sensor : synthetic.Sensor
    view : Surrounded
        Light, lens, hand and dirt.
    script : Script
    rate : float, frames a second
    seed : int
        Of the sensor's noise.
    radius : float, mm
        Of the disc that a touch presses.
    rest : int
        Frames in which the plate stands still before its script begins.
    readout : float, s
        In which the rows of an image are read, its first row before the time of the frame; 0 for
        all at once.
    """

    departure: DepartureSection
    states: ScriptedStates
    warper: synthetic.Warper
    sensor: synthetic.Sensor
    view: Surrounded
    script: Script
    rate: float
    seed: int
    radius: float
    rest: int = 0
    readout: float = 0.0

    def time(self, sequence: int) -> float:
        """Time of the script at frame `sequence`, s."""
        return max(0, sequence - self.rest) / self.rate

    def touches(self, sequence: int) -> tuple[fe.Touch, ...]:
        """Touches on the plate while frame `sequence` is taken."""
        return self.states.pressed(self.time(sequence))

    def displacement(self, sequence: int, touches: tuple[fe.Touch, ...]) -> F64:
        """Displacement (K, 3) mm of the points of the warper from a flat plate.

        Each point has it when its row is read. Touches that are not those of the script stay as
        they are while all rows are read.
        """
        time = self.time(sequence)
        if not self.readout or touches != self.touches(sequence):
            return self._moved(time, touches)
        instants = np.linspace(time - self.readout / 2, time + self.readout / 2, INSTANTS)
        moved = [
            self._moved(at, self.states.pressed(at)) for at in np.maximum(instants, 0.0).tolist()
        ]
        return synthetic.while_read(moved, self.warper.read_at)

    def _moved(self, time: float, touches: tuple[fe.Touch, ...]) -> F64:
        from_rest = self.states.displacement(time, touches)
        moved = self.states.plate.at_rest + from_rest + self._slowly(time)
        return self._tilted(moved, time)

    def _tilted(self, moved: F64, time: float) -> F64:
        """Turn the plate under a camera whose stand gives, (K, 3) mm."""
        about_x, about_y = (radians(speed) * time / MINUTE for speed in self.departure.tilting)
        if not (about_x or about_y):
            return moved
        a, b = self.warper.plate
        x, y = (self.warper.points - (a / 2, b / 2)).T
        return moved + np.column_stack([np.zeros((len(moved), 2)), about_x * y - about_y * x])

    def frame(self, sequence: int, touches: tuple[fe.Touch, ...], out: Grey | None = None) -> Grey:
        """Image of the touched plate, (H, W), the same for the same arguments."""
        time = self.time(sequence)
        x, y = (time / MINUTE * speed for speed in self.departure.drift)
        moved = self.displacement(sequence, touches)
        since = time if sequence > self.rest else None
        return self.photograph(moved, sequence, (x, y), since, touches, out)

    def photograph(
        self,
        displacement: F64,
        number: int,
        shift: tuple[float, float] = (0.0, 0.0),
        since: float | None = None,
        touches: tuple[fe.Touch, ...] = (),
        out: Grey | None = None,
    ) -> Grey:
        """Take an image (H, W) of points that moved from a flat plate, (K, 3) mm.

        Parameters
        ----------
        displacement : (K, 3) float64, mm
            Of the points of the warper.
        number : int
            Of the image: its noise follows from it.
        shift : (float, float), px
            Of the camera.
        since : float or None, s
            Time after the reference; None while that is taken.
        touches : tuple of fe.Touch
            Fingers whose hands are seen.
        out : (H, W) uint8, optional
            Reused when given.
        """
        rng = np.random.default_rng((self.seed, number))
        self.warper.render(displacement, None, None, shift=shift)
        light = self.view.expose(self.warper.light, since, touches, rng)
        image = np.asarray(self.sensor.capture(light, rng, out), np.uint8)
        self.view.soil(image)
        if self.departure.gamma != 1.0:
            image[:] = _bent(self.departure.gamma)[image]
        return image

    def _slowly(self, time: float) -> F64:
        """Displacement that the plate keeps of ended touches or adds under held ones, (K, 3) mm."""
        total = np.zeros((len(self.warper.points), 3))
        for one in self.states.lasting:
            if part := self._left(one, time) + self._crept(one, time):
                total += part * one.field
        return total

    def _left(self, one: Lasting, time: float) -> float:
        """Fraction of a press that the plate keeps after its last end."""
        if time < one.end:
            return 0.0
        age = (time - one.end) % self.states.length
        if age >= FORGOTTEN * self.departure.fading:
            return 0.0
        return self.departure.leftover * exp(-age / self.departure.fading)

    def _crept(self, one: Lasting, time: float) -> float:
        """Fraction of a press by which the plate gives more while it is held."""
        held = time % self.states.length - one.rests
        if not 0.0 <= held < one.end - one.rests:
            return 0.0
        return self.departure.creep * -expm1(-held / self.departure.fading)


def _bent(gamma: float) -> Grey:
    """Grey levels of a camera that is not linear, (256,)."""
    return np.rint(255.0 * (np.arange(256) / 255.0) ** (1.0 / gamma)).astype(np.uint8)


def true_plate(said: fe.Plate, departure: DepartureSection) -> fe.Plate:
    """Return the plate as it is.

    Raises
    ------
    ValueError
        A number makes it a plate that cannot be.
    """
    thickness = said.thickness * (1.0 + departure.thickness)
    young = said.young * (1.0 + departure.young)
    pushed = young * thickness * departure.expansion * departure.warmer / (1.0 - said.poisson)
    more, (xx, yy, xy) = departure.tension, said.tension
    (a, b), patches = said.size, said.patches
    if departure.uneven:
        patches += (fe.Patch((a / 2, a), (0.0, b), thickness * (1.0 + departure.uneven), young),)
    return replace(
        said,
        thickness=thickness,
        young=young,
        patches=patches,
        edges=_held(said, departure),
        tension=(xx + more[0] - pushed, yy + more[1] - pushed, xy),
        shape=_bowed(said.shape, departure.sag),
    )


def _bowed(said: fe.Shape | None, sag: float) -> fe.Shape | None:
    """Shape of a plate whose middle lies higher by a sag, mm."""
    if not sag:
        return said
    return replace(said, sag=said.sag + sag) if said else fe.Shape(sag=sag)


def _held(said: fe.Plate, departure: DepartureSection) -> fe.Edges:
    """Edges of a plate, those replaced that give."""
    edges = {side: getattr(said.sides, side) for side in SIDES}
    for side in SIDES:
        giving: GivingSection | None = getattr(departure, side)
        if giving is not None:
            edges[side] = fe.Elastic(inf, giving.rotation, giving.membrane)
    return fe.Edges(**edges)


def true_camera(
    said: synthetic.AnyCamera, plate: fe.Plate, departure: DepartureSection
) -> synthetic.AnyCamera:
    """Return the camera as it is.

    Raises
    ------
    ValueError
        A telecentric camera is to be otherwise.
    """
    x, y, z = (radians(angle) for angle in departure.turned)
    numbers = np.array(
        [x, y, z, *departure.moved, np.log1p(departure.focal), departure.k1, departure.k2]
    )
    if not numbers.any():
        return said
    if not isinstance(said, synthetic.Camera):
        raise ValueError(
            "source.departure turns or moves a telecentric camera, which has no such numbers; set"
            ' camera.kind to "pinhole"'
        )
    return varied(said, (plate.size[0] / 2, plate.size[1] / 2, 0.0), numbers)


def surroundings(departure: DepartureSection) -> Surroundings:
    """Return what surrounds plate and camera."""
    return Surroundings(**{one.name: getattr(departure, one.name) for one in fields(Surroundings)})


def build_real_twin(
    sections: tuple[PlateSection, CameraSection, PatternSection, SensorSection],
    source: TwinSection,
    departure: DepartureSection,
    play: Script,
    radius: float,
    report: Callable[[int, int], None],
) -> RealTwin:
    """Build the twin of a bench that is not as its scene says.

    The sharp pattern and the states along its tour are kept in the cache.

    Parameters
    ----------
    sections : tuple
        Plate, camera, pattern and sensor of the scene.
    source : TwinSection
    departure : DepartureSection
    play : Script
    radius : float, mm
        Of each touch, as the scene has it.
    report : callable
        Called with how many of how many states are solved.

    Raises
    ------
    ValueError
        If no such plate or camera can be.
    """
    plate, camera, pattern, sensor = sections
    radius = departure.pad or radius
    true = true_plate(plate.build(), departure)
    view = true_camera(camera.build(plate), true, departure)
    height = view.face_height(true.thickness)
    arrays = cache.fetch(
        "sharp-pattern",
        (synthetic, pattern.model_dump(), view, true.thickness),
        lambda: synthetic.prepare_warp(pattern.build(plate), view, height).arrays(),
    )
    warper = synthetic.Warper.from_arrays(view, height, arrays)
    whole = fe.WholePlate(true, fe.even_grid(true, ELEMENTS), warper.points, view.face)
    presses = script.TOUR if source.script == "tour" else ()

    def pressed(time: float) -> tuple[fe.Touch, ...]:
        return tuple(replace(touch, radius=radius) for touch in play(time))

    length = script.TOUR_LENGTH
    states = scripted_states(whole, presses, pressed, length, report)
    return RealTwin(
        departure=departure,
        states=states,
        warper=warper,
        sensor=sensor.build(),
        view=Surrounded(surroundings(departure), view, true.size, height, source.seed),
        script=play,
        rate=camera.rate,
        seed=source.seed,
        radius=radius,
        readout=camera.readout if camera.row_time else 0.0,
    )
