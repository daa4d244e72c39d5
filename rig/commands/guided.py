"""A calibration on a live source: opens source, window and page, and leads a guide through them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING

from rig.calibration.guide import Guide, Progress
from rig.calibration.results import Part
from rig.calibration.store import Calibration
from rig.commands.output import console, progress as shown
from rig.live.view import View, empty_snapshot, plate_view
from rig.page.controls import UNITS, PageControls, Wizard
from rig.projector.markers import fit_plate
from rig.scene import Scene
from rig.system.frame import Frame, Preparing
from rig.system.process import interruptible

PATIENCE = 20.0  # s that the projector's window may take to open

if TYPE_CHECKING:
    from rig.page import Publisher
    from rig.projector.content import Content


def live(what: str, scene: Scene, known: Calibration, guide: Guide) -> Part:
    """Calibrate one part of a bench with its own source, window and page.

    Raises
    ------
    ValueError
        If what was taken determines nothing.
    OSError
        If no frames come.
    """
    from rig.calibration.guided import lead
    from rig.sources.open_source import open_input

    with ExitStack() as open_parts, interruptible():
        show = _window(what, scene, known, open_parts)
        reporter = _Reporter(what, scene, known, open_parts)
        source, _ = open_parts.enter_context(open_input(scene, console().print))
        if isinstance(source, Preparing):
            with shown("the twin's bench") as report:
                source.prepare(report)
        return lead(guide, source, show, reporter.report, reporter.dropped)


def _window(
    what: str, scene: Scene, known: Calibration, open_parts: ExitStack
) -> Callable[[Content], object]:
    """Open the projector's window where it is needed."""
    window, plate = scene.projector, scene.plate
    if what not in ("projector", "latency") or window is None or plate is None:
        return lambda content: None
    from rig.projector import open_projector

    screen = known.screen() or fit_plate(window.size, plate.size)
    opened = open_projector(screen, window.display, window.full_screen, output=window.output)
    show = open_parts.enter_context(opened)
    show.wait(PATIENCE)
    return show


class _Reporter:
    """Says on the console and on the page where a calibration stands, and hears what is dropped."""

    def __init__(self, what: str, scene: Scene, known: Calibration, open_parts: ExitStack):
        self._what, self._said = what, ""
        self._plate_size, self._view = _view_of(scene, known)
        self._publisher: Publisher | None = None
        if scene.page:
            from rig.commands.page_panels import open_page

            self._publisher = open_parts.enter_context(open_page(scene.page, None))
            self._publisher.takes = ("drop",)
            console().print(
                f"page: [bold]{self._publisher.url}[/bold]   (Ctrl-C ends)", markup=True
            )

    def report(self, progress: Progress, frame: Frame) -> None:
        """Say what is new."""
        error = "" if progress.error is None else f", error {progress.error:.3g}"
        said = f"{progress.sentence} ({progress.taken} of {progress.wanted}{error})"
        if said != self._said:
            self._said = said
            console().print(said)
        if self._publisher:
            wizard = Wizard(self._what, progress, UNITS.get(self._what, "mm"))
            shot = empty_snapshot(frame, self._plate_size, self._view, progress.sentence)
            shown = replace(shot, strain_reason="the bench is being calibrated")
            self._publisher.publish(shown, PageControls(wizard=wizard))

    def dropped(self) -> Iterator[int]:
        """Give the views that were taken out on the page."""
        for wish in self._publisher.asked() if self._publisher else ():
            if wish["do"] == "drop" and isinstance(wish.get("view"), int):
                yield wish["view"]


def _view_of(scene: Scene, known: Calibration) -> tuple[tuple[float, float], View]:
    """Sides of the plate, mm, and where it lies in the image as far as that is known."""
    plate, camera = scene.plate, scene.camera
    if plate is None or camera is None:
        raise ValueError(f"scene '{scene.title}' has no bench; add [plate] and [camera]")
    view = plate_view(plate.build(), known.camera() or camera.build(plate))
    return plate.size, view
