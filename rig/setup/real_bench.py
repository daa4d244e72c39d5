"""A bench of cameras, a desktop and a projector, as the setup finds it."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any

from rig.doctor.devices import camera_nodes
from rig.projector.content import Content
from rig.projector.markers import Screen
from rig.projector.outputs import Output
from rig.projector.window import Projector, open_projector
from rig.scene import Scene
from rig.setup.answers import Answers
from rig.setup.bench import CameraChoice, LightWindow, PersonAct
from rig.sources.open_source import open_input
from rig.system.frame import Source
from rig.system.process import deaf_to_interrupts, leave_signals_to_the_loop

FLASH = 3.0  # s
PATIENCE = 20.0  # s that a desktop may take to say which outputs it has
OPENING = 20.0  # s that the projector's window may take to open


class RealBench:
    """See `SetupBench`.

    Parameters
    ----------
    say : callable
        Takes sentences for the user.
    """

    rehearsal = False

    def __init__(self, say: Callable[[str], object]):
        self._say = say

    def clock(self) -> float:
        """See `SetupBench`."""
        return time.monotonic()

    def cameras(self) -> tuple[CameraChoice, ...]:
        """See `SetupBench`."""
        return tuple(CameraChoice(str(node), name) for node, name in camera_nodes())

    def outputs(self) -> tuple[Output, ...]:
        """See `SetupBench`; asked of a new process each time, which sees what has changed."""
        return _on_desktop(_list)

    def flash(self, output: Output) -> None:
        """See `SetupBench`."""
        _on_desktop(_flash, output)

    @contextmanager
    def open_source(self, scene: Scene) -> Generator[Source]:
        """See `SetupBench`."""
        with open_input(scene, self._say) as (source, _):
            yield source

    @contextmanager
    def open_light(self, scene: Scene, screen: Screen) -> Generator[LightWindow]:
        """See `SetupBench`."""
        section = scene.projector
        if section is None:
            raise ValueError(f"scene '{scene.title}' has no projector; add [projector]")
        place = section.display, section.full_screen
        with open_projector(screen, *place, output=section.output) as window:
            window.wait(OPENING)
            yield _Window(window)

    def prepare(self, answers: Answers) -> None:
        """See `SetupBench`: it is there."""

    def ask(self, act: PersonAct) -> None:
        """See `SetupBench`: a person reads what to do."""


class _Window:
    """The projector's window as a `LightWindow`."""

    def __init__(self, window: Projector):
        self._window = window

    def __call__(self, content: Content) -> None:
        self._window(content)

    @property
    def trouble(self) -> str:
        return "" if self._window.alive else self._window.status


def _on_desktop(work: Callable[..., Any], *given: Any) -> Any:
    """Do something on the desktop in a process of its own, and return what comes of it."""
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    process = spawn.Process(target=_work, args=(theirs, work, given), daemon=True)
    with deaf_to_interrupts():
        process.start()
    theirs.close()
    try:
        if not ours.poll(PATIENCE):
            raise OSError(f"the desktop did not answer in {PATIENCE:g} s; log in to it again")
        done, found = ours.recv()
    except EOFError:
        raise OSError("the desktop has gone; log in to it again") from None
    finally:
        process.kill()
        process.join()
    if not done:
        raise OSError(found)
    return found


def _work(link: Connection, work: Callable[..., Any], given: tuple[Any, ...]) -> None:
    leave_signals_to_the_loop()
    from rig.projector.outputs import start_display, use_display

    use_display(None)
    try:
        start_display(None)
    except OSError as error:
        link.send((False, str(error)))
        return
    link.send((True, work(*given)))


def _list() -> tuple[Output, ...]:
    from rig.projector.outputs import list_outputs

    return list_outputs()


def _flash(output: Output) -> None:
    from rig.projector.flash import flash
    from rig.projector.outputs import list_outputs

    flash([one for one in list_outputs() if one == output], FLASH)
