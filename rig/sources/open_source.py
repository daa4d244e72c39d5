"""Opens where a scene's frames come from; of all ways only the one that it names is imported."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rig.scene import Scene
from rig.scene.bench import CameraSection
from rig.scene.source import (
    Basler,
    DeviceSection,
    Files,
    Folder,
    Genicam,
    OpenCv,
    Recorded,
    TwinSection,
    V4l2,
    Video,
)

if TYPE_CHECKING:
    from rig.camera.device import OpenDevice
    from rig.live.baseline import ReferenceFrame
    from rig.system.frame import Source
    from rig.usb.link import BoardLink

Opening = Callable[[], "OpenDevice"]


@contextmanager
def open_input(
    scene: Scene,
    say: Callable[[str], object],
    use_board: Callable[[BoardLink], object] = lambda link: None,
) -> Generator[tuple[Source, ReferenceFrame | None]]:
    """Open the source of a scene's frames while the block runs, with its USB board at work.

    Parameters
    ----------
    scene : Scene
    say : callable
        Takes sentences for the user: a control that a camera refused, a recording that was cut.
    use_board : callable
        Takes the board that is at work, where the scene has one.

    Yields
    ------
    Source
    ReferenceFrame or None
        The plate at rest, where the source knows it; else its first frames must show it.

    Raises
    ------
    OSError
        If a camera, file or package is missing, or a camera may not be used.
    ValueError
        If the scene has no source.
    """
    with ExitStack() as parts:
        if scene.board and scene.camera:
            from rig.sources import bench_board

            at_work = bench_board.board_at_work(scene.board, scene.camera.rate)
            use_board(parts.enter_context(at_work))
        yield parts.enter_context(_source(scene, say))


@contextmanager
def _source(
    scene: Scene, say: Callable[[str], object]
) -> Generator[tuple[Source, ReferenceFrame | None]]:
    match scene.source, scene.camera:
        case TwinSection(), _:
            from rig.sources.twin_source import open_twin

            with open_twin(scene) as source:
                yield source, None
        case Recorded(path=path), _:
            from rig.recording.playback import Playback
            from rig.recording.session import open_session

            with open_session(Path(path)) as session:
                if session.cut:
                    say(session.cut)
                yield Playback(session), session.reference
        case Folder() | Files() | Video() as kept, CameraSection(rate=rate):
            from rig.camera.device import InOrder

            yield InOrder(_kept(kept, rate)), None
        case DeviceSection() as device, CameraSection() as view:
            from rig.camera import LiveCamera

            with LiveCamera(_opening(device, view), rescue=_rescue(device)) as camera:
                for setting in camera.settings:
                    if not setting.held:
                        say(f"{camera.status}, but {setting.sentence}")
                yield camera, None
        case _:
            raise ValueError(
                f"scene '{scene.title}' has no source of frames; add [source] with kind ="
                ' "twin" or that of a camera'
            )


def _kept(source: Folder | Files | Video, rate: float) -> OpenDevice:
    from rig.camera.files import open_files, open_folder, open_video

    match source:
        case Files(path=path, times=times):
            return open_files(path, rate, times)
        case Folder(path=path):
            return open_folder(path, rate)
        case Video(path=path):
            return open_video(path, rate)


def _opening(device: DeviceSection, view: CameraSection) -> Opening:
    """Choose what opens a camera, again after each outage."""
    given = view.pixels, view.rate, device.controls()
    match device:
        case OpenCv(device=node):
            from rig.camera.opencv import open_camera

            return partial(open_camera, node, *given)
        case V4l2(device=node):
            from rig.camera.v4l2 import open_camera

            return partial(open_camera, node, *given)
        case Basler(serial=serial, trigger=trigger):
            from rig.camera.basler import open_basler

            return partial(open_basler, serial, *given, trigger)
        case Genicam(serial=serial, producer=producer, trigger=trigger):
            from rig.camera.genicam import open_genicam

            return partial(open_genicam, producer, serial, *given, trigger)
        case _:
            raise TypeError(f"no way to open a {type(device).__name__}")


def _rescue(device: DeviceSection) -> Callable[[], object] | None:
    """Free a camera that hangs by a reset of the USB device that has its node."""
    if sys.platform != "linux" or not isinstance(device, OpenCv | V4l2):
        return None
    node = device.device

    def rescue() -> object:
        from rig.usb.devices import owner_of
        from rig.usb.watch import reset

        return reset(owner_of(node))

    return rescue
