"""Writing of data sets: block by block, gone on with after a kill.

The rows lie in one HDF5 file that has its full size from the start. `done` counts the rows that
are there; it is raised after a block and its sum are written, so that a killed run loses one block
at most and a file that is not whole says so.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from models.arrays import F32, F64
from models.data.flat_file import ArrayPlace, lay_out
from models.data.reader import ARRAYS, FORMAT, VERSION, checksum, open_dataset
from models.data.sampling_plan import BLOCK, SamplingPlan
from models.forward.simulator import Simulator
from models.workers import Map


@dataclass(frozen=True, eq=False)
class DatasetFile:
    """A data set that is begun, and may have blocks already.

    Attributes
    ----------
    path : Path
    plan : SamplingPlan
    found : int
        Rows that were there when it was opened.
    places : dict of ArrayPlace
        Where its arrays lie.
    """

    path: Path
    plan: SamplingPlan
    found: int
    places: Mapping[str, ArrayPlace]

    def fill(
        self,
        simulator: Simulator,
        progress: Callable[[int, int], object] | None = None,
        each: Map = map,
    ) -> None:
        """Write the blocks that are missing.

        Parameters
        ----------
        simulator
            From touches to the strain of the gauges.
        progress
            Called with the rows done and their number.
        each
            What computes the blocks, from `models.workers`; they are written here, in order.

        Raises
        ------
        OSError
            When the file cannot be written; the blocks before are kept.
        ValueError
            When the last block that is there would not come out again.
        """
        size = BLOCK * self.plan.copies
        first = -(-self.found // size)
        if first:
            self._check_again(simulator, first - 1)
        missing = range(first, self.plan.blocks)
        computed = each(partial(_compute, self.plan, simulator), missing)
        for block, (touches, strain) in zip(missing, computed, strict=True):
            with _sentence(self.path):
                self._put(block, touches, strain)
            if progress is not None:
                progress(size * block + len(touches), self.plan.rows)

    def _put(self, block: int, touches: F64, strain: F32) -> None:
        """Write a block and its sum, and count its rows when they are there."""
        row = BLOCK * self.plan.copies * block
        with self.path.open("r+b") as file:
            self.places["touches"].put(file, row, touches)
            self.places["strain"].put(file, row, strain)
            self.places["sums"].put(file, block, np.array([checksum(touches, strain)]))
            file.flush()
            self.places["done"].put(file, 0, np.array([row + len(touches)]))

    def _check_again(self, simulator: Simulator, block: int) -> None:
        """Refuse to go on where a block that is there would not come out again."""
        there = self.places["sums"].map(self.path)[block]
        if checksum(*_compute(self.plan, simulator, block)) != there:
            raise _other_version(self.path)


def begin_dataset(
    path: str | Path, plan: SamplingPlan, gauges: F64, about: Mapping[str, Any]
) -> DatasetFile:
    """Lay out the file of a data set, or open the one that an earlier run began.

    The same arguments and results make the same bytes, whether a run was cut off or not, as long as
    NumPy and HDF5 are the same.

    Parameters
    ----------
    path
        Its folder is made where it is missing.
    plan
        Touches of each sample.
    gauges
        (M, 2) float64, mm, whose strain is to be kept.
    about
        Whatever names the bench and the plan, as plain values that JSON can hold.

    Raises
    ------
    OSError
        When the file cannot be written.
    ValueError
        When there is a file of something else, or one begun with other values.
    """
    path, text = Path(path), json.dumps(dict(about), sort_keys=True)
    if path.is_dir():
        raise IsADirectoryError(f"data set {path} is a folder; give the name of a file in it")
    shapes = _shapes(plan, len(gauges))
    with _sentence(path):
        if not path.exists():
            head = {"format": FORMAT, "version": VERSION, "block": BLOCK * plan.copies}
            path.parent.mkdir(parents=True, exist_ok=True)
            lay_out(path, head | {"about": text}, shapes)
    head, places = open_dataset(path)
    _check_same(path, json.loads(text), json.loads(head["about"]))
    if any(places[name].shape != shape for name, (shape, _) in shapes.items()):
        raise _other_version(path)
    with _sentence(path), path.open("r+b") as file:
        places["gauges"].put(file, 0, gauges)
    return DatasetFile(path, plan, int(places["done"].map(path)[0]), places)


def _shapes(plan: SamplingPlan, gauges: int) -> dict[str, tuple[tuple[int, ...], str]]:
    shapes = (
        ((plan.rows, gauges, 3), "<f4"),
        ((plan.rows, plan.touches, 3), "<f8"),
        ((gauges, 2), "<f8"),
        ((plan.blocks,), "<u4"),
        ((1,), "<u8"),
    )
    return dict(zip(ARRAYS, shapes, strict=True))


def _compute(plan: SamplingPlan, simulator: Simulator, block: int) -> tuple[F64, F32]:
    # Single precision, 6e-8, is far finer than any mesh or gauge, and halves the file.
    touches = plan.block(block)
    return touches, np.asarray(simulator(touches), np.float32)


@contextmanager
def _sentence(path: Path) -> Generator[None, None, None]:
    """Turn what the system says inside into one sentence with the remedy."""
    try:
        yield
    except OSError as error:
        raise OSError(
            f"data set {path} cannot be written ({error.strerror or error}); free space there and "
            "run again to go on, or choose another place"
        ) from error


def _other_version(path: Path) -> ValueError:
    return ValueError(
        f"data set {path} was begun by another version of this program; delete it or choose "
        "another place"
    )


def _check_same(path: Path, wanted: Any, found: Any, name: str = "") -> None:
    """Refuse a file that was begun with other values, and name the first that differs."""
    if isinstance(wanted, dict) and isinstance(found, dict):
        one, other = cast("dict[str, Any]", wanted), cast("dict[str, Any]", found)
        for key in sorted({*one, *other}):
            _check_same(path, one.get(key), other.get(key), f"{name}.{key}".lstrip("."))
    elif wanted != found:
        raise ValueError(
            f"data set {path} was begun with {name} = {json.dumps(found)}, got "
            f"{json.dumps(wanted)}; delete it or choose another place"
        )
