"""Images of a bent and twisted plate that is pressed: the whole shell, on elements of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import RectBivariateSpline

import fe
import models
import synthetic
from rig.system.arrays import F64, AnyArray

SIDE = 28
"""Elements a side of the truth; the estimator has others."""

REFERENCE = 16
"""Frames averaged into the reference."""

# Lines of the grid on which the displacement is read, a side: splines between them are off by
# 1e-6 mm where nothing presses.
_LINES = 141
# Points a side of a pixel, see `synthetic.render`.
_SAMPLES = 3
# What is added to each number, mm, N and degrees, by which the derivatives of an image are taken.
_STEPS = {"x": 0.3, "y": 0.3, "force": 0.02, "bend": 0.01, "twist": 0.05}


@dataclass(frozen=True, eq=False)
class Scene:
    """A base with a touch on it, as they are.

    Attributes
    ----------
    untouched : fe.ShellState
    touch : fe.Touch
    """

    untouched: fe.ShellState
    touch: fe.Touch

    @cached_property
    def state(self) -> fe.ShellState:
        """The pressed plate."""
        return self.untouched.touch([self.touch])


@dataclass(frozen=True, eq=False)
class Truth:
    """A plate before a camera, photographed exactly.

    Attributes
    ----------
    plate : fe.Plate
    camera : synthetic.AnyCamera
    pattern : synthetic.Pattern
    sensor : synthetic.Sensor
    elements : int
        Of the truth, a side.
    """

    plate: fe.Plate
    camera: synthetic.AnyCamera
    pattern: synthetic.Pattern
    sensor: synthetic.Sensor
    elements: int = SIDE

    @cached_property
    def shell(self) -> fe.Shell:
        """The plate on the elements of the truth."""
        return fe.Shell(self.plate, fe.Mesh(self.plate.size, (self.elements, self.elements)))

    def shape(self, base: fe.Base, rng: np.random.Generator) -> fe.ShellState:
        """Draw one of the shapes in which a base rests: a half turn of the one found first."""
        shapes = models.turned_shapes(self.shell.at(base))
        drawn = shapes[int(rng.integers(len(shapes)))]
        return self.shell.settled(base, drawn.values)

    def flat_light(self) -> F64:
        """Image of the flat plate without noise, grey levels of light."""
        return self._light(None)

    def reference(self, rng: np.random.Generator) -> F64:
        """Photograph the flat plate `REFERENCE` times and average."""
        light = self.flat_light() / 255
        frames = [self.sensor.capture(light, rng) for _ in range(REFERENCE)]
        return np.asarray(np.mean(frames, axis=0), dtype=np.float64)

    def light(self, state: fe.ShellState) -> F64:
        """Image of a state without noise, grey levels of light."""
        return self._light(self._displacement(state))

    def photograph(self, light: F64, rng: np.random.Generator) -> AnyArray:
        """Take a frame of light."""
        return self.sensor.capture(light / 255, rng)

    def bound(self, scene: Scene, light: F64, noise: float) -> F64:
        """Covariance (3, 3) of x, y and force that the pixels allow, mm and N.

        Of the shell's own differences, with bend, twist, camera and light unknown too.
        """
        grey = 255 * (self.sensor.black + (self.sensor.white - self.sensor.black) * light / 255)
        along_x, along_y = slope(grey, 1), slope(grey, 0)
        height, width = grey.shape
        columns, rows = np.arange(0, width, 8.0), np.arange(0, height, 8.0)
        px = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        seen = models.SeenShape(scene.state, self.camera)
        xy, on_plate = seen.material(px)
        motions = [self._motion(scene, name, step, xy) for name, step in _STEPS.items()]
        rigid = synthetic.rigid_motion_basis(self.camera, px)
        motions += [rigid[:, :, k] for k in range(rigid.shape[2])]
        y, x = np.arange(float(height)), np.arange(float(width))

        def whole(values: F64) -> F64:
            spline = RectBivariateSpline(rows, columns, values.reshape(len(rows), len(columns)))
            return np.asarray(spline(y, x), dtype=np.float64)

        inside = whole(on_plate.astype(np.float64)) > 0.999
        parts = [along_x * whole(d[:, 0]) + along_y * whole(d[:, 1]) for d in motions]
        columns_of = np.array([part[inside] for part in (*parts, grey, np.ones_like(grey))])
        covariance = np.linalg.inv(columns_of @ columns_of.T / noise**2)
        return np.asarray(covariance[:3, :3], dtype=np.float64)

    def _motion(self, scene: Scene, name: str, step: float, xy: F64) -> F64:
        """Image motion (N, 2) of points of the plate by a unit of one of the numbers."""
        places = [
            self.camera.project(
                models.SeenShape(self._varied(scene, name, way), self.camera).places(xy)
            )
            for way in (step, -step)
        ]
        return (places[0] - places[1]) / (2 * step)

    def _varied(self, scene: Scene, name: str, by: float) -> fe.ShellState:
        touch, base = scene.touch, scene.untouched.base
        values = {"x": touch.x, "y": touch.y, "force": touch.force}
        if name in values:
            values[name] += by
            return scene.untouched.touch([fe.Touch(values["x"], values["y"], values["force"])])
        bend = base.bend + (by if name == "bend" else 0.0)
        twist = base.twist + (by if name == "twist" else 0.0)
        moved = self.shell.moved(scene.untouched, fe.Base(bend, twist))
        return moved.touch([touch])

    def _light(self, displacement: Callable[[F64], F64] | None) -> F64:
        height = self.camera.face_height(self.plate.thickness)
        rendered = synthetic.render(
            self.pattern, self.camera, displacement, None, None, height, _SAMPLES
        )
        return np.asarray(rendered, dtype=np.float64)

    def _displacement(self, state: fe.ShellState) -> Callable[[F64], F64]:
        """Displacement of the seen face as splines, which are read a million times."""
        x, y = (np.linspace(0.0, side, _LINES) for side in self.plate.size)
        xy = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        moved = state.displacement(xy, self.camera.face).reshape(_LINES, _LINES, 3)
        splines = [RectBivariateSpline(x, y, moved[:, :, c]) for c in range(3)]

        def displacement(points: F64) -> F64:
            return np.stack([spline.ev(*points.T) for spline in splines], axis=1)

        return displacement


def slope(image: F64, axis: int) -> F64:
    """Return the slope of an image along an axis, grey levels/px, by its Fourier transform.

    Of this pattern its square is that of exact renderings a fraction of a pixel apart, to 0.1 %;
    central differences have three quarters of it, and a bound of them is 16 % too large.
    """
    mirrored = np.concatenate([image, np.flip(image, axis)], axis)
    shape = [1, 1]
    shape[axis] = -1
    turns = 2j * np.pi * np.fft.fftfreq(mirrored.shape[axis]).reshape(shape)
    found = np.fft.ifft(turns * np.fft.fft(mirrored, axis=axis), axis=axis).real
    return np.asarray(np.take(found, range(image.shape[axis]), axis), dtype=np.float64)
