"""Follow a whole test frame by frame, with a reference that is renewed, gone on after a kill.

What goes from one frame to the next is kept beside the parts, so that a test that was killed ends
in the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import dic
from dic import export
from rig.series.frames import Frames
from rig.series.measure import kind_of, nothing_measured
from rig.series.parts import missing_part, write_part
from rig.series.tabulate import StrainOptions, strained
from rig.system.arrays import AnyArray

_STATE = "state.npz"
_ARRAYS = (
    "xy", "u", "v", "sigma_u", "sigma_v", "gradient", "sigma_gradient", "zncc", "iterations",
    "valid_fraction", "status",
)  # fmt: skip
_DAMAGE = (OSError, ValueError, KeyError, EOFError)
_NONE = -1  # number of a frame that there is not


@dataclass(frozen=True, eq=False)
class _Point:
    """How far a test has come: frames done, frames of which two images are, what goes on."""

    done: int
    before: int
    renewed_at: int
    base: dic.Reference
    state: dic.SequenceState


def follow_frames(
    ref: dic.Reference,
    frames: Frames,
    parts: Path,
    strain: StrainOptions,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Write the parts of all frames in turn, as `dic.correlate_sequence` measures them.

    A frame that cannot be read or does not fit leaves a sentence in its part, and the next one is
    compared as if it were not there.

    Raises
    ------
    ValueError
        The field is not one of subsets.
    """
    if strain.field != "subset":
        kind = kind_of(strain.field)
        raise ValueError(f"--follow measures subsets, not --field {kind}; leave out one")
    total, point = len(frames.names), _restored(ref, frames, parts)
    report(point.done, total)
    for number in range(point.done, total):
        try:
            image = frames.read(number)
            found, base, state = dic.follow_frame(ref, point.base, point.state, image)
            table = strained(found, strain).table(strain.fields)
            error = nothing_measured(found, image)
        except (OSError, ValueError) as refusal:
            table, error = missing_part(strain.fields, len(ref.xy)), str(refusal)
            point = _Point(number + 1, point.before, point.renewed_at, point.base, point.state)
        else:
            renewed = state.renewals > point.state.renewals
            at = point.before if renewed else point.renewed_at
            point = _Point(number + 1, number, at, base, state)
        write_part(parts, number, table, error)
        _keep(parts / _STATE, point)
        report(number + 1, total)


def _keep(path: Path, point: _Point) -> None:
    numbers = (point.done, point.before, point.renewed_at, point.state.renewals)
    fields = {"start": point.state.start, "last": point.state.last}
    arrays: dict[str, AnyArray] = {
        f"{which}_{name}": getattr(field, name)
        for which, field in fields.items()
        if field is not None
        for name in (*_ARRAYS, "prefilter")
    }
    with export.aside(path) as draft, draft.open("wb") as file:
        np.savez(file, allow_pickle=False, numbers=np.array(numbers), **arrays)


def _restored(ref: dic.Reference, frames: Frames, parts: Path) -> _Point:
    """Where a killed test goes on; its first frame where there is nothing to go on from."""
    first = _Point(0, _NONE, _NONE, ref, dic.SequenceState())
    if not (parts / _STATE).exists():
        return first
    try:
        with np.load(parts / _STATE, allow_pickle=False) as file:
            done, before, renewed_at, renewals = file["numbers"].tolist()
            start, last = (_field(file, which, ref) for which in ("start", "last"))
    except _DAMAGE:
        return first
    base = ref
    if start is not None:
        base = dic.renewed_reference(ref, start, frames.read(renewed_at))
    image = None if before == _NONE else frames.read(before)
    return _Point(done, before, renewed_at, base, dic.SequenceState(start, last, image, renewals))


def _field(
    file: dict[str, AnyArray], which: str, ref: dic.Reference
) -> dic.DisplacementField | None:
    if f"{which}_u" not in file:
        return None
    arrays = {name: file[f"{which}_{name}"] for name in _ARRAYS}
    grid = ref.grid if len(arrays["u"]) == len(ref.xy) else None
    prefilter = float(file[f"{which}_prefilter"])
    return dic.DisplacementField(
        **arrays, subset=ref.subset, order=ref.order, grid=grid, prefilter=prefilter
    )
