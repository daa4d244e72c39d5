"""Reads the result of a whole test: its points, its frames and their fields."""

# h5py has no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
from __future__ import annotations

from collections.abc import Collection, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import dic
from rig.series.invariants import Invariant, derived
from rig.series.parts import FIELDS
from rig.series.result import FORMAT, VERSION
from rig.system.arrays import AnyArray

if TYPE_CHECKING:
    import h5py

_DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, IndexError)
_LOOKED_AT = 1 << 20  # bytes at the start of a file among which the name of its format stands


@dataclass(frozen=True, eq=False)
class SeriesResult:
    """An open result; use `open_result`.

    Attributes
    ----------
    path : Path
    grid : dic.Grid
        Its points, R rows and C columns.
    names, errors : tuple of str
        What each frame is called, and what kept it out; "" where nothing did.
    fields : tuple of str
        Fields of each frame, `status` the last; invariants that the file does not hold among them.
    image : (H, W)
        The reference, grey levels.
    settings : mapping
        Attributes of the file: subset, step, definition of strain, scale.
    places : (R, C, 2) float64, mm, or None
        Where the points are on the object; None where the test has no scale.
    """

    path: Path
    grid: dic.Grid
    names: tuple[str, ...]
    errors: tuple[str, ...]
    fields: tuple[str, ...]
    image: AnyArray
    settings: Mapping[str, Any]
    places: AnyArray | None
    arrays: Mapping[str, h5py.Dataset | Invariant]

    def field(self, name: str, number: int) -> AnyArray:
        """Return a field of a frame, (R, C).

        Raises
        ------
        ValueError
            There is no field of that name.
        OSError
            That part of the file is damaged.
        """
        self._require(name)
        try:
            return np.asarray(self.arrays[name][number])
        except _DAMAGE as error:
            raise OSError(
                f"'{self.path}' is damaged at frame {number + 1}; correlate the test again"
            ) from error

    def unit(self, name: str) -> str:
        """Return the unit of a field.

        Raises
        ------
        ValueError
            There is no field of that name.
        """
        self._require(name)
        return str(self.arrays[name].attrs.get("unit", "1"))

    def frame(self, number: int) -> dict[str, AnyArray]:
        """Return all fields of a frame, (R, C) each.

        Raises
        ------
        OSError
            That part of the file is damaged.
        """
        return {name: self.field(name, number) for name in self.fields}

    def _require(self, name: str) -> None:
        if name not in self.arrays:
            raise ValueError(
                f"'{self.path}' holds no field '{name}'; name one of {', '.join(self.fields)}"
            )


def is_result(path: Path) -> bool:
    """Whether a file calls itself the result of a whole test, be it whole or cut short."""
    if not path.is_file():
        return False
    with path.open("rb") as raw:
        return FORMAT.encode() in raw.read(_LOOKED_AT)


@contextmanager
def open_result(path: Path) -> Generator[SeriesResult]:
    """Open the result of a whole test.

    Raises
    ------
    OSError
        There is no such file, or it is no result, damaged, cut short or of another version.
    """
    import h5py

    if path.is_dir():
        raise OSError(f"result '{path}' is a folder; name the fields.h5 in it")
    if not path.is_file():
        raise OSError(f"result '{path}' does not exist; check the path")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise OSError(
            f"'{path}' is cut short, damaged or no HDF5 file; correlate the test again"
        ) from error
    with file:
        _check(path, file.attrs)
        try:
            result = _read(path, file)
        except _DAMAGE as error:
            reason = " ".join(str(error).split())
            raise OSError(f"'{path}' is damaged ({reason}); correlate the test again") from error
        yield result


def _check(path: Path, attributes: Mapping[str, Any]) -> None:
    if attributes.get("format") != FORMAT:
        raise OSError(
            f"'{path}' is no result of a whole test; name a fields.h5 that `touchplate correlate`"
            " has written"
        )
    version = attributes.get("version")
    if version != VERSION:
        raise OSError(
            f"'{path}' has version {version} and this program reads {VERSION}; correlate the test"
            " again"
        )


def _read(path: Path, file: Any) -> SeriesResult:
    settings: dict[str, Any] = dict(file.attrs)
    xs, ys = np.asarray(file["x"][()]), np.asarray(file["y"][()])
    grid = dic.Grid(xs, ys, int(settings["subset"]), int(settings["step"]))
    names = tuple(name.decode() for name in file["frame"][()])
    shape = len(names), *grid.shape
    arrays = {name: item for name, item in file.items() if item.ndim == 3 and name != "place"}
    wrong = [name for name, item in arrays.items() if item.shape != shape]
    if wrong or "status" not in arrays or not names:
        raise ValueError(f"field {(wrong or ['status'])[0]} is not of {shape}")
    arrays |= derived(arrays)
    return SeriesResult(
        path=path,
        grid=grid,
        names=names,
        errors=tuple(error.decode() for error in file["error"][()]),
        fields=_in_order(arrays),
        image=np.asarray(file["image"][()]),
        settings=settings,
        places=np.asarray(file["place"][()]) if "place" in file else None,
        arrays=arrays,
    )


def _in_order(names: Collection[str]) -> tuple[str, ...]:
    """Return what every result has first, and the status last."""
    more = [name for name in names if name not in FIELDS and name != "status"]
    return (*(name for name in FIELDS if name in names), *more, "status")
