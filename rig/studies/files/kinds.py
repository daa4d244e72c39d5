"""The kinds of files: how a whole one is made, and how one that was changed is read.

Each reader goes the way of the program and then looks, by other means, at what it was given: text
by the limits of `limits`, binary files by comparing every number with those that were written.
"""

# h5py has no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
from __future__ import annotations

import importlib
import os
import tempfile
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import models
import rig
import synthetic
from rig.calibration import store
from rig.calibration.latency import Latency
from rig.calibration.lens import Lens
from rig.calibration.photon import Photon
from rig.calibration.pose import Pose
from rig.calibration.projector import ProjectorLight
from rig.live.alignment import Alignment
from rig.live.baseline import ReferenceFrame
from rig.live.view import plate_view
from rig.projector.markers import Screen
from rig.recording import layout
from rig.recording.session import frame, open_session, reported
from rig.recording.writer import Writer
from rig.scene import Scene
from rig.setup.scene_file import corner_of_board, scene_of
from rig.setup.session import SetupState, keep_state, read_state
from rig.setup.steps import next_step
from rig.studies.files.limits import out_of_range
from rig.studies.files.mutation import Rng, mutate_bytes, mutate_number
from rig.studies.study import part
from rig.system import cache
from rig.system.arrays import AnyArray

Wrong = Iterator[str]
"""What is out of range or other than it was written, in words."""

SHAPE, FRAMES = (24, 32), 4
NO_NUMBERS = (np.inf, -np.inf, 1e300, -1e300)
FORGED = ("frames/captured", "frames/truth", "touches/place", "start/motion", "reference")


@dataclass(frozen=True)
class Kind:
    """One kind of file.

    Attributes
    ----------
    suffix : str
        Of its name.
    make : callable
        Write a whole file.
    mutate : callable
        Change its bytes.
    read : callable
        Read a file as the program does; yields what was taken and cannot be.
    """

    suffix: str
    make: Callable[[Path], object]
    mutate: Callable[[bytes, Rng], bytes]
    read: Callable[[Path], Wrong]


def mutate_text(content: bytes, rng: Rng) -> bytes:
    """Change a number of a text, or any of its bytes."""
    if rng.random() < 0.7:
        return mutate_number(content.decode(), rng).encode()
    return mutate_bytes(content, rng)


MORE = """
[[plate.patches]]
x = [10, 90]
y = [20, "5 cm"]
young = "2 GPa"

[gauges]
kind = "lattice"
spacing = 4
margin = 5
subset = 31

[training]
spacing = 4
margin = 11
samples = 1000
force = [0.5, "2000 mN"]

[dataset]
touches = 2
spacing = 4
margin = 11
samples = 500

[outputs.tuio]
port = 3333
"""


def make_scene(path: Path) -> None:
    """Write a scene with numbers of all sections."""
    scenes = Path(rig.__file__).parent / "scenes"
    text = (scenes / "twin.toml").read_text(encoding="utf-8")
    path.write_text(text + MORE, encoding="utf-8")


def read_scene(path: Path) -> Wrong:
    """Load a scene and build what is cheap to build."""
    scene = rig.load(path)
    yield from out_of_range(scene.model_dump())
    if scene.plate is None:
        return
    scene.plate.build()
    for section in (scene.camera, scene.gauges, scene.dataset):
        if section:
            section.build(scene.plate)


def make_calibration(path: Path) -> None:
    """Write a calibration with every part that there is."""
    bent = synthetic.Distortion(-0.1, 0.05, 1e-3, -2e-3, 0.01)
    lens = Lens((1024, 1024), 1970.2, (510.1, 513.7), bent, 0.4, 0.08, 0.02, ())
    camera = lens.camera(synthetic.look_at((127, 120, 500), (127, 127, 0)))
    light = Screen((1280, 800), np.array([[3.0, 0.1, 250], [0.0, -3.1, 780], [1e-5, 0, 1]]))
    count = len(models.BENCH)
    values, spread = np.linspace(-1, 1, count), np.diag(np.linspace(1, 2, count))
    presses = np.array([[1.01, 0, -0.5], [0, 0.99, 0.4]])
    for result in (
        lens,
        Pose(camera, np.eye(6) * 1e-4, 0.1, 0.03),
        ProjectorLight(light, 0.5, 0.2, 0.9),
        Photon(0.03, 1.5, 1e-4, 0.01, 0.02),
        Latency(0.05, 0.07, 1e-3, 20, 1),
        Alignment(presses, 1.1, 0.3, 0.02, 0.004, (3,)),
        models.BenchEstimate(values, spread, 0.004, np.full(count, 3.0)),
    ):
        store.keep(path, result)


def read_calibration(path: Path) -> Wrong:
    """Read a calibration and use every part of it."""
    kept = store.read_calibration(path)
    yield from out_of_range(kept.model_dump())
    for name, shape in (("pose", (4, 4)), ("projector", (3, 3)), ("presses", (2, 3))):
        entry: Any = getattr(kept, name)
        matrix = {"pose": "T_cam_plate", "projector": "T_px_plate", "presses": "matrix"}[name]
        if entry is not None and np.shape(getattr(entry, matrix)) != shape:
            yield f"{name}.{matrix} has shape {np.shape(getattr(entry, matrix))}"
    if kept.pose is not None:
        turn = np.array(kept.pose.T_cam_plate)[:3, :3]
        if abs(np.linalg.det(turn) - 1) > 1e-4:
            yield f"determinant of the pose is {np.linalg.det(turn):g}"
    kept.warnings(rig.load("twin"), datetime.now(UTC))
    kept.alignment()
    kept.known_bench()
    camera = kept.camera()
    if camera is not None and kept.projector is not None:
        view = plate_view(part(rig.load("twin").plate).build(), camera)
        kept.light(view.T_px_plate, (64, 48))


def make_setup(path: Path) -> None:
    """Write how far a setup is, with every answer that there is."""
    said = {
        "camera": "/dev/video2",
        "exposure": 8e-3,
        "output": "HDMI-1",
        "left": 15.0,
        "below": 22.0,
    }
    done = "plate", "print", "camera", "output", "lens"
    keep_state(path, SetupState.model_validate({"answers": said, "done": done}))


def read_setup(path: Path) -> Wrong:
    """Read a state, and make of it what the setup makes."""
    state = read_state(path)
    yield from out_of_range(state.answers.model_dump())
    next_step(state.answers, state.done)
    corner_of_board(state.answers)
    scene_of(state.answers)


def net() -> models.Trained:
    """Return a small net."""
    rng = np.random.default_rng(0)
    layers = tuple(
        (rng.normal(size=(n, m)), rng.normal(size=m)) for n, m in ((6, 5), (5, 4), (4, 2))
    )
    scaling = models.Scaling(rng.normal(size=6), rng.uniform(1.0, 2.0, 6))
    small = models.Net(models.NetOptions((5, 4), "silu"), scaling, layers)
    return models.Trained(small, rng.uniform(size=(10, 2)))


def mutate_model(content: bytes, rng: Rng) -> bytes:
    """Change bytes, or a number behind the checksum's back."""
    if rng.random() < 0.7:
        return mutate_bytes(content, rng)
    whole = net()
    arrays = [whole.net.scaling.centre, whole.net.scaling.scale]
    arrays += [array for layer in whole.net.layers for array in layer]
    array = arrays[rng.integers(len(arrays))]
    array.flat[rng.integers(array.size)] = rng.choice(NO_NUMBERS)
    with tempfile.TemporaryDirectory() as folder:
        models.save_net(Path(folder) / "net.h5", whole, {})
        return (Path(folder) / "net.h5").read_bytes()


def make_model(path: Path) -> None:
    """Write a small net."""
    models.save_net(path, net(), {"scene": {"title": "a test"}})


def read_model(path: Path) -> Wrong:
    """Read a net and compare every number."""
    found, about = models.load_net(path)
    strain = np.linspace(-1, 1, 6)[None]
    if not np.array_equal(models.predict(found.net, strain), models.predict(net().net, strain)):
        yield "the net gives other places"
    if about != {"scene": {"title": "a test"}} or not np.array_equal(found.history, net().history):
        yield "what goes with the net is other"


def recorded_frame(number: int) -> dict[str, AnyArray]:
    """Arrays of a frame as the loop would give them."""
    rng = np.random.default_rng(number)
    touch = np.array([(60.0, 70.0, 1.0 + number), (np.nan,) * 3])
    row = {
        "frames/image": rng.integers(0, 255, SHAPE, np.uint8),
        "frames/captured": np.asarray(100 + number / 30),
        "frames/truth": np.full((layout.FINGERS, 4), np.nan),
        "frames/truth_known": np.asarray(1, np.uint8),
        "frames/sums": rng.normal(size=(3, 4, 5)).astype(np.float32),
        "touches/place": touch,
        "touches/covariance": np.stack([np.eye(3), np.full((3, 3), np.nan)]),
        "touches/identity": np.array([4, -1]),
        "start/motion": rng.normal(size=9),
        "start/rest": rng.normal(size=4),
        "start/touches": touch,
        "start/from_strain": touch,
        layout.LAST: np.asarray(16 + number),
    }
    row["frames/truth"][0] = (60.1, 70.2, 1.0 + number, 0.0)
    return {layout.CHECK: layout.frame_check(row), **row}


def make_recording(path: Path) -> None:
    """Write a short recording with the program's own writer."""
    first = recorded_frame(0)
    shapes = {name: (part.shape, part.dtype.str[1:]) for name, part in first.items()}
    reference = ReferenceFrame(np.linspace(20, 200, np.prod(SHAPE), dtype="f4").reshape(SHAPE), 2.0)
    scene = rig.load("twin", {"camera.pixels": [4 * SHAPE[1], 4 * SHAPE[0]]})
    path.unlink(missing_ok=True)
    writer = Writer(path, {"scene": scene.model_dump_json()}, reference, shapes)
    for number in range(FRAMES):
        writer.append(recorded_frame(number))
    writer.close()


def mutate_recording(content: bytes, rng: Rng) -> bytes:
    """Change bytes, or a number behind the checksum's back."""
    if rng.random() < 0.7:
        return mutate_bytes(content, rng)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "session.h5"
        path.write_bytes(content)
        with h5py.File(path, "r+") as file:
            _forge(file, rng)
        return path.read_bytes()


def _forge(file: Any, rng: Rng) -> None:
    """Put a number that cannot be into a recording, with the right checksum."""
    value, name = rng.choice(NO_NUMBERS), str(rng.choice(FORGED))
    if name == "reference":
        file[name].attrs["noise"] = value
        return
    number = int(rng.integers(FRAMES))
    row = recorded_frame(number)
    row[name].flat[0] = value
    file[name][number] = row[name]
    file[layout.CHECK][number] = layout.frame_check(row)


def read_recording(path: Path) -> Wrong:
    """Read all frames of a recording as replay, playback and scores do."""
    with open_session(path) as session:
        if session.frames < FRAMES and not session.cut:
            yield "frames are missing, and nothing is said of it"
        session.columns()
        for index in range(session.frames):
            row = session.row(index)
            frame(row)
            reported(row)
            for name, written in recorded_frame(index).items():
                if not np.array_equal(row[name], written, equal_nan=True):
                    yield f"{name} of frame {index} is other than it was written"
        reference = np.linspace(20, 200, np.prod(SHAPE), dtype="f4").reshape(SHAPE)
        if not np.array_equal(session.reference.image, reference) or session.reference.noise != 2:
            yield "the reference is other than it was written"
        yield from out_of_range(session.scene.model_dump())
        if session.scene != Scene.model_validate(session.scene.model_dump()):
            yield "the scene is other"


def computed() -> cache.Arrays:
    """Return what a plate leaves in the cache, made small."""
    rng = np.random.default_rng(1)
    return {"a": rng.normal(size=(20, 30)), "b": np.arange(7), "c": np.array(3.0)}


@contextmanager
def cache_in(folder: Path) -> Generator[None]:
    """Let the cache lie in a folder."""
    before = os.environ.get("TOUCHPLATE_CACHE")
    os.environ["TOUCHPLATE_CACHE"] = str(folder)
    try:
        yield
    finally:
        os.environ.pop("TOUCHPLATE_CACHE")
        if before is not None:
            os.environ["TOUCHPLATE_CACHE"] = before


def make_cache(path: Path) -> None:
    """Write an entry of the cache, and put it where it is wanted."""
    with cache_in(path.parent / "cache"):
        path.unlink(missing_ok=True)
        cache.fetch("study", 1, computed)
    entry(path).replace(path)


def entry(path: Path) -> Path:
    """Where the cache looks for the entry."""
    return path.parent / "cache" / "study" / f"{cache.key('study', 1)}.npz"


def read_cache(path: Path) -> Wrong:
    """Ask the cache for what the file held."""
    entry(path).write_bytes(path.read_bytes())
    with cache_in(path.parent / "cache"), warnings.catch_warnings():
        warnings.simplefilter("ignore", cache.CacheWarning)
        yield from _same_arrays(cache.fetch("study", 1, computed))
        yield from _same_arrays(cache.fetch("study", 1, dict))  # it has healed


def _same_arrays(found: Mapping[str, AnyArray]) -> Wrong:
    for name, array in computed().items():
        if name not in found or not np.array_equal(found[name], array):
            yield f"{name} is other than it was computed"


def double(x: int) -> int:
    """Give something to compile."""
    return 2 * x


def compiled(path: Path) -> tuple[int, list[Path]]:
    """Run a kernel as a new process would, with its code in the folder of `path`."""
    config: Any = importlib.import_module("numba").config
    with cache_in(path.parent):  # which leaves the environment as it was
        os.environ["NUMBA_CACHE_DIR"] = str(path.parent / "kernels")
        config.reload_config()
        try:
            njit = importlib.import_module("dic.compiled").njit
            result = njit(cache=True, nogil=True)(double)(21)
        finally:
            os.environ.pop("NUMBA_CACHE_DIR")
            config.reload_config()
    return result, sorted((path.parent / "kernels").rglob("*.nb?"))


def make_kernel(path: Path) -> None:
    """Compile, and put the code where it is wanted."""
    _, files = compiled(path)
    path.write_bytes(files[0].read_bytes())


def read_kernel(path: Path) -> Wrong:
    """Run the kernel with changed code."""
    _, files = compiled(path)
    files[0].write_bytes(path.read_bytes())
    for _ in range(2):
        if compiled(path)[0] != 42:
            yield "the kernel gives another number"


KINDS: Mapping[str, Kind] = {
    "scene": Kind(".toml", make_scene, mutate_text, read_scene),
    "calibration": Kind(".json", make_calibration, mutate_text, read_calibration),
    "setup": Kind(".setup.json", make_setup, mutate_text, read_setup),
    "model": Kind(".h5", make_model, mutate_model, read_model),
    "recording": Kind(".h5", make_recording, mutate_recording, read_recording),
    "cache": Kind(".npz", make_cache, mutate_bytes, read_cache),
    "kernel": Kind(".nbc", make_kernel, mutate_bytes, read_kernel),
}
