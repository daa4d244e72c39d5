"""A twin whose plate is bent and twisted by its base, and pressed there: the whole shell.

Nothing of it is the estimator's: other elements, no series of the response, and images sampled from
a sharp one that was rendered exactly of the bent plate.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import RectBivariateSpline

import fe
import synthetic
from rig.scene.bench import CameraSection, PatternSection, SensorSection
from rig.scene.plate import BaseSection, PlateSection, TouchesSection
from rig.scene.source import TwinSection
from rig.sources import script
from rig.sources.bent_states import ELEMENTS, BaseWay, BentStates, bent_states, twin_shape
from rig.sources.script import Script, ScriptedPress
from rig.system import cache
from rig.system.arrays import F64, Grey

MOVES = 30.0  # s, for which the clamps move before they go back
# Lines of the grid on which a shape is read, a side: splines between them are off by 1e-6 mm.
LINES = 141

Report = Callable[[int, int], None]


@dataclass(frozen=True, eq=False)
class BentTwin:
    """Everything that makes a frame of a bent plate from its number.

    Attributes
    ----------
    untouched : fe.ShellState
        On the base on which the script begins.
    states : BentStates
    flat : synthetic.Warper
        The pattern as the camera sees it on the flat plate.
    warper : synthetic.Warper
        The same on the bent one.
    sensor : synthetic.Sensor
    script : Script
    rate : float, frames a second
    seed : int
        Of the sensor's noise.
    shift : (float, float), px
        Motion of the camera after the reference was taken.
    radius : float, mm
        Of the disc that a touch presses.
    rest : int
        Frames in which the base stands still, before it moves on and the script begins.
    flat_frames : int or None
        Frames in which the plate is flat; None while nobody has said that its base may bend.
    """

    untouched: fe.ShellState
    states: BentStates
    flat: synthetic.Warper = field(repr=False)
    warper: synthetic.Warper = field(repr=False)
    sensor: synthetic.Sensor
    script: Script
    rate: float
    seed: int
    shift: tuple[float, float]
    radius: float
    rest: int = 0
    flat_frames: int | None = None

    def time(self, sequence: int) -> float:
        """Time of the script at frame `sequence`, s."""
        return max(0, sequence - self.rest) / self.rate

    def touches(self, sequence: int) -> tuple[fe.Touch, ...]:
        """Touches on the plate while frame `sequence` is taken."""
        return tuple(
            replace(touch, radius=self.radius) for touch in self.script(self.time(sequence))
        )

    def fraction(self, sequence: int) -> float:
        """How far of their way the clamps are: there for `MOVES` s, and back."""
        turn = self.time(sequence) / MOVES % 2.0
        return min(turn, 2.0 - turn)

    def base(self, sequence: int) -> fe.Base:
        """Give the base at frame `sequence`."""
        return self.states.way.at(self.fraction(sequence))

    def frame(self, sequence: int, touches: tuple[fe.Touch, ...], out: Grey | None = None) -> Grey:
        """Image of the plate, (H, W), the same for the same arguments."""
        rng = np.random.default_rng((self.seed, sequence))
        if self.flat_frames is None or sequence < self.flat_frames:
            nothing = np.zeros((len(self.flat.points), 3))
            return np.asarray(self.flat.render(nothing, self.sensor, rng, out=out), np.uint8)
        moved = self.states.displacement(self.fraction(sequence), touches)
        if moved is None:
            moved = self._solved(sequence, touches)
        seen = self.warper.render(moved, self.sensor, rng, shift=self.shift, out=out)
        return np.asarray(seen, np.uint8)

    def _solved(self, sequence: int, touches: tuple[fe.Touch, ...]) -> F64:
        """Solve the plate under touches that are none of the script's; half a second each."""
        shell, points = self.untouched.shell, self.warper.points
        state = shell.moved(self.untouched, self.base(sequence)).touch(touches)
        return np.asarray(state.displacement(points, self.warper.camera.face), dtype=np.float64)


def build_bent_twin(
    sections: tuple[PlateSection, CameraSection, PatternSection, SensorSection],
    section: BaseSection,
    source: TwinSection,
    touches: TouchesSection | None,
    report: Report,
) -> BentTwin:
    """Build the twin of a plate with a base; images and states are kept in the cache.

    Parameters
    ----------
    sections : tuple
        Plate, camera, pattern and sensor of the scene.
    section : BaseSection
    source : TwinSection
    touches : TouchesSection or None
    report : callable
        Called with how many of how many states are solved.

    Raises
    ------
    ValueError
        The plate cannot take the base, or the source has what this twin does not do.
    """
    plate, camera, pattern, sensor = sections
    presses = _presses(source, plate, touches)
    _refuse(source, camera)
    flat, view, first = plate.build(), camera.build(plate), section.build()
    way = BaseWay(first, _last(first, source))
    untouched, height = _untouched(flat, first, source.shape), view.face_height(flat.thickness)
    drawn = pattern.build(plate)

    def warper(state: fe.ShellState | None) -> synthetic.Warper:
        moved = None if state is None else splines(state, view.face)
        arrays = cache.fetch(
            "sharp-pattern",
            (
                (synthetic, pattern.model_dump(), view, flat.thickness)
                if state is None
                else (synthetic, pattern.model_dump(), view, flat.thickness, state.values)
            ),
            lambda: synthetic.prepare_warp(drawn, view, height, displacement=moved).arrays(),
        )
        return synthetic.Warper.from_arrays(view, height, arrays)

    bent, radius = warper(untouched), touches.radius if touches else 0.0
    return BentTwin(
        untouched=untouched,
        states=bent_states(untouched, way, presses, radius, bent.points, view.face, report),
        flat=warper(None),
        warper=bent,
        sensor=sensor.build(),
        script=script.pressing(plate.size, presses),
        rate=camera.rate,
        seed=source.seed,
        shift=source.shift,
        radius=radius,
    )


def splines(state: fe.ShellState, face: synthetic.Face) -> Callable[[F64], F64]:
    """Displacement of a face as splines, which are read a million times: (K, 2) → (K, 3) mm."""
    x, y = (np.linspace(0.0, side, LINES) for side in state.plate.size)
    xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    moved = state.displacement(xy, face).reshape(LINES, LINES, 3)
    parts = [RectBivariateSpline(x, y, moved[:, :, c]) for c in range(3)]

    def displacement(points: F64) -> F64:
        return np.stack([spline.ev(*points.T) for spline in parts], axis=1)

    return displacement


def _untouched(plate: fe.Plate, base: fe.Base, number: int) -> fe.ShellState:
    """Solve the shape that the twin has, or take it from the cache."""
    kept = cache.fetch(
        "bent-shape",
        (fe, plate, (base.bend, base.twist), number),
        lambda: {"values": twin_shape(plate, base, number).values},
    )
    shell = fe.Shell(plate, fe.even_grid(plate, ELEMENTS))
    return shell.settled(base, kept["values"])


def _last(first: fe.Base, source: TwinSection) -> fe.Base:
    return fe.Base(first.bend + MOVES * source.bend_speed, first.twist + MOVES * source.twist_speed)


def _presses(
    source: TwinSection, plate: PlateSection, touches: TouchesSection | None
) -> tuple[ScriptedPress, ...]:
    match source.script, touches:
        case "empty", _:
            return ()
        case "presses", TouchesSection(force=force):
            return script.presses(plate.size, force, source.seed)
        case "presses", None:
            raise ValueError(
                "script 'presses' draws its forces from [touches]; add [touches] to the scene"
            )
        case name, _:
            raise ValueError(
                f"source.script is '{name}', and a bent plate is pressed by 'presses' or 'empty';"
                " give one of them, or leave [base] out"
            )


def _refuse(source: TwinSection, camera: CameraSection) -> None:
    if source.departure is not None:
        raise ValueError(
            "source.departure makes the twin's bench another one, and that of a bent plate is as"
            " the scene says; leave one of [source.departure] and [base] out"
        )
    if camera.row_time:
        raise ValueError(
            f"camera.row_time is {1e6 * camera.row_time:g} µs, and a twin with a bent plate shows"
            " all rows at once; leave one of camera.row_time and [base] out"
        )
