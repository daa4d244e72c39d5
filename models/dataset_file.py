"""Writing of data sets: block by block, gone on with after a kill.

The rows lie in one HDF5 file that has its full size from the start. `done` counts the rows that
are there; it is raised after a block and its sum are written, so that a killed run loses one block
at most and a file that is not whole says so.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from models.answer import Answer
from models.flat_file import Place, lay_out
from models.plan import BLOCK, Plan
from models.samples import ARRAYS, FORMAT, VERSION, checksum, open_dataset

__all__ = ["write_dataset"]


def write_dataset(
    path: str | Path,
    plan: Plan,
    answer: Answer,
    gauges: NDArray[np.float64],
    about: Mapping[str, Any],
    progress: Callable[[int, int], object] | None = None,
) -> int:
    """Write the samples of a plan, or those that an earlier run did not get to.

    The same arguments make the same bytes, whether the run was cut off or not, as long as NumPy and
    HDF5 are the same.

    Parameters
    ----------
    path
        Its folder is made where it is missing.
    plan
        Touches of each sample.
    answer
        From touches to strain.
    gauges
        (M, 2) float64, mm, whose strain `answer` gives.
    about
        Whatever names the bench and the plan, as plain values that JSON can hold.
    progress
        Called with the rows done and their number.

    Returns
    -------
    Number of rows that were there already.

    Raises
    ------
    OSError
        When the file cannot be written.
    ValueError
        When there is a file of something else, or one begun with other values.
    """
    path = Path(path)
    head = {
        "format": FORMAT,
        "version": VERSION,
        "rows_a_block": BLOCK * plan.copies,
        "about": json.dumps(dict(about), sort_keys=True),
    }
    if path.is_dir():
        raise IsADirectoryError(f"data set {path} is a folder; give the name of a file in it")
    try:
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            lay_out(path, head, _shapes(plan, len(gauges)))
        return _fill(path, head, plan, answer, gauges, progress or (lambda done, rows: None))
    except OSError as error:
        raise OSError(
            f"data set {path} cannot be written ({error.strerror or error}); free space there and "
            "run again to go on, or choose another place"
        ) from error


def _shapes(plan: Plan, gauges: int) -> dict[str, tuple[tuple[int, ...], str]]:
    shapes = (
        ((plan.rows, gauges, 3), "<f4"),
        ((plan.rows, plan.touches, 3), "<f8"),
        ((gauges, 2), "<f8"),
        ((plan.blocks,), "<u4"),
        ((1,), "<u8"),
    )
    return dict(zip(ARRAYS, shapes, strict=True))


def _fill(
    path: Path,
    head: Mapping[str, Any],
    plan: Plan,
    answer: Answer,
    gauges: NDArray[np.float64],
    progress: Callable[[int, int], object],
) -> int:
    """Write the blocks that are missing; return the rows that were not."""
    found, places = open_dataset(path)
    _check_same(path, json.loads(head["about"]), json.loads(found["about"]))
    size = head["rows_a_block"]
    before = int(places["done"].map(path)[0])
    _check_last(path, plan, answer, places, -(-before // size))
    with path.open("r+b") as file:
        places["gauges"].put(file, 0, gauges)
        for block in range(-(-before // size), plan.blocks):
            touches, strain = _compute(plan, answer, block)
            places["touches"].put(file, size * block, touches)
            places["strain"].put(file, size * block, strain)
            places["sums"].put(file, block, np.array([checksum(touches, strain)]))
            file.flush()
            done = size * block + len(touches)
            places["done"].put(file, 0, np.array([done]))
            file.flush()
            progress(done, plan.rows)
    return before


def _compute(
    plan: Plan, answer: Answer, block: int
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    # Single precision, 6e-8, is far finer than any mesh or gauge, and halves the file.
    touches = plan.block(block)
    return touches, np.asarray(answer(touches), np.float32)


def _check_last(
    path: Path, plan: Plan, answer: Answer, places: Mapping[str, Place], blocks: int
) -> None:
    """Refuse to go on where the last block written would not come out again."""
    shapes = {name: shape for name, (shape, _) in _shapes(plan, places["gauges"].shape[0]).items()}
    same = all(places[name].shape == shapes[name] for name in ARRAYS)
    if same and blocks:
        same = checksum(*_compute(plan, answer, blocks - 1)) == places["sums"].map(path)[blocks - 1]
    if not same:
        raise ValueError(
            f"data set {path} was begun by another version of this program; delete it or choose "
            "another place"
        )


def _check_same(path: Path, wanted: Any, found: Any, name: str = "") -> None:
    """Refuse a file that was begun with other values, and name the first that differs."""
    if isinstance(wanted, dict) and isinstance(found, dict):
        for key in sorted({*wanted, *found}):
            inner = f"{name}.{key}".lstrip(".")
            _check_same(path, wanted.get(key), found.get(key), inner)
    elif wanted != found:
        raise ValueError(
            f"data set {path} was begun with {name} = {json.dumps(found)}, got "
            f"{json.dumps(wanted)}; delete it or choose another place"
        )
