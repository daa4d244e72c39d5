"""Whether what a recording holds can be: its arrays, their shapes, and the numbers of each frame.

A disk, a cable or another program may have changed a byte. A checksum is compared where there is
one; numbers are looked at besides, since other programs can write recordings too.
"""

# h5py has no types.
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false
from __future__ import annotations

import zlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, cast

import numpy as np

from rig.live.baseline import ReferenceFrame
from rig.live.noise_curve import COUNT
from rig.recording.fit import SHAPES as FIT_SHAPES, wrong_fit
from rig.recording.layout import CHECK, CURVE, FRAMES, LAST, TARES, frame_check, tare_shapes
from rig.system.arrays import F32, F64, AnyArray

if TYPE_CHECKING:
    import h5py

LARGE = 1e12  # of any place, force or time: beyond it a number is damaged
WHITE = 65535.0  # grey levels
MANY_FRAMES = 100_000  # of a reference: a minute at a thousand a second is less
COVARIANCE = "touches/covariance"
NEEDED: Mapping[str, tuple[str, tuple[int, ...]]] = {
    "frames/image": ("u", (0, 0)),
    "frames/captured": ("f", ()),
    "frames/truth": ("f", (0, 4)),
    "frames/truth_known": ("u", ()),
    "touches/place": ("f", (0, 3)),
    COVARIANCE: ("f", (0, 3, 3)),
    "touches/identity": ("i", (0,)),
    "start/motion": ("f", (0,)),
    "start/rest": ("f", (0,)),
    "start/touches": ("f", (0, 3)),
    "start/from_strain": ("f", (0, 3)),
    LAST: ("i", ()),
}
"""Kind of number and shape of a frame's part; 0 for any length."""

LEFT, TRACE, SCATTER = "start/left", "start/trace", "start/trace_scatter"
UNSEEN = "start/unseen"
TRACES: Mapping[str, tuple[str, tuple[int, ...]]] = {
    LEFT: ("f", (0, 3)),
    TRACE: ("f", (0,)),
    SCATTER: ("f", (0, 0)),
}
"""As `NEEDED`, of recordings that hold what is known of traces: all of it or none."""

FIT: Mapping[str, tuple[str, tuple[int, ...]]] = {
    name: (kind[0], shape) for name, (shape, kind) in FIT_SHAPES.items()
}
"""As `NEEDED`, of recordings that hold how well touches explained a frame: all of it or none."""

ALWAYS = ("frames/captured", "start/motion", "start/rest")
"""Numbers that are there in every frame; others are NaN where a touch is not."""

BOUNDED = (
    *ALWAYS,
    "frames/truth",
    "touches/place",
    "start/touches",
    "start/from_strain",
    "start/held",
    "start/moved",
    LEFT,
    TRACE,
    SCATTER,
    UNSEEN,
)


def wrong_layout(arrays: Mapping[str, h5py.Dataset], reference: tuple[int, ...]) -> str:
    """Say what is wrong with the arrays of a file; empty where nothing is."""
    wanted = {**NEEDED}
    wanted |= TRACES if TRACE in arrays or SCATTER in arrays else {}
    wanted |= FIT if FIT.keys() & arrays.keys() else {}
    wanted |= {UNSEEN: ("f", ())} if UNSEEN in arrays else {}
    for name, (kind, shape) in wanted.items():
        array = arrays.get(name)
        if array is None:
            return f"{name} is missing"
        fits = len(array.shape) == 1 + len(shape) and all(
            want in (0, there) for want, there in zip(shape, array.shape[1:], strict=False)
        )
        if not fits or array.dtype.kind != kind:
            return f"{name} is {array.dtype} {array.shape}"
    if arrays["frames/image"].shape[1:] != reference:
        return f"images are {arrays['frames/image'].shape[1:]} and the reference is {reference}"
    return ""


def read_reference(stored: h5py.Dataset) -> tuple[ReferenceFrame, str]:
    """Read the reference; the text says what is wrong with it, and is empty where nothing is."""
    image = cast(F32, np.asarray(stored[()]))
    noise = float(np.asarray(stored.attrs["noise"], dtype=np.float64))
    check = int(np.asarray(stored.attrs["check"])) if "check" in stored.attrs else None
    frames = int(np.asarray(stored.attrs.get("frames", 0)))  # older recordings do not say
    reference = ReferenceFrame(image, noise, _curve(stored.attrs.get("curve")), frames)
    return reference, _wrong_reference(reference, check)


def read_tare(arrays: Mapping[str, h5py.Dataset], number: int) -> tuple[ReferenceFrame, str]:
    """Read the reference of a tare, counted from 1; the text is as that of `read_reference`."""
    image, noise, check = (
        np.asarray(arrays[f"{TARES}{name}"][number - 1]) for name in ("image", "noise", "check")
    )
    curve = _curve(arrays[CURVE][number - 1]) if CURVE in arrays else None
    frames = int(arrays[FRAMES][number - 1]) if FRAMES in arrays else 0
    reference = ReferenceFrame(cast(F32, image), float(noise), curve, frames)
    return reference, _wrong_reference(reference, int(check))


def _curve(stored: object) -> F64 | None:
    """Variance by grey level, (17,); None where it was not known."""
    if stored is None:
        return None
    curve = np.asarray(stored, dtype=np.float64)
    return None if np.isnan(curve).all() else curve


def wrong_tares(arrays: Mapping[str, h5py.Dataset], shape: tuple[int, ...]) -> str:
    """Say what is wrong with the arrays of the tares; empty where nothing is, or none are."""
    for name, (part, kind) in tare_shapes(shape).items() if arrays else ():
        array = arrays.get(name)
        if array is None and name in (CURVE, FRAMES):  # of older recordings
            continue
        if array is None:
            return f"{name} is missing"
        if array.shape[1:] != part or array.dtype != np.dtype(kind):
            return f"{name} is {array.dtype} {array.shape}"
    return ""


def _wrong_reference(reference: ReferenceFrame, check: int | None) -> str:
    """Say what is wrong with a reference; empty where nothing is."""
    image, noise, curve = reference.image, reference.noise, reference.curve
    if image.ndim != 2 or image.dtype != np.float32 or not image.size:
        return f"reference is {image.dtype} {image.shape}"
    if check is not None and _crc(image) != check:
        return "the checksum of the reference is another"
    if not (np.isfinite(image).all() and image.min() >= -WHITE and image.max() <= WHITE):
        return "grey levels of the reference are none"
    if not 0 <= noise <= WHITE:
        return f"noise is {noise:g} grey levels"
    if not 0 <= reference.frames <= MANY_FRAMES:
        return f"the reference is the mean of {reference.frames} frames"
    if curve is not None and not (curve.shape == (COUNT,) and (curve > 0).all()):
        return "variances by grey level are none"
    return ""


def wrong_numbers(row: Mapping[str, AnyArray]) -> str:
    """Say what is wrong with the numbers of a frame; empty where nothing is."""
    if CHECK in row and int(row[CHECK]) != int(frame_check(row)):
        return "its checksum is another"
    for name in BOUNDED:
        numbers = np.asarray(row.get(name, 0.0))
        absent = np.isnan(numbers)
        if (np.abs(numbers[~absent]) > LARGE).any() or (name in ALWAYS and absent.any()):
            return f"{name} holds a number that cannot be"
    spread = np.asarray(row.get(COVARIANCE, np.zeros((0, 3, 3))))
    known = spread[np.isfinite(spread).all(axis=(1, 2))]  # infinite where nothing is known
    if (np.abs(known) > LARGE**2).any() or (np.diagonal(known, axis1=1, axis2=2) < 0.0).any():
        return f"{COVARIANCE} is no covariance"
    return wrong_fit(row) or (_wrong_traces(row) if SCATTER in row else "")


def _wrong_traces(row: Mapping[str, AnyArray]) -> str:
    """Say what is wrong with what is known of traces; empty where nothing is."""
    count = 3 * int(np.isfinite(np.asarray(row[LEFT])[:, 0]).sum())
    part, scatter = np.asarray(row[TRACE])[:count], np.asarray(row[SCATTER])[:count, :count]
    try:
        np.linalg.cholesky(scatter)
    except np.linalg.LinAlgError:
        return f"{SCATTER} is no covariance"
    fits = scatter.shape == (count, count) and np.isfinite(part).sum() == count
    return "" if fits and np.isfinite(scatter).all() else f"{TRACE} does not fit its touches"


def first_wrong(columns: Mapping[str, AnyArray]) -> tuple[int, str] | None:
    """First frame of which the numbers are wrong, and what is; None where none is."""
    for index in range(min(len(column) for column in columns.values())):
        said = wrong_numbers({name: column[index] for name, column in columns.items()})
        if said:
            return index, said
    return None


def _crc(image: AnyArray) -> int:
    return zlib.crc32(np.ascontiguousarray(image).data)
