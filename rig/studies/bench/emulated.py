"""A bench that is all emulation, for the studies of the closed loop and of faults.

A plate is rendered as it is touched, under the light of the room and of what the projector's
display shows at that moment; the images go to an emulated /dev/video0; `touchplate` reads them
there as from any camera and opens its window on that display.
"""

from __future__ import annotations

import json
import mmap
import os
import socket
import struct
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, cast

import cv2
import numpy as np
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

import fe
import rig
import synthetic
from rig.calibration import store
from rig.calibration.lens import Lens
from rig.calibration.pose import Pose
from rig.live.view import plate_view
from rig.plates.plate_solver import solve_plate
from rig.projector.light_map import prepare_light_map
from rig.projector.markers import Screen, project
from rig.scene import Scene
from rig.sources.twin import build_twin
from rig.studies.study import part
from rig.system.arrays import F32, AnyArray

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))
from tests.rig.emulation.clients import WRAPPER, Emulation  # noqa: E402  (the tests' own camera)

START = 4096  # bytes before the first image of the file that the camera sends from
RATE = 30.0
SLACK = 1 / 3  # of a frame by which an exposure may be late
PROJECTOR = (1280, 800)
STRENGTH = 1.0  # the projector's white over the light of the room
COARSE = 4  # px from one pixel that is looked at for the light of a mark to the next
REACH = 40.0  # mm round a touch in which light counts as its mark
Script = Callable[[float], tuple[fe.Touch, ...]]
Bent = tuple[tuple[fe.Touch, ...], np.ndarray]  # touches, and how far each point has moved, mm


class Display:
    """An X display whose pixels are read from the server's own memory."""

    def __init__(self, folder: Path, size: tuple[int, int] = PROJECTOR):
        self._folder, self._size = folder, size
        self.name = f":{100 + os.getpid() % 10000}"  # one that it keeps when it is unplugged
        self.plug()

    def plug(self) -> None:
        """Start the server."""
        command = [
            "/usr/bin/Xvfb", self.name, "-nolisten", "tcp", "-fbdir", str(self._folder),
            "-screen", "0", f"{self._size[0]}x{self._size[1]}x24",
        ]  # fmt: skip
        self._server = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        end = time.monotonic() + 20
        while (pixels := self._pixels_of_server()) is None:
            if time.monotonic() > end:
                raise OSError("Xvfb did not start")
            time.sleep(0.05)
        self._pixels: np.ndarray | None = pixels

    def _pixels_of_server(self) -> np.ndarray | None:
        """Memory of the server, (H, W, 4) BGRX; None while it is not laid out yet."""
        file = self._folder / "Xvfb_screen0"
        if not file.exists() or file.stat().st_size < 100:
            return None
        memory = np.memmap(file, np.uint8, "r")
        header = struct.unpack(">25I", memory[:100].tobytes())
        height, stride, start = header[5], header[12], header[0] + 12 * header[19]
        if not height or len(memory) < start + height * stride:
            return None
        pixels = memory[start : start + height * stride].reshape(height, -1, 4)
        return pixels[:, : header[4]]

    def unplug(self) -> None:
        """Stop the server."""
        self._pixels = None
        self._server.terminate()
        self._server.wait()
        (self._folder / "Xvfb_screen0").unlink(missing_ok=True)

    def read(self) -> np.ndarray | None:
        """Image (H, W, 3) RGB; None without a display."""
        return None if self._pixels is None else cv2.cvtColor(self._pixels, cv2.COLOR_BGRA2RGB)

    def glow(self) -> np.ndarray:
        """Green of every `COARSE`th pixel, (H, W), as it is now; quick, unlike the whole image."""
        if self._pixels is None:
            return np.zeros((0, 0))
        return self._pixels[::COARSE, ::COARSE, 1].copy()


class Lit:
    """A sensor before which light of the projector and a changing lamp fall on the plate."""

    def __init__(self, sensor: synthetic.Sensor):
        self._sensor = sensor
        self.light: F32 | np.float32 = np.float32(1.0)
        self.cover: Callable[[np.ndarray], np.ndarray] = lambda light: light

    def capture(
        self,
        intensity: F32,
        rng: np.random.Generator | None,
        out: AnyArray | None = None,
    ) -> AnyArray:
        """See `synthetic.Sensor`."""
        intensity *= np.asarray(self.light, np.float32)
        return self._sensor.capture(self.cover(intensity), rng, out)


def pinhole(camera: synthetic.AnyCamera) -> synthetic.Camera:
    """Return the camera of the twin, which must be one."""
    if not isinstance(camera, synthetic.Camera):
        raise TypeError("the bench is emulated under a pinhole camera only")
    return camera


class Room(threading.Thread):
    """Renders the plate 30 times a second into the file that the camera sends from.

    How the plate bends takes half of the time of a frame, so it is known before: a script goes
    round and round, and an exposure is always a whole number of frames after its beginning.

    Attributes
    ----------
    camera : synthetic.Camera
    lamp : float
        Light of the room over what it was.
    shift : (x, y), px
        Of the camera.
    seen : deque of (time, touches, lit)
        Of each frame: when it was exposed, the touches, and the places (n, 2) mm where the light of
        their marks fell, NaN where none did.
    """

    def __init__(self, scene: Scene, display: Display, file: Path, T_true: np.ndarray):
        super().__init__(name="room", daemon=True)
        self._twin, self._display = build_twin(scene), display
        self._sensor, self._screen = Lit(self._twin.sensor), Screen(PROJECTOR, T_true)
        self.camera = camera = pinhole(self._twin.warper.camera)
        plate = self._twin.solver.plate
        self.view = plate_view(plate, camera)
        self._light = prepare_light_map(self._screen, self.view.T_px_plate, camera.size, STRENGTH)
        width, height = camera.size
        self._shape = height, width
        file.write_bytes(bytes(START + 2 * width * height))
        with file.open("r+b") as opened:
            self._memory = mmap.mmap(opened.fileno(), 0)
        self._ending = threading.Event()
        self._round: tuple[Bent, ...] = (self._bend(()),)
        self.lamp, self.shift = 1.0, (0.0, 0.0)
        self.cover = self._sensor.cover
        self.late = 0
        self.seen: deque[tuple[float, tuple[fe.Touch, ...], np.ndarray]] = deque(maxlen=36000)

    def begin(self, script: Script, length: float) -> None:
        """Let a script begin, which goes round every `length` s."""
        self._round = tuple(self._bend(script(n / RATE)) for n in range(round(RATE * length)))

    def rest(self) -> None:
        """Let nobody touch the plate."""
        self._round = (self._bend(()),)

    def close(self) -> None:
        """End the thread."""
        self._ending.set()
        self.join()

    def run(self) -> None:
        """Body of the thread: what it is too late for is left out."""
        begun, number = time.monotonic(), 0
        while not self._ending.is_set():
            self._expose(number, begun + number / RATE)
            late = time.monotonic() - begun - (number + 1) / RATE
            missed = max(0, int(late * RATE + 1 - SLACK))
            self.late, number = self.late + missed, number + 1 + missed
            self._ending.wait(max(0.0, begun + number / RATE - time.monotonic()))

    def lit_at(self, place: tuple[float, float]) -> bool:
        """Whether light of the projector falls within `REACH` of a place, mm, at this moment."""
        mm, _ = self._light_on_plate(self._display.glow())
        return bool((np.linalg.norm(mm - place, axis=1) < REACH).any())

    def _bend(self, touches: tuple[fe.Touch, ...]) -> Bent:
        points = self._twin.warper.points
        if not touches:
            return touches, np.zeros((len(points), 3), np.float32)
        moved = solve_plate(self._twin.solver, touches).displacement(
            points, self._twin.warper.camera.face
        )
        return touches, moved.astype(np.float32)

    def _expose(self, number: int, now: float) -> None:
        touches, moved = self._round[number % len(self._round)]
        shown = self._display.read()
        light: F32 | np.float32 = np.float32(1.0)
        if shown is not None and shown[::4, ::4].any():
            light = self._light.on_camera(shown)
        self._sensor.light, self._sensor.cover = light * np.float32(self.lamp), self.cover
        slot, size = 1 - self._memory[0], self._shape
        start = START + slot * size[0] * size[1]
        out = np.frombuffer(self._memory, np.uint8, size[0] * size[1], start).reshape(size)
        rng = np.random.default_rng((7, number))
        sensor = cast(synthetic.Sensor, self._sensor)  # it captures as one does
        self._twin.warper.render(moved, sensor, rng, shift=self.shift, out=out)
        struct.pack_into("<d", self._memory, 8 + 8 * slot, now)
        self._memory[0] = slot
        self.seen.append((now, touches, self._places_lit(shown, touches)))

    def _places_lit(self, shown: AnyArray | None, touches: tuple[fe.Touch, ...]) -> np.ndarray:
        """Middles of the light near each touch, (n, 2) mm."""
        places = np.full((len(touches), 2), np.nan)
        if shown is None or not touches:
            return places
        mm, light = self._light_on_plate(shown[::COARSE, ::COARSE, 1])
        true = np.array([(touch.x, touch.y) for touch in touches])
        away = np.linalg.norm(mm[:, None] - true[None], axis=2)
        nearest = away.argmin(axis=1)
        for index in range(len(touches)):
            mine = (nearest == index) & (away[:, index] < REACH)
            if mine.any():
                places[index] = np.average(mm[mine], axis=0, weights=light[mine])
        return places

    def _light_on_plate(self, glow: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where on the plate the pixels that are not dark fall, (n, 2) mm, and their light (n,)."""
        rows, columns = np.nonzero(glow)
        px = float(COARSE) * np.column_stack([columns, rows])
        mm = project(np.linalg.inv(self._screen.T_px_plate), px)
        return mm, glow[rows, columns].astype(np.float64)


class Listener(threading.Thread):
    """Reads the touches that the app sends, with the time at which they came."""

    def __init__(self, port: int):
        super().__init__(name="listener", daemon=True)
        self._port = port
        self.heard: deque[tuple[float, dict[str, Any]]] = deque(maxlen=36000)

    def run(self) -> None:
        """Connect, again and again, until the process ends."""
        while True:
            try:
                with connect(f"ws://127.0.0.1:{self._port}/touches") as client:
                    for text in client:
                        self.heard.append((time.monotonic(), json.loads(text)))
            except (OSError, WebSocketException):
                time.sleep(0.2)


@contextmanager
def emulated_camera(size: tuple[int, int], file: Path) -> Generator[Emulation]:
    """Run the camera that sends the images of a file."""
    script = ROOT / "tests/rig/emulation/camera.py"
    command = [WRAPPER, "/usr/bin/python3", script, *map(str, size), str(RATE)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        camera = Emulation(process)
        camera.say(f"watch:{file}")
        yield camera
        part(process.stdin).close()


def touchplate(
    camera: Emulation, *arguments: object, stderr: int | IO[str] = subprocess.PIPE
) -> subprocess.Popen[str]:
    """Start the command where the emulated camera is seen."""
    # A vfork shares the emulation's table of open devices with the child, which closes them all.
    program = "import subprocess; subprocess._USE_VFORK = False; from rig.cli import main; main()"
    command = [WRAPPER, sys.executable, "-c", program, *map(str, arguments)]
    environment = os.environ | {"UMOCKDEV_DIR": camera.folder, "PYTHONUNBUFFERED": "1"}
    return subprocess.Popen(
        command,
        env=environment,
        text=True,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=stderr,
    )


def keep_lens_and_pose(scene: Path, camera: synthetic.Camera) -> None:
    """Keep the true lens and pose beside the scene, as if they had been calibrated."""
    lens = (camera.size, camera.focal, camera.centre, synthetic.Distortion(), 0.1, 0.05, 0.02, ())
    store.keep(store.beside(scene), Lens(*lens))
    store.keep(store.beside(scene), Pose(camera, np.eye(6) * 1e-6, 0.05, 0.02))


def scene_of(folder: Path, display: Display, port: int, size: int, changes: str = "") -> Path:
    """Write the scene of the app: the plate of `twin` under a camera at /dev/video0."""
    text = f"""
title = "an emulated bench"
[plate]
size = [254, 254]
thickness = 2
young = 3000
poisson = 0.38
edges.kind = "clamped"
theory = "linear"
[touches]
max_touches = 2
force = [0.5, 4]
[camera]
kind = "pinhole"
pixels = [{size}, {size}]
stand_off = 500
rate = 30
[dic]
tile = {16 if size > 700 else 8}
subset = 49
window = 5
reference_frames = 16
[estimator]
kind = "pattern"
bench = "exact"
modes = 200
[source]
kind = "v4l2"
[projector]
display = "{display.name}"
size = [{PROJECTOR[0]}, {PROJECTOR[1]}]
[outputs.websocket]
port = {port}
{changes}"""
    path = folder / "bench.toml"
    path.write_text(text)
    return path


def twin_of(size: int):
    """Return the scene that is rendered: the shipped twin with a camera of another size."""
    speckle = 1.25 * 1024 / size
    return rig.load(
        "twin",
        {
            "camera.pixels": [size, size],
            "pattern.diameter": speckle,
            "source.script": "tour",
        },
    )


def free_port() -> int:
    """Find a port that nobody has."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
