"""Opens what shows a run to people: the projector's window and the operator page."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.output import console, say

if TYPE_CHECKING:
    from rig.calibration.store import Calibration
    from rig.live.snapshot import Snapshot
    from rig.page import Publisher
    from rig.projector.markers import Screen
    from rig.projector.show import Show
    from rig.recording.control import Switch
    from rig.scene import Scene
    from rig.scene.loop import Page

Sink = Callable[["Snapshot"], object]


def open_panels(
    scene: Scene,
    calibration: Calibration,
    notes: tuple[str, ...],
    screen: Screen,
    switch: Switch | None,
    open_parts: ExitStack,
    wishes: tuple[Callable[[], object], Callable[[float], object]],
) -> tuple[Show | None, list[Sink]]:
    """Open projector and page, as the scene names them, until `open_parts` is closed.

    Parameters
    ----------
    scene, calibration
    notes : tuple of str
        What is old or wrong in the calibration.
    screen : Screen
    switch : Switch or None
        Of the recording.
    open_parts : ExitStack
    wishes : tuple of callable
        What renews the reference, and what awaits a known weight, N.

    Returns
    -------
    Show or None
        The projector.
    list of callable
        What takes each snapshot.

    Raises
    ------
    ValueError
        If the projector is to stay dark while frames are taken and nobody knows when that is.
    OSError
        If the port of the page cannot be had.
    """
    show: Show | None = None
    sinks: list[Sink] = []
    if scene.projector and scene.plate:
        from rig.projector.show import open_show

        full = scene.touches.force[1] * scene.touches.max_touches if scene.touches else 1.0
        opened = open_show(scene.projector, screen, scene.plate.size, calibration, full)
        show = open_parts.enter_context(opened)
        sinks.append(show)
    if scene.page and switch:
        from rig.page.files import open_files
        from rig.page.operator import Operator

        publisher = open_parts.enter_context(open_page(scene.page, screen))
        console().print(f"page: [bold]{publisher.url}[/bold]   (Ctrl-C ends)", markup=True)
        if publisher.link:
            console().print(f"others may look: [bold]{publisher.link}[/bold]", markup=True)
        meter = None
        if show:
            from rig.projector.meter import Meter

            black = calibration.projector.black if calibration.projector else 0.0
            meter = open_parts.enter_context(Meter(screen, black))
        files = open_parts.enter_context(open_files(Path.cwd(), scene.page, say))
        parts = publisher, switch, calibration, notes, show, meter
        sinks.append(Operator(*parts, *wishes, files))
    return show, sinks


def open_page(page: Page, screen: Screen | None) -> AbstractContextManager[Publisher]:
    """Give the context that serves a page to those whom the scene lets look."""
    from rig.page import serve
    from rig.web.access import access_of

    return serve(page.port, screen, access_of(page.viewers, page.control == "viewers"))
