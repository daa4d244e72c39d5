"""Reads a recording, also one that is still written or was cut off by a crash."""

# h5py has no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
from __future__ import annotations

from collections.abc import Generator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
from pydantic import ValidationError

import fe
from models import Estimate, Result
from rig.live.baseline import ReferenceFrame
from rig.recording.fit import with_fit
from rig.recording.layout import FORMAT, IMAGES, LAST, READ, REFERENCE, TARES, there
from rig.recording.soundness import (
    first_wrong,
    read_reference,
    read_tare,
    wrong_layout,
    wrong_numbers,
    wrong_tares,
)
from rig.recording.truncated import Padded, missing, whole_frames
from rig.scene import Scene
from rig.scene.refusal import sentence
from rig.system.arrays import F64, AnyArray
from rig.system.frame import Frame

if TYPE_CHECKING:
    import h5py


DAMAGE = (
    OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, IndexError,
    MemoryError, OverflowError,
)  # fmt: skip
"""What HDF5 and h5py raise on damaged files."""


class _RefusalError(Exception):
    """A recording that can be read and not used, in a sentence."""


@dataclass(frozen=True, eq=False)
class Session:
    """An open recording; use `open_session`.

    Attributes
    ----------
    path : Path
    scene : Scene
    calibration : str
        JSON, empty where there was none.
    reference : ReferenceFrame
    frames : int
        Whole frames that it holds.
    cut : str
        What is missing, as a sentence; empty where nothing is.
    """

    path: Path
    scene: Scene
    calibration: str
    reference: ReferenceFrame
    frames: int
    arrays: Mapping[str, h5py.Dataset]
    cut: str = ""
    tares: Mapping[str, h5py.Dataset] = field(default_factory=dict[str, "h5py.Dataset"])

    def row(self, index: int) -> dict[str, AnyArray]:
        """Arrays of one frame.

        Raises
        ------
        OSError
            If that part of the file is damaged.
        """
        try:
            row = {name: array[index] for name, array in self.arrays.items()}
        except DAMAGE as error:
            raise self._damaged(index, _reason(error)) from error
        if said := wrong_numbers(row):
            raise self._damaged(index, said)
        return row

    def reference_of(self, row: Mapping[str, AnyArray]) -> tuple[int, ReferenceFrame]:
        """Give the reference that a frame was compared with, and its number: 0 for the first.

        Raises
        ------
        OSError
            If the file holds no such reference, or that part of it is damaged.
        """
        number = int(row.get(REFERENCE, np.zeros(())))
        if number == 0:
            return 0, self.reference
        try:
            held = len(self.tares[f"{TARES}image"]) if self.tares else 0
            wrong = f"there are {held} tares, and this is number {number}"
            if 0 < number <= held:
                reference, wrong = read_tare(self.tares, number)
                if not wrong:
                    return number, reference
        except DAMAGE as error:
            raise self._damaged(int(row[LAST]), _reason(error)) from error
        raise self._damaged(int(row[LAST]), wrong)

    def require_one_reference(self) -> None:
        """Refuse a recording in which the reference was renewed.

        Raises
        ------
        ValueError
            If it was.
        """
        if self.frames and self.columns().get(REFERENCE, np.zeros(1)).any():
            raise ValueError(
                f"the reference was renewed (tare) while '{self.path}' was recorded, and presses"
                " need one reference; record them without a tare"
            )

    def columns(self) -> dict[str, AnyArray]:
        """All arrays of all whole frames but the large ones.

        Raises
        ------
        OSError
            If one of them is damaged.
        """
        small = [name for name in self.arrays if name not in IMAGES]
        try:
            found = {name: np.asarray(self.arrays[name][: self.frames]) for name in small}
        except DAMAGE as error:
            raise OSError(
                f"recording '{self.path}' is damaged ({_reason(error)}); use another copy of it"
            ) from error
        if wrong := first_wrong(found):
            raise self._damaged(*wrong)
        return found

    def _damaged(self, index: int, reason: str) -> OSError:
        return OSError(
            f"frame {index} of recording '{self.path}' is damaged ({reason}); use the frames"
            " before it"
        )


def frame(row: Mapping[str, AnyArray]) -> Frame:
    """Image with its number, time and truth."""
    truth = None
    if row["frames/truth_known"]:
        truth = tuple(fe.Touch(*finger.tolist()) for finger in there(row["frames/truth"]))
    return Frame(int(row[LAST]), float(row["frames/captured"]), row["frames/image"], truth)


def reported(row: Mapping[str, AnyArray]) -> Estimate:
    """Touches that were found when a frame was recorded, and how well they explained it.

    Recordings of the release before do not hold the latter: χ² is 0 and the p-value 1.
    """
    place = there(row["touches/place"])
    blocks = row["touches/covariance"][: len(place)]
    spread = np.zeros((3 * len(place), 3 * len(place)))
    for index, block in enumerate(blocks):
        own = slice(3 * index, 3 * index + 3)
        spread[own, own] = block
    result = Result.FOUND if len(place) else Result.NO_TOUCH
    found = Estimate(place[:, :2], place[:, 2], spread, 0.0, 1, 1.0, result)
    return with_fit(found, row)


def reported_touches(session: Session, min_force: float) -> tuple[list[Estimate], list[F64]]:
    """Return what was found, and x, y, F of what was there, in frames whose source knew it.

    Frames in which something presses less than `min_force` N are left out.
    """
    columns = session.columns()
    found: list[Estimate] = []
    pressed: list[F64] = []
    for index in np.flatnonzero(columns["frames/truth_known"]):
        row = {name: column[index] for name, column in columns.items()}
        truth = there(row["frames/truth"])[:, :3]
        if (truth[:, 2] >= min_force).all():
            found.append(reported(row))
            pressed.append(truth)
    return found, pressed


@contextmanager
def open_session(path: Path) -> Generator[Session]:
    """Open a recording.

    Raises
    ------
    OSError
        If there is no such file, it is no recording, or it is damaged.
    """
    import h5py

    if path.is_dir():
        raise OSError(f"recording '{path}' is a folder; name a file *.h5 in it")
    if not path.is_file():
        raise OSError(f"recording '{path}' does not exist; check the path")
    lost = missing(path)
    with ExitStack() as stack:
        try:
            if lost:
                raw = stack.enter_context(Padded(path, lost))
                file = h5py.File(raw, "r")
            else:
                file = h5py.File(path, "r", libver="latest", swmr=_is_open(path))
            stack.enter_context(file)
        except DAMAGE as error:
            raise _unreadable(path, error) from error
        try:
            session = _read(path, file, lost)
        except _RefusalError as refusal:
            raise OSError(str(refusal)) from refusal
        except DAMAGE as error:
            raise _unreadable(path, error) from error
        yield session


def _unreadable(path: Path, error: Exception) -> OSError:
    return OSError(
        f"recording '{path}' cannot be read ({_reason(error)}); it is damaged, cut off or no"
        " recording"
    )


def _is_open(path: Path) -> bool:
    """Whether a writer has the file open, or was killed while it had.

    Then it must be read as beside a writer. A file that was closed must not: HDF5 would look for
    what was cut off again and again, as for something that is still being written. The mark is in
    the twelfth byte of the superblock (HDF5 file format specification, version 3.0, II.A).
    """
    with path.open("rb") as raw:
        return any(raw.read(12)[11:])


def _read(path: Path, file: h5py.File, lost: int) -> Session:
    if _text(file, "format") != FORMAT:
        raise _RefusalError(
            f"'{path}' is no recording of touchplate; give one that `record` has written"
        )
    if str(file.attrs["version"]) not in map(str, READ):
        raise _RefusalError(
            f"recording '{path}' has version {file.attrs['version']} and this program reads"
            f" {READ[0]} to {READ[-1]}; use the program that wrote it"
        )
    arrays: dict[str, h5py.Dataset] = {}

    def collect(name: str, item: object) -> None:
        if hasattr(item, "shape"):
            arrays[name] = cast("h5py.Dataset", item)

    file.visititems(collect)
    reference, wrong = read_reference(arrays.pop("reference"))
    tares = {name: arrays.pop(name) for name in list(arrays) if name.startswith(TARES)}
    wrong = wrong or wrong_tares(tares, reference.image.shape)
    if wrong := wrong or wrong_layout(arrays, reference.image.shape):
        raise _RefusalError(f"recording '{path}' is damaged: {wrong}; use another copy of it")
    said = min(len(array) for array in arrays.values())
    frames = whole_frames(arrays, path.stat().st_size) if lost else said
    cut = f"recording '{path}' lacks its end: {frames} of {said} frames are whole" if lost else ""
    return Session(
        path=path,
        scene=_scene(path, _text(file, "scene")),
        calibration=_text(file, "calibration"),
        reference=reference,
        frames=frames,
        arrays=arrays,
        tares=tares,
        cut=cut,
    )


def _text(file: h5py.File, name: str) -> str:
    """Text of an attribute, whether its length is fixed or not; empty where there is none."""
    stored: object = file.attrs.get(name, "")
    return stored.decode() if isinstance(stored, bytes) else str(stored)


def _scene(path: Path, text: str) -> Scene:
    try:
        return Scene.model_validate_json(text)
    except ValidationError as error:
        raise _RefusalError(
            f"recording '{path}' holds a scene that cannot be used: {sentence(error, Scene)}"
        ) from error


def _reason(error: Exception) -> str:
    return " ".join(str(error).split())
