"""The live loop for programs: ``for frame in rig.run(scene): frame.touches``."""

from __future__ import annotations

import logging
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # pyright: ignore[reportMissingTypeStubs]

from rig.calibration.learned import Known, known_now
from rig.calibration.store import Calibration, calibration_warnings
from rig.live.alarms import watched
from rig.scene import Scene, load
from rig.sources.callbacks import Callback, Callbacks
from rig.sources.open_loop import Report, open_loop
from rig.system.once import says_once
from rig.system.process import interruptible

if TYPE_CHECKING:
    from rig.live.live_loop import LiveLoop
    from rig.live.snapshot import Mark, Snapshot
    from rig.projector.show import Show
    from rig.usb.link import BoardLink

LOG = logging.getLogger("touchplate")


def run(
    scene: Scene | str | Path,
    *,
    calibration: Calibration | None = None,
    record: str | Path | None = None,
) -> LiveRun:
    """Run the live loop of a scene: iterate over what it returns for the frames.

    Source and recording are opened with the first frame, and closed when the iteration ends in any
    way: at the end of the source, by ``break``, an exception or Ctrl-C. What should be known of the
    bench is logged as a warning of the logger ``touchplate``, progress as information. Neither page
    nor outputs of the scene are opened, and its projector where `LiveRun.open_projector` asks for
    it; its USB board is, with lamp, trigger and foot switch.

    Parameters
    ----------
    scene : Scene, str or Path
        A loaded scene; or the name of a shipped one, or a TOML file.
    calibration : Calibration, optional
        What was measured. Where it is left out and `scene` is a name or file, the calibration
        beside it is read, with what runs have learned since, and what this run learns is kept
        there; a loaded scene has none.
    record : str or Path, optional
        A new file ``*.h5`` that keeps the session.

    Returns
    -------
    LiveRun
        Iterator of `Snapshot`.

    Raises
    ------
    OSError
        If a camera, file or package is missing, or no frames come.
    ValueError
        If the scene is wrong or lacks what the loop needs, or something touched the plate whenever
        the reference was taken.
    """
    bench, now = scene if isinstance(scene, Scene) else load(scene), datetime.now(UTC)
    if calibration is not None or isinstance(scene, Scene):
        given = calibration or Calibration()
        known = Known(given, tuple(calibration_warnings(given, bench, now)))
    else:
        known = known_now(scene, bench, now)
    return LiveRun(bench, known, None if record is None else Path(record))


class LiveRun:
    """Frames of the live loop of a scene, see `run`; also a context that ends with its block."""

    def __init__(self, scene: Scene, known: Known, record: Path | None):
        self._scene, self._parts = scene, _Parts()
        # A function of its own: were it a method, a run that is dropped would not end at once.
        self._frames = _frames(scene, known, record, self._parts)

    def __iter__(self) -> LiveRun:
        """Iterate over the frames."""
        return self

    def __next__(self) -> Snapshot:
        """Wait for the next frame; where none comes, the last one is given and not `fresh`."""
        return next(self._frames)

    def __enter__(self) -> LiveRun:
        """Run while the block does."""
        return self

    def __exit__(self, *error: object) -> None:
        """End the run."""
        self.close()

    def close(self) -> None:
        """Close source, projector and recording; the run has no further frame."""
        self._frames.close()

    def on_frame(self, callback: Callback) -> Callback:
        """Call a function with each frame, before the iteration gives it; also as a decorator.

        One that throws is logged once, with its name, and frames go on. Ctrl-C ends the run from
        within it too.

        Parameters
        ----------
        callback : callable
            Takes a `Snapshot`.

        Returns
        -------
        callable
            The same.
        """
        self._parts.callbacks.add(callback)
        return callback

    def open_projector(self) -> None:
        """Have the first frame open the window of the scene's [projector], for `show`.

        It stays dark until something is shown. Where the projector is calibrated, its light is
        taken out of the frames, whatever is shown.

        Raises
        ------
        ValueError
            If the scene has no projector or no plate, or the first frame has been asked for.
        """
        if self._scene.projector is None or self._scene.plate is None:
            raise ValueError(
                f"scene '{self._scene.title}' has no projector to show something with; add"
                " [projector] and [plate] to it"
            )
        if self._parts.loop:
            raise ValueError(
                "a run opens its projector with the first frame, which has come; call"
                " open_projector before it"
            )
        self._parts.projector = True

    def show(self, content: Sequence[Mark] | NDArray[np.uint8]) -> None:
        """Show marks or an image with the projector, until something else is shown.

        Parameters
        ----------
        content : sequence of Mark, or (H, W) or (H, W, 3) uint8
            Marks where they are on the plate, such as the touches of a frame; or an image, grey or
            RGB, as large as ``projector.size``. `()` is dark.

        Raises
        ------
        ValueError
            If the projector is not open, the image has another size or kind, or what is among the
            marks is none.
        """
        from rig.projector.content import image_of, marks_of

        show = self._parts.show
        if show is None:
            raise ValueError(
                "a run shows nothing before it has a projector; call open_projector and ask for the"
                " first frame"
            )
        image = isinstance(content, np.ndarray)
        show.write(image_of(content, show.size) if image else marks_of(content))

    def tare(self) -> None:
        """Renew the reference from the next frames, while nothing touches.

        The `notice` of the next frames says the outcome; a touch that is held refuses it.

        Raises
        ------
        ValueError
            If no frame was asked for yet.
        """
        if self._parts.loop is None:
            raise ValueError("a run has no reference to renew before its first frame; ask for one")
        self._parts.loop.tare()

    def weigh(self, force: float) -> None:
        """Take the touch that is held next, anywhere, as a known weight: it sets the newton.

        The `notice` of the next frames says the outcome.

        Parameters
        ----------
        force : float, N

        Raises
        ------
        ValueError
            If no frame was asked for yet, the bench is exact, or the weight too small.
        """
        if self._parts.loop is None:
            raise ValueError("a run takes no weight before its first frame; ask for one")
        self._parts.loop.weigh(force)

    def summary(self) -> dict[str, Any]:
        """Figures of the run so far, as ``touchplate run --json`` prints them.

        Raises
        ------
        ValueError
            If no frame was asked for yet.
        """
        if self._parts.loop is None:
            raise ValueError("a run has no figures before its first frame; ask for one")
        return self._parts.loop.summary()


@dataclass
class _Parts:
    """What a run is to open, and what it has open."""

    callbacks: Callbacks = field(default_factory=Callbacks)
    projector: bool = False
    show: Show | None = None
    loop: LiveLoop | None = None


def _frames(
    scene: Scene, known: Known, record: Path | None, parts: _Parts
) -> Generator[Snapshot, None, None]:
    with ExitStack() as stack:
        # The solves of a frame are small: threads of BLAS make them slower, not faster.
        stack.enter_context(threadpool_limits(1, "blas"))
        sinks: list[Callable[[Snapshot], object]] = []
        with interruptible():
            if parts.projector:
                show = parts.show = stack.enter_context(_open_show(scene, known.calibration))
                sinks += [show, says_once(lambda: show.trouble, LOG.warning)]
            opening = _open(scene, known, record, parts.show)
            loop, more = stack.enter_context(opening)
        parts.loop = loop
        sinks += more
        snapshots, keeper = watched(loop, scene.alarms), known.keeper
        if keeper:
            stack.callback(keeper.write, loop)
            sinks.append(lambda snapshot: keeper.follow(loop, snapshot.captured))
        sinks.append(parts.callbacks)
        while snapshot := _next(snapshots):
            for sink in sinks:
                sink(snapshot)
            yield snapshot


def _next(snapshots: Iterator[Snapshot]) -> Snapshot | None:
    """Give the next snapshot; Ctrl-C ends the waiting and not what the user does with it."""
    with interruptible():
        return next(snapshots, None)


@contextmanager
def _open_show(scene: Scene, calibration: Calibration) -> Generator[Show]:
    """Open the projector's window; it is dark, whatever the scene would show."""
    from rig.projector.markers import fit_plate
    from rig.projector.show import open_show

    if scene.projector is None or scene.plate is None:
        raise ValueError("a projector needs [projector] and [plate] in the scene; add them")
    section = scene.projector.model_copy(update={"content": "marks"})
    screen = calibration.screen() or fit_plate(section.size, scene.plate.size)
    with open_show(section, screen, scene.plate.size, calibration) as show:
        show.write(())
        yield show


@contextmanager
def _open(
    scene: Scene, known: Known, record: Path | None, show: Show | None
) -> Generator[tuple[LiveLoop, list[Callable[[Snapshot], object]]]]:
    """Open the loop, and what takes its snapshots before the program does."""
    for sentence in known.notes:
        LOG.warning(sentence)
    calibration = known.calibration
    with ExitStack() as parts:
        switch = None
        if record or (scene.board and scene.board.foot_switch == "record"):
            from rig.recording.control import open_switch

            switch = parts.enter_context(open_switch(record, scene, calibration))
        links: list[BoardLink] = []
        opening = open_loop(
            scene,
            calibration,
            LOG.warning,
            _progress,
            recorder=switch,
            show=show,
            use_board=links.append,
        )
        loop = parts.enter_context(opening)
        sinks: list[Callable[[Snapshot], object]] = []
        if switch:
            sinks.append(says_once(lambda: switch.failure, LOG.warning))
        if links:
            from rig.sources.board_sink import open_board_sink

            board = open_board_sink(scene, links[0], lambda _: loop.tare(), switch, LOG.info, parts)
            sinks += [board, says_once(lambda: board.trouble, LOG.warning)]
        yield loop, sinks


@contextmanager
def _progress(title: str) -> Generator[Report]:
    def report(done: int, total: int) -> None:
        LOG.info("%s: %d of %d", title, done, total)

    yield report
