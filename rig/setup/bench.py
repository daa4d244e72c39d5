"""What the setup works on: cameras, outputs, frames and light, of a bench or of the twin."""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol

from rig.projector.content import Content
from rig.projector.markers import Screen
from rig.projector.outputs import Output
from rig.scene import Scene
from rig.setup.answers import Answers
from rig.system.frame import Source

if TYPE_CHECKING:
    import fe


@dataclass(frozen=True)
class CameraChoice:
    """A camera that can be chosen: its device node and what the system calls it."""

    device: str
    name: str


@dataclass(frozen=True)
class PersonAct:
    """What a person is asked to do; the twin does it, before a bench a person reads it.

    Attributes
    ----------
    kind : {"nothing", "hold board", "lay board", "change light", "press"}
    touch : fe.Touch or None
        Where to press, and how hard.
    """

    kind: Literal["nothing", "hold board", "lay board", "change light", "press"]
    touch: fe.Touch | None = None


NOTHING = PersonAct("nothing")


class LightWindow(Protocol):
    """The projector's window; call it with what is to be shown."""

    def __call__(self, content: Content) -> None:
        """Show this."""
        ...

    @property
    def trouble(self) -> str:
        """Why nothing is shown, in a sentence; empty where it is."""
        ...


class SetupBench(Protocol):
    """A bench that is set up, or the twin in its place.

    Attributes
    ----------
    rehearsal : bool
        Whether it is the twin.
    """

    @property
    def rehearsal(self) -> bool: ...  # noqa: D102

    def clock(self) -> float:
        """Say the time on the clock that stamps the frames, s."""
        ...

    def cameras(self) -> tuple[CameraChoice, ...]:
        """List the cameras that are there now."""
        ...

    def outputs(self) -> tuple[Output, ...]:
        """List the outputs of the desktop that are there now.

        Raises
        ------
        OSError
            If there is no desktop.
        """
        ...

    def flash(self, output: Output) -> None:
        """Let an output flash and show its number."""
        ...

    def open_source(self, scene: Scene) -> AbstractContextManager[Source]:
        """Open the camera of a scene."""
        ...

    def open_light(self, scene: Scene, screen: Screen) -> AbstractContextManager[LightWindow]:
        """Open the projector's window."""
        ...

    def prepare(self, answers: Answers) -> object:
        """Take what was said of the bench: the twin builds it."""
        ...

    def ask(self, act: PersonAct) -> None:
        """Ask the person to do something."""
        ...
