"""The twin in the place of a bench: it shows the board, is lit, and is pressed where asked.

Its truth differs from what the scene says as a bench's does: lens, pose, stiffness and projector
are drawn from a seed. Time is its own and goes on as it is asked for frames, so that nothing waits.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

import numpy as np

import fe
from rig.projector.content import Content
from rig.projector.markers import Screen
from rig.projector.outputs import Output
from rig.scene import Scene
from rig.setup.answers import Answers
from rig.setup.bench import NOTHING, CameraChoice, LightWindow, PersonAct
from rig.setup.true_bench import LAPTOP, PROJECTOR, Scenery, TrueBench, build_scenery, draw_truth
from rig.sources.script import PAUSE, RAMP
from rig.system.arrays import F32, AnyArray
from rig.system.frame import Frame, Source

ROOM, STRENGTH = 0.55, 0.7  # light of the room, of full scale; the projector's white over it
LEVELS = (ROOM, 0.95, 0.2)  # of the room, where it is changed
LASTS = 2.5  # s that each is kept
UNSEEN: dict[str, Any] = {
    "camera": None, "exposure": None, "output": None, "screen": PROJECTOR.size,
}  # fmt: skip
"""Answers that change nothing of what is before the camera, as if they were not given."""
DELAY = 0.043  # s from the command to the light
FINGER = 0.2, 0.003  # mm, fraction: by which a person's presses err


class RehearsedBench:
    """See `SetupBench`.

    Parameters
    ----------
    seed : int
        Of the truth, and of the noise.

    Attributes
    ----------
    flashed : list of Output
        What has flashed so far.
    screens : tuple of Output
        What the desktop has.
    pressed : fe.Touch or None
        The last press, as it really was.
    """

    rehearsal = True

    def __init__(self, seed: int = 0):
        self.flashed: list[Output] = []
        self.screens = (LAPTOP, PROJECTOR)
        self.pressed: fe.Touch | None = None
        self._seed, self._act, self._since = seed, NOTHING, 0.0
        self._now, self._due, self._sequence = 0.0, 0.0, 0
        self._commands: deque[tuple[float, Content]] = deque([(0.0, ())], maxlen=64)
        self._shines, self._screen = False, Screen(PROJECTOR.size, np.eye(3))
        self._scenery: Scenery | None = None
        self._lit: tuple[Content, F32] | None = None

    def clock(self) -> float:
        """See `SetupBench`."""
        return self._now

    def cameras(self) -> tuple[CameraChoice, ...]:
        """See `SetupBench`."""
        return (CameraChoice("/dev/video0", "the twin's camera"),)

    def outputs(self) -> tuple[Output, ...]:
        """See `SetupBench`."""
        return self.screens

    def flash(self, output: Output) -> None:
        """See `SetupBench`."""
        self.flashed.append(output)

    def prepare(self, answers: Answers) -> TrueBench:
        """Build the bench that a person has described; gives its truth."""
        built = answers.model_copy(update=UNSEEN)
        if self._scenery is None or self._scenery.answers != built:
            self._scenery, self._lit = build_scenery(built, draw_truth(built, self._seed)), None
        return self._scenery.truth

    @contextmanager
    def open_source(self, scene: Scene) -> Generator[Source]:
        """See `SetupBench`."""
        yield _Camera(self, 1.0 / (scene.camera.rate if scene.camera else 30.0))

    @contextmanager
    def open_light(self, scene: Scene, screen: Screen) -> Generator[LightWindow]:
        """See `SetupBench`; only the projector's own output falls on the plate."""
        from rig.projector.outputs import choose_output

        section = scene.projector
        wanted = section.output if section else None
        chosen = choose_output(self.screens, wanted, screen.size)
        self._shines, self._screen = chosen == PROJECTOR, screen
        try:
            yield _Projected(self, chosen)
        finally:
            self._shines = False
            self.command(())

    def ask(self, act: PersonAct) -> None:
        """See `SetupBench`: the twin does it at once."""
        if act != self._act:
            self._act, self._since = act, self._now

    def command(self, content: Content) -> None:
        """Show this after a while."""
        if content != self._commands[-1][1]:
            self._commands.append((self._now, content))

    def next_frame(self, timeout: float, interval: float) -> Frame | None:
        """Let time go on to the next frame; None if that comes later than `timeout` s."""
        if self._now + timeout < self._due:
            self._now += timeout
            return None
        self._now = max(self._due, self._now)
        self._due = self._now + interval
        self._sequence += 1
        return Frame(self._sequence, self._now, self._image())

    def _image(self) -> AnyArray:
        scenery = self._scenery
        if scenery is None:
            raise ValueError("a rehearsal has no bench yet; call prepare")
        rng = np.random.default_rng((self._seed, self._sequence))
        age = self._now - self._since
        match self._act.kind:
            case "hold board":
                reflects = scenery.held.light(age)
            case "lay board":
                reflects = scenery.lying.light(age)
            case _:
                reflects = scenery.plate(self._touches(age))
        level = LEVELS[int(age / LASTS) % 3] if self._act.kind == "change light" else ROOM
        light = level + ROOM * STRENGTH * self._falls(scenery)
        return scenery.sensor.capture((reflects * light).astype(np.float32), rng)

    def _touches(self, age: float) -> tuple[fe.Touch, ...]:
        """Touches of the person, who errs a little, the same way while he presses."""
        if self._act.touch is None or age <= PAUSE:
            return ()
        asked = self._act.touch
        rng = np.random.default_rng((self._seed, round(1e3 * (asked.x + 1e3 * asked.y))))
        x, y = np.array([asked.x, asked.y]) + rng.normal(0.0, FINGER[0], 2)
        force = asked.force * (1 + rng.normal(0.0, FINGER[1])) * min(1.0, (age - PAUSE) / RAMP)
        self.pressed = fe.Touch(float(x), float(y), float(force))
        return (self.pressed,)

    def _falls(self, scenery: Scenery) -> F32:
        """Light of the projector on each pixel of the camera, 0 to 1."""
        content: Content = ()
        for asked, one in self._commands:
            content = one if asked + DELAY <= self._now else content
        if not self._shines:
            content = ()
        if self._lit is None or self._lit[0] != content:
            self._lit = content, scenery.falls(content, self._screen)
        return self._lit[1]


class _Camera:
    """The camera of a rehearsal as a `Source`."""

    status = "the twin gives images"

    def __init__(self, bench: RehearsedBench, interval: float):
        self._bench, self._interval = bench, interval

    def grab(self, timeout: float) -> Frame | None:
        return self._bench.next_frame(timeout, self._interval)


class _Projected:
    """The window of a rehearsal as a `LightWindow`; it goes when its output does."""

    def __init__(self, bench: RehearsedBench, output: Output):
        self._bench, self._output = bench, output

    def __call__(self, content: Content) -> None:
        if not self.trouble:
            self._bench.command(content)

    @property
    def trouble(self) -> str:
        from rig.projector.window_process import GONE

        if self._output in self._bench.screens:
            return ""
        return f"projector window is gone: {GONE.format(self._output.name)}"
