"""Images of a bench as it is: the whole plate of von Kármán on its own mesh, photographed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np

import fe
import synthetic
from fe.elements.functional import derivative
from fe.elements.rise import rise
from fe.reduced.karman import Deflected, Karman
from fe.reduced.training import pressure
from models.forward.camera_change import varied
from rig.sources.surroundings import Surrounded
from rig.studies.real_bench.departure import SAID, RealBench
from rig.system.arrays import F64, Grey

_ELEMENTS = 40
_PIXELS = (1024, 1024)
_NOISE, _MEAN_NOISE = 2.0, 0.4  # grey levels, of an image and of the mean of 25
_BETWEEN = 0.37  # s from image to image of a session
_MIDDLE = (127.0, 127.0, 0.0)


@dataclass(frozen=True, eq=False)
class Truth:
    """A bench that can be photographed.

    Attributes
    ----------
    bench : RealBench
    seed : int
        Of pattern and noise.
    states : dict
        The plate under the touches that were solved last.
    """

    bench: RealBench
    seed: int
    states: dict[tuple[fe.Touch, ...], Deflected] = field(
        default_factory=dict[tuple[fe.Touch, ...], Deflected]
    )

    @cached_property
    def karman(self) -> Karman:
        """The plate."""
        return Karman(self.bench.plate, fe.grid(self.bench.plate, _ELEMENTS))

    @property
    def height(self) -> float:
        """Height of the seen face over the middle plane, mm."""
        return (-0.5 if self.bench.below else 0.5) * self.bench.plate.thickness

    @cached_property
    def at_rest(self) -> synthetic.Warper:
        """The pattern as the camera sees it while the reference is taken."""
        return self._seen(np.array(self.bench.camera))

    @cached_property
    def later(self) -> synthetic.Warper:
        """The pattern as the camera sees it afterwards."""
        if not any(self.bench.moved):
            return self.at_rest
        return self._seen(np.add(self.bench.camera, self.bench.moved))

    @cached_property
    def surrounded(self) -> Surrounded:
        """Light, lens, hand and dirt."""
        camera = self.later.camera
        return Surrounded(self.bench.surroundings, camera, SAID.size, self.height, self.seed)

    def _seen(self, numbers: F64) -> synthetic.Warper:
        return _seen(tuple(numbers.tolist()), self.height, self.seed)

    def reference(self, number: int) -> Grey:
        """Photograph the untouched plate."""
        return self._image(self.at_rest, self.displacement(self.at_rest.points, ()), number)

    def photograph(self, touches: tuple[fe.Touch, ...], before: F64 | None, number: int) -> Grey:
        """Photograph the touched plate; `before` is what moved it last, (K, 3) mm."""
        return self._after(self.while_read(touches, number), before, touches, number)

    def held(self, touches: tuple[fe.Touch, ...], before: F64 | None, number: int) -> Grey:
        """Photograph a plate that is touched and held so, as `photograph` does."""
        moved = self.displacement(self.later.points, touches)
        return self._after(moved, before, touches, number)

    def _after(
        self, moved: F64, before: F64 | None, touches: tuple[fe.Touch, ...], number: int
    ) -> Grey:
        if before is not None:
            moved = moved + self.bench.leftover * before
        return self._image(self.later, moved, number, touches=touches, since=_BETWEEN * number)

    def while_read(self, touches: tuple[fe.Touch, ...], number: int) -> F64:
        """Displacement of the points of an image, each when its row is read, (K, 3) mm.

        Forces are those when the row of the touch itself is read; half of the images see them
        grow, half see them fall.
        """
        points, rolling = self.later.points, self.bench.rolling
        if not (rolling and touches):
            return self.displacement(points, touches)
        rolling *= np.random.default_rng((self.seed, 7, number)).choice((-1.0, 1.0))
        own = self._read_at(np.array([(one.x, one.y) for one in touches])).tolist()
        first, middle, last = (
            self.displacement(points, tuple(
                replace(one, force=(1.0 + rolling * (at - then)) * one.force)
                for one, then in zip(touches, own, strict=True)
            ))
            for at in (-0.5, 0.0, 0.5)
        )  # fmt: skip
        after = self._read_at(points)[:, None]
        return middle + after * (last - first) + 2.0 * after**2 * (first - 2.0 * middle + last)

    def _read_at(self, points: F64) -> F64:
        """When points of the plate are read, in parts of the readout after its middle, (K,)."""
        seen = np.column_stack([points, np.full(len(points), self.height)])
        return np.clip(self.later.camera.project(seen)[:, 1] / (_PIXELS[1] - 1) - 0.5, -0.5, 0.5)

    def image(self, moved: F64, *number: int) -> Grey:
        """Photograph points that moved from a flat plate, (K, 3) mm."""
        return self._image(self.later, moved, *number)

    def mean_image(self, moved: F64, *number: int) -> Grey:
        """Photograph them many times, and give the mean of the images."""
        return self._image(self.later, moved, *number, noise=_MEAN_NOISE)

    def _image(
        self,
        view: synthetic.Warper,
        moved: F64,
        *number: int,
        noise: float = _NOISE,
        touches: tuple[fe.Touch, ...] = (),
        since: float | None = None,
    ) -> Grey:
        rng = np.random.default_rng((self.seed, *number))
        sensor = synthetic.Sensor(noise=noise, bits=8, full_well=self.bench.full_well)
        view.render(moved, None, None)
        light = self.surrounded.expose(view.light, since, touches, rng)
        linear = np.asarray(sensor.capture(light, rng), np.uint8)
        self.surrounded.soil(linear)
        if self.bench.gamma == 1.0:
            return linear
        bent = 255.0 * (linear / 255.0) ** (1.0 / self.bench.gamma)
        return np.rint(bent).astype(np.uint8)

    def left(self, touches: tuple[fe.Touch, ...]) -> F64 | None:
        """Compute what touches move, where the plate keeps a part of it."""
        if not self.bench.leftover:
            return None
        points = self.later.points
        return self.displacement(points, touches) - self.displacement(points, ())

    def displacement(self, points: F64, touches: tuple[fe.Touch, ...]) -> F64:
        """Displacement of points of the seen face from a flat plate, (K, 3) mm."""
        return self.shown(points, self.solved(touches) if touches else None)

    def solved(self, touches: tuple[fe.Touch, ...]) -> Deflected:
        """Solve the plate under touches; any truth of the same plate can show it."""
        if touches not in self.states:
            pads = tuple(replace(one, radius=self.bench.pad) for one in touches)
            self.states.clear()
            self.states[touches] = self.karman.solve(pressure(self.karman, pads))
        return self.states[touches]

    def shown(self, points: F64, state: Deflected | None) -> F64:
        """Displacement of points of the seen face from a flat plate in a state, (K, 3) mm."""
        karman, moved = self.karman, np.zeros((len(points), 3))
        raised = rise(karman.plate, karman.mesh)
        if state is not None:
            raised = raised + state.values
            for axis, along in enumerate(state.plane.values):
                moved[:, axis] = derivative(karman.mesh, points).of(along)[:, 0]
        if np.any(raised):
            moved[:, 2] = derivative(karman.mesh, points).of(raised)[:, 0]
            moved[:, 0] -= self.height * derivative(karman.mesh, points, 1, 0).of(raised)[:, 0]
            moved[:, 1] -= self.height * derivative(karman.mesh, points, 0, 1).of(raised)[:, 0]
        return moved


@lru_cache(maxsize=6)
def _seen(numbers: tuple[float, ...], height: float, seed: int) -> synthetic.Warper:
    """Prepare the pattern of a seed on a face, mm high, for a camera that is off by numbers (9,).

    Most benches of a study are seen by the same camera.
    """
    stand = synthetic.pinhole_below if height < 0.0 else synthetic.pinhole_above
    camera = varied(stand(SAID.size, 500.0, _PIXELS), _MIDDLE, np.array(numbers))
    pattern = synthetic.speckle(size=SAID.size, diameter=1.6, density=0.5, softness=0.75, seed=seed)
    return synthetic.prepare_warp(pattern, camera, height)
