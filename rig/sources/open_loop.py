"""Opens the live loop of a scene: its source, its bench and the reference, ready for a frame."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING

from rig.calibration.store import Calibration
from rig.scene import Scene
from rig.scene.account import made_of_plate
from rig.sources.open_source import open_input
from rig.system.frame import Bending, Preparing, Waiting

if TYPE_CHECKING:
    from rig.live.baseline import ReferenceFrame
    from rig.live.frame_record import Recorder
    from rig.live.live_loop import LiveLoop
    from rig.live.snapshot import Snapshot
    from rig.projector.show import Show
    from rig.system.frame import Source
    from rig.usb.link import BoardLink

GREY = 96  # grey levels of an image that is not there yet
READY = "the source gets ready; then the reference is taken …"

Report = Callable[[int, int], None]
"""Called as ``report(done, total)``."""

Progress = Callable[[str], AbstractContextManager[Report]]
"""Gives a report for what is named, while the block runs."""


@contextmanager
def open_loop(
    scene: Scene,
    calibration: Calibration,
    say: Callable[[str], object],
    progress: Progress,
    preview: Callable[[Snapshot], object] = lambda snapshot: None,
    recorder: Recorder | None = None,
    show: Show | None = None,
    use_board: Callable[[BoardLink], object] = lambda link: None,
) -> Generator[LiveLoop]:
    """Open the loop of a scene while the block runs; it has its reference and waits for nothing.

    Parameters
    ----------
    scene : Scene
    calibration : Calibration
        An empty one where nothing was measured.
    say : callable
        Takes sentences that the user should not miss.
    progress : callable
        Gives a report while what carries the plate is computed and the loop gets ready.
    preview : callable
        Takes what can be shown while the loop gets ready.
    recorder : Recorder or None
    show : Show or None
        The projector, whose light is kept out of the source.
    use_board : callable
        Takes the USB board that is at work, where the scene has one.

    Raises
    ------
    OSError
        If a camera, file or package is missing, or no frames come.
    ValueError
        If the scene lacks what the loop needs, or the plate moved whenever the reference was taken.
    """
    with open_input(scene, say, use_board) as (opened, reference):
        say(READY)
        shown = _also_shown(scene, progress, preview)
        if scene.base is not None:
            loop = _bent_loop(scene, calibration, opened, reference, shown)
        else:
            parts = opened, reference, shown, recorder, show
            loop = _flat_loop(scene, calibration, say, *parts)
        _get_ready(loop, progress, preview)
        if isinstance(opened, Bending) and scene.base is not None:
            opened.bend()
        elif isinstance(opened, Waiting):
            opened.begin()
        yield loop


def _flat_loop(
    scene: Scene,
    calibration: Calibration,
    say: Callable[[str], object],
    opened: Source,
    reference: ReferenceFrame | None,
    shown: Progress,
    recorder: Recorder | None,
    show: Show | None,
) -> LiveLoop:
    """Build the loop of a flat plate."""
    from rig.live.bench import build_bench
    from rig.live.loop import Loop
    from rig.live.view import plate_view

    with shown(made_of_plate(scene)) as report:
        bench = build_bench(scene, report, calibration)
    source = opened
    if show and scene.camera:
        view = plate_view(bench.plate, bench.camera)
        light = calibration.light(view.T_px_plate, bench.camera.size)
        source = show.filtered(opened, light, 1 / scene.camera.rate)
    if bench.theory.against:
        say(bench.theory.sentence)
    if show:
        show.rest()
    _prepare(opened, shown)
    return Loop(bench, source, recorder=recorder, reference=reference)


def _bent_loop(
    scene: Scene,
    calibration: Calibration,
    opened: Source,
    reference: ReferenceFrame | None,
    shown: Progress,
) -> LiveLoop:
    """Build the loop of a plate that its base bends; its script begins when it was seen at rest."""
    from rig.on_base.base_bench import build_base_bench
    from rig.on_base.loop import SurfaceLoop

    with shown("shapes of the base") as report:
        bench = build_base_bench(scene, report, calibration)
    _prepare(opened, shown)
    begin = opened.begin if isinstance(opened, Waiting) else lambda: None
    return SurfaceLoop(bench, opened, reference=reference, on_rest=begin)


def _prepare(opened: Source, shown: Progress) -> None:
    if isinstance(opened, Preparing):
        with shown("the twin's bench") as report:
            opened.prepare(report)


def _also_shown(
    scene: Scene, progress: Progress, preview: Callable[[Snapshot], object]
) -> Progress:
    """Show what is computed to people as well, over a grey image of the plate that is to come."""
    plate, camera = scene.plate, scene.camera
    if plate is None or camera is None:
        return progress
    import numpy as np

    from rig.live.view import empty_snapshot, plate_view
    from rig.system.frame import Frame

    image = np.full(camera.pixels[::-1], GREY, np.uint8)
    view = plate_view(plate.build(), camera.build(plate))

    @contextmanager
    def shown(title: str) -> Generator[Report]:
        with progress(title) as report:

            def both(done: int, total: int) -> None:
                report(done, total)
                status = f"getting ready: {title} ({done} of {total})"
                snapshot = empty_snapshot(Frame(0, 0.0, image), plate.size, view, status)
                preview(replace(snapshot, fresh=False))

            yield both

    return shown


def _get_ready(loop: LiveLoop, progress: Progress, preview: Callable[[Snapshot], object]) -> None:
    with progress("getting ready") as report:

        def show(done: int, total: int, snapshot: Snapshot) -> None:
            report(done, total)
            preview(snapshot)

        loop.get_ready(show)
