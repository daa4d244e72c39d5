"""Recordings, changed."""

# h5py has no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import h5py
import numpy as np

import rig
from rig.live.baseline import ReferenceFrame
from rig.recording import layout
from rig.recording.session import frame, open_session, reported
from rig.recording.writer import Writer
from rig.scene import Scene
from rig.studies.files.kind import NO_NUMBERS, Kind, Wrong
from rig.studies.files.limits import out_of_range
from rig.studies.files.mutation import Rng, mutate_bytes
from rig.system.arrays import AnyArray

SHAPE, FRAMES = (24, 32), 4
FIT = {
    "touches/result": np.asarray(0),
    "touches/p_value": np.asarray(0.25),
    "touches/chi2": np.asarray(101.5),
    "touches/dof": np.asarray(97),
    "touches/sentence": np.frombuffer(b"one touch".ljust(400, b"\0"), np.uint8),
}
FORGED = (
    "frames/captured",
    "frames/truth",
    "touches/place",
    "touches/result",
    "touches/p_value",
    "touches/chi2",
    "touches/dof",
    "start/motion",
    "start/trace_scatter",
    "reference",
)


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
        **FIT,
        "start/motion": rng.normal(size=9),
        "start/rest": rng.normal(size=4),
        "start/touches": touch,
        "start/from_strain": touch,
        "start/held": touch,
        "start/moved": touch[:, :2],
        "start/left": touch,
        "start/covered": touch[1:],
        "start/unseen": np.asarray(0.03),
        "start/trace": np.array([0.5, 0.1, -0.2] + [np.nan] * 3),
        "start/trace_scatter": layout.padded(np.diag([1.0, 0.5, 0.25]), 6),
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
    row[name] = _with(row[name], value)
    file[name][number] = row[name]
    file[layout.CHECK][number] = layout.frame_check(row)


def _with(array: AnyArray, value: float) -> AnyArray:
    """Array whose first number is another one: of whole numbers the smallest or the largest."""
    forged = array.copy()
    if np.issubdtype(array.dtype, np.integer):
        limits = np.iinfo(array.dtype)
        forged.flat[0] = limits.max if value > 0 else limits.min
    else:
        forged.flat[0] = value
    return forged


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


RECORDING = Kind(".h5", make_recording, mutate_recording, read_recording)
