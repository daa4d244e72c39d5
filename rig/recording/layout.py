"""What stands where in a recording.

=====================  =====================  =====================================================
/reference             (H, W) float32         mean of the reference frames; attributes `noise`,
                                              `curve`, its variance by grey level, and `frames`,
                                              how many they are, 0 where that is not known
/frames/image          (N, H, W) uint8        images
/frames/sequence       (N,) int64             numbers that the source gave them; written last
/frames/captured       (N,) float64, s        monotonic clock
/frames/truth          (N, 10, 4) float64     x, y mm, force N, radius mm of what pressed
/frames/truth_known    (N,) uint8             whether the source knew what pressed
/frames/sums           (N, R, C, 5) float32   Σfx e, Σfy e, Σe, Σe², Σe f of the tiles
/frames/strain         (N, R, C, 3) float32   exx, eyy, exy on the same tiles; none without strain
/touches/place         (N, n, 3) float64      x, y mm, force N of what was found
/touches/covariance    (N, n, 3, 3) float64   of x, y, force
/touches/identity      (N, n) int64           the same for a touch that goes on; -1 where none is
/touches/from_strain   (N, n, 3) float64      as place, from strain alone
/touches/result        (N,) int64             0 found, 1 no touch, 2 unresolvable
/touches/p_value       (N,) float64           of a larger χ², see `Estimate`
/touches/chi2          (N,) float64           sum of squared whitened residuals
/touches/dof           (N,) int64             degrees of freedom of χ²
/touches/sentence      (N, 400) uint8         what was stated of the frame, UTF-8, then zeros
/start/motion          (N, K + R) float64     state of the loop before the frame, see `ChainState`
/start/rest            (N, K) float64
/start/touches         (N, n, 3) float64
/start/from_strain     (N, n, 3) float64
/start/held            (N, n, 3) float64      see `Memory`
/start/moved           (N, n, 2) float64
/start/left            (N, 8, 3) float64
/start/trace           (N, 24) float64        what is known of their traces, see `Traces`
/start/trace_scatter   (N, 24, 24) float64
/start/covered         (N, 8, 3) float64
/start/unseen          (N,) float64, s
/frames/check          (N,) uint32            CRC-32 of a frame's numbers, all but the large arrays
/frames/reference      (N,) int64             0 for /reference, n for the n-th of /tares/image
/tares/image           (M, H, W) float32      references that were taken while the loop ran
/tares/noise           (M,) float64           of these, grey levels
/tares/curve           (M, 17) float64        variance by grey level, NaN where none is known
/tares/frames          (M,) int64             of which they are the mean
/tares/captured        (M,) float64, s        of the first frame that was compared with it
/tares/check           (M,) uint32            CRC-32 of the image
=====================  =====================  =====================================================

Rows of touches that are not there are NaN. The large arrays (image, sums, strain) carry the
checksum of their compression; the reference has the attribute `check`, its CRC-32. Attributes of
the file: `format`, `version`, `started` (UTC), `scene` and `calibration` (JSON).
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping

import numpy as np

from models import Estimate, Traces, left_by
from rig.live.baseline import ReferenceFrame
from rig.live.chain import Chain, ChainState
from rig.live.frame_record import FrameRecord
from rig.live.memory import MANY, Memory
from rig.live.noise_curve import COUNT
from rig.recording.fit import SHAPES as FIT_SHAPES, fit_row
from rig.system.arrays import F64, AnyArray

FORMAT, VERSION, READ = "touchplate session", 2, (1, 2)
FINGERS = 10
TARES = "tares/"
CURVE, FRAMES = f"{TARES}curve", f"{TARES}frames"
REFERENCE = "frames/reference"
IMAGES = ("frames/image", "frames/sums", "frames/strain", f"{TARES}image")
"""Large arrays, compressed frame by frame."""

CHECK = "frames/check"
"""Of what is small: a changed byte there would be seen by nobody."""

LAST = "frames/sequence"
"""Written after all others: as many frames are whole as it has numbers."""

Shapes = Mapping[str, tuple[tuple[int, ...], str]]


def shapes(chain: Chain, strain: bool) -> Shapes:
    """Shape of a frame's part and type of number of every array."""
    height, width = chain.reference.image.shape
    tiles, max_touches = chain.reference.tiles.shape, chain.estimator.max_touches
    motions, modes = len(chain.pattern.still()), chain.pattern.count
    touches = (max_touches, 3)
    found = {
        "frames/image": ((height, width), "u1"),
        "frames/captured": ((), "f8"),
        "frames/truth": ((FINGERS, 4), "f8"),
        "frames/truth_known": ((), "u1"),
        "frames/sums": ((*tiles, 5), "f4"),
        "touches/place": (touches, "f8"),
        "touches/covariance": ((max_touches, 3, 3), "f8"),
        "touches/identity": ((max_touches,), "i8"),
        **FIT_SHAPES,
        "start/motion": ((motions,), "f8"),
        "start/rest": ((modes,), "f8"),
        "start/touches": (touches, "f8"),
        "start/from_strain": (touches, "f8"),
        "start/held": (touches, "f8"),
        "start/moved": ((max_touches, 2), "f8"),
        "start/left": ((MANY, 3), "f8"),
        "start/trace": ((3 * MANY,), "f8"),
        "start/trace_scatter": ((3 * MANY, 3 * MANY), "f8"),
        "start/covered": ((MANY, 3), "f8"),
        "start/unseen": ((), "f8"),
    }
    if strain:
        found |= {
            "frames/strain": ((*tiles, 3), "f4"),
            "touches/from_strain": (touches, "f8"),
        }
    return found | {REFERENCE: ((), "i8"), CHECK: ((), "u4"), LAST: ((), "i8")}


def tare_shapes(shape: tuple[int, ...]) -> Shapes:
    """Shape of a tare's part and type of number of every array, for images of a shape (H, W)."""
    parts = {
        "image": (shape, "f4"),
        "noise": ((), "f8"),
        "curve": ((COUNT,), "f8"),
        "frames": ((), "i8"),
        "captured": ((), "f8"),
    }
    return {f"{TARES}{name}": part for name, part in parts.items()} | {f"{TARES}check": ((), "u4")}


def tare_row(reference: ReferenceFrame, captured: float) -> dict[str, AnyArray]:
    """Arrays of one tare: a reference, and when the first frame against it was captured, s."""
    image = np.ascontiguousarray(reference.image)
    parts = {
        "image": image,
        "noise": np.asarray(reference.noise),
        "curve": np.full((COUNT,), np.nan) if reference.curve is None else reference.curve,
        "frames": np.asarray(reference.frames),
        "captured": np.asarray(captured),
        "check": np.asarray(zlib.crc32(image.data), dtype=np.uint32),
    }
    return {f"{TARES}{name}": part for name, part in parts.items()}


def rows(record: FrameRecord, layout: Shapes, number: int = 0) -> dict[str, AnyArray]:
    """Arrays of one frame, in the shapes of the layout, against the reference of a number."""
    estimate, sums, frame = record.frame_estimate.estimate, record.frame_estimate.sums, record.frame
    left = record.before.memory.left
    fingers = [(t.x, t.y, t.force, t.radius) for t in frame.truth or ()][:FINGERS]
    found = {
        "frames/image": frame.image,
        "frames/captured": frame.captured,
        "frames/truth": fingers,
        "frames/truth_known": frame.truth is not None,
        "frames/sums": np.column_stack([sums.gradient, sums.e, sums.ee, sums.ef]),
        "frames/strain": record.frame_estimate.strain,
        "touches/place": places(estimate),
        "touches/covariance": covariances(estimate),
        "touches/identity": record.identities,
        **fit_row(estimate, record.sentence),
        "touches/from_strain": places(record.frame_estimate.from_strain),
        "start/motion": record.before.motion,
        "start/rest": record.before.rest,
        "start/touches": record.before.touches,
        "start/from_strain": record.before.from_strain,
        "start/held": record.before.memory.held,
        "start/moved": record.before.memory.moved,
        "start/left": left.touches,
        "start/trace": left.part,
        "start/trace_scatter": padded(left.covariance, 3 * MANY),
        "start/covered": record.before.memory.covered,
        "start/unseen": record.before.memory.unseen,
        REFERENCE: number,
        LAST: frame.sequence,
    }
    filled = {name: _fill(found[name], *layout[name]) for name in layout if name != CHECK}
    return {name: frame_check(filled) if name == CHECK else filled[name] for name in layout}


def frame_check(row: Mapping[str, AnyArray]) -> AnyArray:
    """CRC-32 of the small arrays of a frame, () uint32."""
    check = 0
    for name in sorted(row):
        if name not in (*IMAGES, CHECK):
            check = zlib.crc32(np.ascontiguousarray(row[name]).data, check)
    return np.asarray(check, dtype=np.uint32)


def places(estimate: Estimate | None) -> F64:
    """x, y, F of each touch, (n, 3)."""
    if estimate is None:
        return np.empty((0, 3))
    return np.column_stack([estimate.xy, estimate.force])


def covariances(estimate: Estimate) -> F64:
    """Covariance of x, y, F of each touch, (n, 3, 3)."""
    blocks = [estimate.touch_covariance(index) for index in range(estimate.count)]
    return np.array(blocks).reshape(-1, 3, 3)


def state(row: Mapping[str, AnyArray]) -> ChainState:
    """State of the loop before a frame."""
    none = np.empty((0, 3))  # as in recordings of the release before
    held, left, covered = (
        there(row.get(f"start/{name}", none)) for name in ("held", "left", "covered")
    )
    traces = left_by(left)
    # Touches whose steps are not known count as at rest.
    moved = row.get("start/moved", np.empty((0, 2)))[: len(held)]
    moved = np.concatenate([np.nan_to_num(moved), np.zeros((len(held) - len(moved), 2))])
    if "start/trace" in row:
        numbers = left.size
        scatter = row["start/trace_scatter"][:numbers, :numbers]
        traces = Traces(left, row["start/trace"][:numbers], scatter)
    return ChainState(
        row["start/motion"],
        row["start/rest"],
        there(row["start/touches"]),
        there(row["start/from_strain"]),
        Memory(held, moved, traces, covered, float(row.get("start/unseen", 0.0))),
    )


def padded(values: F64, size: int) -> F64:
    """Put a square of numbers into the corner of a larger one; the rest is NaN."""
    larger = np.full((size, size), np.nan)
    larger[: len(values), : len(values)] = values
    return larger


def there(padded: AnyArray) -> AnyArray:
    """Rows before those of NaN."""
    return padded[~np.isnan(padded.reshape(len(padded), -1)[:, 0])]


def _fill(values: object, shape: tuple[int, ...], kind: str) -> AnyArray:
    """Put values into an array of a shape, as many rows as they have; the rest stays empty."""
    given: AnyArray = np.asarray(values)
    if given.size == np.prod(shape):
        return np.ascontiguousarray(given.reshape(shape), dtype=kind)
    filled = np.full(shape, np.nan if kind[0] == "f" else -1, dtype=kind)
    if len(given):
        filled[: len(given)] = given
    return filled
