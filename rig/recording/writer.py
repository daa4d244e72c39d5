"""Writes a recording: after each frame the file on disk is whole, whatever happens next."""

# h5py has no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
from __future__ import annotations

import zlib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rig.live.baseline import ReferenceFrame
from rig.recording.layout import FORMAT, IMAGES, LAST, VERSION, Shapes, tare_row, tare_shapes
from rig.recording.swmr_flag import SUPERBLOCK, unmarked
from rig.system.arrays import AnyArray
from rig.system.deflate import deflate

if TYPE_CHECKING:
    import h5py

MANY = 64  # frames whose small numbers share a chunk


class Writer:
    """Appends frames to a new file, in HDF5's mode of a single writer and many readers (SWMR).

    A chunk of images is deflated here, where Python's lock is free meanwhile, and handed to HDF5
    as it is; runs of equal bytes are all that is looked for, since noise has no other patterns.

    Parameters
    ----------
    path : Path
    texts : mapping
        Attributes of the file.
    reference : ReferenceFrame
    layout : Shapes

    Raises
    ------
    OSError
        If the file exists or cannot be made.
    """

    def __init__(
        self, path: Path, texts: Mapping[str, str], reference: ReferenceFrame, layout: Shapes
    ):
        import h5py

        self._file = h5py.File(path, "x", libver="latest")
        self._file.attrs["version"] = VERSION
        for name, text in {"format": FORMAT, **texts}.items():
            # Of fixed length: HDF5 keeps others where it sums nothing up, and loops over damage.
            self._file.attrs[name] = np.bytes_(text.encode())
        stored = self._file.create_dataset("reference", data=reference.image)
        stored.attrs["noise"] = reference.noise
        if reference.curve is not None:
            stored.attrs["curve"] = reference.curve
        stored.attrs["frames"] = reference.frames
        stored.attrs["check"] = zlib.crc32(np.ascontiguousarray(reference.image).data)
        self._arrays = {name: _create(self._file, name, *layout[name]) for name in layout}
        tares = tare_shapes(reference.image.shape)
        self._tares = {name: _create(self._file, name, *tares[name]) for name in tares}
        self._file.swmr_mode = True
        self._raw = path.open("r+b", buffering=0)
        self._flush()
        self.frames = self.renewed = 0

    def renew(self, reference: ReferenceFrame, captured: float) -> None:
        """Write a reference that frames from one captured at this time, s, are compared with.

        Raises
        ------
        OSError
            If it does not fit.
        """
        row = tare_row(reference, captured)
        for name, array in self._tares.items():
            _append(array, self.renewed, row[name], deflated=name in IMAGES)
        self._flush()
        self.renewed += 1

    def append(self, rows: Mapping[str, AnyArray]) -> None:
        """Write one frame and hand it to the system.

        Raises
        ------
        OSError
            If it does not fit.
        """
        for name, array in self._arrays.items():
            if name == LAST:  # the others are on their way before a frame counts as whole
                self._flush()
            _append(array, self.frames, rows[name], deflated=name in IMAGES)
        self._flush()
        self.frames += 1

    def close(self) -> None:
        """End the file; other programs open it without further ado from now on."""
        self._file.close()
        self._raw.close()

    def abandon(self) -> None:
        """End a file that did not take a frame: it reads like one whose writer was killed.

        HDF5 cannot close it in order, and would mark it as closed and longer than it is.
        """
        with suppress(OSError, RuntimeError):
            self._file.close()
        self._put(self._whole)
        self._raw.close()

    def _flush(self) -> None:
        """Hand all to the system, so that any program could open it now."""
        self._file.flush()
        self._raw.seek(0)
        self._whole = unmarked(self._raw.read(SUPERBLOCK))
        self._put(self._whole)

    def _put(self, superblock: bytes) -> None:
        self._raw.seek(0)
        self._raw.write(superblock)


def _create(file: h5py.File, name: str, shape: tuple[int, ...], kind: str) -> h5py.Dataset:
    large = name in IMAGES
    return file.create_dataset(
        name,
        shape=(0, *shape),
        maxshape=(None, *shape),
        chunks=(1 if large else MANY, *shape),
        dtype=kind,
        compression="gzip" if large else None,
        fillvalue=np.nan if kind[0] == "f" else None,
    )


def _append(array: h5py.Dataset, index: int, part: AnyArray, *, deflated: bool) -> None:
    array.resize(index + 1, axis=0)
    if deflated:
        start = (index, *[0] * (array.ndim - 1))
        array.id.write_direct_chunk(start, deflate(part.data))
    else:
        array[index] = part
