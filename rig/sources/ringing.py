"""A twin's plate that rings: its modes swing after the forces of the script, frame by frame.

What the plate does at equilibrium is solved by finite elements, as for a twin that does not ring.
Beside it each of its lowest modes is off equilibrium by what an oscillator does, whose force is
linear between knots half a millisecond apart: ż = s z + ω² u with s = ω (i √(1 - ζ²) - ζ), whose
imaginary part over the damped frequency is the amplitude. Frames show the mean over their exposure.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil, floor, log

import numpy as np
from numpy.typing import NDArray

import fe
import synthetic
from rig.live.plate_in_time import exposure_of
from rig.plates.cached import plate_modes
from rig.scene import Scene
from rig.scene.source import TwinSection
from rig.sources.script import Script
from rig.system.arrays import F64

MODES = 60  # lowest ones that ring; those above go with the force
# Between two knots of a force: the 48th mode of a plate of 2 mm swings in 2 to 4 of it.
KNOT = 5e-4  # s
LEFT = 1e-4  # of the ringing that a force began long ago, and that is forgotten
INSTANTS = 5  # of an exposure at which the plate is solved at equilibrium
SAME = 1e-9  # of a knot

Moved = Callable[[tuple[fe.Touch, ...]], F64]
"""Displacement (G, 3) mm of the seen face at equilibrium under touches."""


@dataclass
class Reached:
    """The last knot that was reached, and the oscillators there.

    Attributes
    ----------
    knot : int or None
    swing : (K,) complex128
    """

    knot: int | None
    swing: NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class RingingFace:
    """The seen face of a plate that rings.

    Attributes
    ----------
    modes : fe.Modes
    omega : (K,) float64, rad/s
    damping : float
        Ratio to critical damping.
    exposure : float, s
        Of a frame, which ends at its time.
    shown : (G, 3, K) float64
        Displacement of the points by a unit of each mode.
    reached : Reached
        Kept from frame to frame, so that each goes on from the last; it changes nothing but the
        time that a frame takes.
    """

    modes: fe.Modes
    omega: F64
    damping: float
    exposure: float
    shown: F64 = field(repr=False)
    reached: Reached = field(repr=False)

    def displacement(self, time: float, touches: Script, moved: Moved) -> F64:
        """Mean displacement (G, 3) mm over the exposure that ends at a time, s."""
        begin = max(time - self.exposure, 0.0)
        instants = np.linspace(begin, time, 2 * INSTANTS + 1)[1::2]
        pressed = [touches(float(instant)) for instant in instants]
        at_equilibrium = sum(pressed.count(one) * moved(one) for one in dict.fromkeys(pressed))
        away = self._away(begin, time, touches)
        return np.asarray(at_equilibrium / INSTANTS + self.shown @ away, dtype=np.float64)

    def _away(self, begin: float, end: float, touches: Script) -> F64:
        """By how much modes (K,) are off equilibrium, mean over the knots of an exposure."""
        first, last = ceil(begin / KNOT - SAME), max(floor(end / KNOT + SAME), 0)
        wanted = range(min(first, last), last + 1)
        start = self._start(wanted[0])
        forced = self._at_equilibrium(range(start, last + 1), touches)
        step, former, latter = self._step
        swing = self.reached.swing
        away = np.zeros(len(self.omega))
        for row, knot in enumerate(range(start, last + 1)):
            if row:
                swing = step * swing + former * forced[row - 1] + latter * forced[row]
            if knot == wanted[0]:
                self.reached.knot, self.reached.swing = knot, swing
            if knot >= wanted[0]:
                away += self._amplitudes(swing) - forced[row]
        return away / len(wanted)

    def _start(self, wanted: int) -> int:
        """Knot from which the oscillators are followed to one that is wanted."""
        lasts = log(1.0 / LEFT) / (self.damping * float(self.omega[0]))
        earliest = max(wanted - ceil(lasts / KNOT), 0)
        before = self.reached.knot
        if before is not None and earliest <= before <= wanted:
            return before
        self.reached.swing = np.zeros(len(self.omega), dtype=np.complex128)
        return earliest

    @cached_property
    def _pole(self) -> NDArray[np.complex128]:
        return self.omega * (1j * np.sqrt(1.0 - self.damping**2) - self.damping)

    @cached_property
    def _step(self) -> tuple[NDArray[np.complex128], ...]:
        """Factors of the state before a knot, and of the amplitudes at equilibrium at both ends."""
        pole = self._pole
        step = np.exp(pole * KNOT)
        latter = self.omega**2 * (step - 1.0 - pole * KNOT) / (pole**2 * KNOT)
        return step, self.omega**2 * (step - 1.0) / pole - latter, latter

    def _amplitudes(self, swing: NDArray[np.complex128]) -> F64:
        return swing.imag / self._pole.imag

    def _at_equilibrium(self, knots: range, touches: Script) -> F64:
        """Amplitudes of the modes under the touches at each knot, (n, K) mm²."""
        pressed = [(row, t) for row, knot in enumerate(knots) for t in touches(knot * KNOT)]
        found = np.zeros((len(knots), len(self.omega)))
        for radius in {touch.radius for _, touch in pressed}:
            some = [(row, touch) for row, touch in pressed if touch.radius == radius]
            rows, xy = [row for row, _ in some], [(touch.x, touch.y) for _, touch in some]
            force = np.array([touch.force for _, touch in some])
            np.add.at(found, rows, force[:, None] * self.modes.response(xy, radius))
        return found


def ringing_face(
    scene: Scene,
    plate: fe.Plate,
    points: F64,
    face: synthetic.Face,
    report: Callable[[int, int], None],
) -> RingingFace:
    """Prepare the seen face of the plate of a scene to ring.

    Parameters
    ----------
    scene : Scene
    plate : fe.Plate
    points : (G, 2) float64, mm
        Where it is seen.
    face : {"top", "bottom"}
    report : callable
        Called with how many of how many steps are done.

    Raises
    ------
    ValueError
        The scene says nothing of how it rings.
    """
    if scene.dynamics is None or scene.dynamics.density is None:
        raise ValueError(
            f"source.rings of scene '{scene.title}' needs to know how the plate rings; give"
            " dynamics.density"
        )
    modes = plate_modes(plate, MODES, report)
    z = plate.thickness * (0.5 if face == "top" else -0.5)
    slope = -z * modes.slope(points)
    shown = np.stack([slope[:, :, 0], slope[:, :, 1], modes.value(points)], axis=1)
    heavy = 1e-12 * scene.dynamics.density * plate.thickness  # t/mm²
    omega = np.sqrt(modes.stiffness / heavy)
    at_rest = Reached(None, np.zeros(len(omega), dtype=np.complex128))
    return RingingFace(modes, omega, scene.dynamics.damping, exposure_of(scene), shown, at_rest)


def require_plain(scene: Scene, theory: str) -> None:
    """Refuse to let the twin of a scene ring whose plate is none of flat linear theory.

    Parameters
    ----------
    scene : Scene
    theory : str
        By which its touches are solved.

    Raises
    ------
    ValueError
        Its theory is another one, or the scene asks for more.
    """
    departs = isinstance(scene.source, TwinSection) and scene.source.departure is not None
    row_time = scene.camera.row_time if scene.camera else 0.0
    others = (
        ("plate.theory 'large'", theory != "linear"),
        ("[base]", scene.base is not None),
        ("source.departure", departs),
        ("camera.row_time", row_time > 0.0),
    )
    asked = [key for key, there in others if there]
    if asked:
        raise ValueError(
            f"source.rings of scene '{scene.title}' is for flat plates of linear theory on the"
            f" bench described, not with {' and '.join(asked)}; leave one of them out, or set"
            " plate.theory to 'linear'"
        )
