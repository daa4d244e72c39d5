"""Follow a pattern through the frames of a test, also where it changes beyond recognition."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import I64, AnyArray
from dic.correlation.correlation import correlate
from dic.correlation.reference import Reference, prepare
from dic.fields.displacement import DisplacementField, Status
from dic.images.image import check_image
from dic.numbers import check_type

_KEPT = 0.98  # fraction of the points followed so far that a frame must find again
_ALIKE = 0.9  # their median ZNCC, below which the pattern has changed too much


def correlate_sequence(ref: Reference, frames: Iterable[ArrayLike]) -> Iterator[DisplacementField]:
    """Measure the displacement of every frame from the first reference, one by one.

    A frame is compared with the first image, from the motion of the frame before. Once the
    pattern has changed too much for that, by strain, light or wear, the frame before becomes the
    reference: the points go on from where they had moved to, so that each stays on its material
    point, and the displacements add up (`compose_displacements`).

    Parameters
    ----------
    ref : Reference
    frames : iterable of (H, W) images
        In the order in which they were taken. They may come live.

    Yields
    ------
    DisplacementField
        At the points of `ref`, from `ref`. A point that is lost when the reference is renewed stays
        lost, and so does one of whose subset the ROI takes a part (EXCLUDED). `zncc` and `status`
        are those of the last comparison.

    Raises
    ------
    ValueError
        An image cannot be used.
    """
    check_type(ref, Reference, "ref", "dic.prepare")
    try:
        frames = iter(frames)
    except TypeError:
        raise ValueError("frames must be images (H, W), one after the other; list them") from None
    state = SequenceState()
    base = ref
    for frame in frames:
        found, base, state = follow_frame(ref, base, state, frame)
        yield found


@dataclass(frozen=True, eq=False)
class SequenceState:
    """What goes from one frame of a test to the next.

    Attributes
    ----------
    start : DisplacementField or None
        Motion of the points of the first reference up to that of now; None while it is the first.
    last : DisplacementField or None
        What the frame before showed, from the reference of now; None before the first frame.
    before : (H, W) or None
        That frame.
    renewals : int
        How often the reference was renewed.
    """

    start: DisplacementField | None = None
    last: DisplacementField | None = None
    before: AnyArray | None = None
    renewals: int = 0


def follow_frame(
    ref: Reference, base: Reference, state: SequenceState, frame: ArrayLike
) -> tuple[DisplacementField, Reference, SequenceState]:
    """Measure one frame of a test, as `correlate_sequence` does.

    Parameters
    ----------
    ref, base : Reference
        The first, and the one of now: `ref` again, or what the frame before returned.
    state : SequenceState
        Of the frame before; an empty one before the first.
    frame : (H, W)

    Returns
    -------
    tuple
        Displacement at the points of `ref`, the reference of now, and what goes to the next frame.

    Raises
    ------
    ValueError
        The image cannot be used.
    """
    check_type(ref, Reference, "ref", "dic.prepare")
    check_type(base, Reference, "base", "dic.prepare")
    check_type(state, SequenceState, "state", "dic.SequenceState()")
    frame = check_image(frame, "deformed")
    found = correlate(base, frame, guess=state.last)
    start, renewals = state.start, state.renewals
    if state.last is not None and state.before is not None and _has_changed(state.last, found):
        start, renewals = _joined(start, state.last, _here(ref, start)), renewals + 1
        base = renewed_reference(ref, start, state.before)
        found = correlate(base, frame, guess=np.zeros_like(base.xy))
    joined = _joined(start, found, _here(ref, start))
    return joined, base, SequenceState(start, found, frame, renewals)


def renewed_reference(ref: Reference, start: DisplacementField, image: ArrayLike) -> Reference:
    """Prepare a later frame at the points to which those of the first reference have moved.

    It passes the prefilter of the first, and what its stills scatter by widens σ as there.

    Parameters
    ----------
    ref : Reference
        The first.
    start : DisplacementField
        Motion up to `image`. Lost points are left out.
    image : (H, W)
    """
    check_type(ref, Reference, "ref", "dic.prepare")
    check_type(start, DisplacementField, "start", "dic.correlate")
    moved = (ref.xy + np.column_stack([start.u, start.v]))[_here(ref, start)]
    renewed = prepare(image, ref.subset, order=ref.order, points=moved, prefilter=ref.prefilter)
    return replace(renewed, scatter=ref.scatter)


def _here(ref: Reference, start: DisplacementField | None) -> I64:
    """Points of the first reference that the one of now has."""
    return np.arange(len(ref.xy)) if start is None else _kept(ref, start)


def _has_changed(last: DisplacementField, found: DisplacementField) -> bool:
    """Find whether a frame shows less of the pattern than the one before did."""
    if not last.valid.any():
        return False
    inside = found.status[last.valid] != Status.OUTSIDE
    kept = found.valid[last.valid]
    return bool(
        np.count_nonzero(kept) < _KEPT * np.count_nonzero(inside)
        or (kept.any() and np.median(found.zncc[found.valid]) < _ALIKE)
    )


def _kept(ref: Reference, field: DisplacementField) -> I64:
    """Points that go on in a new reference: what a ROI leaves out there is not known."""
    whole = ref.light[:, 2] == ref.subset**2
    return np.flatnonzero(field.valid & whole)


def _joined(
    start: DisplacementField | None, found: DisplacementField, here: I64
) -> DisplacementField:
    """Add what was found of the points `here` to their motion before; the others stay lost."""
    if start is None:
        return found
    status = np.where(start.valid, Status.EXCLUDED, start.status).astype(np.int8)
    arrays = {"status": status, "iterations": np.zeros(len(status), dtype=np.int16)}
    for name in ("u", "v", "sigma_u", "sigma_v", "gradient", "sigma_gradient", "zncc"):
        arrays[name] = np.full_like(getattr(start, name), np.nan)
    for name, array in arrays.items():
        array[here] = getattr(found, name)
    return compose_displacements(start, replace(found, xy=start.xy, **arrays))


def compose_displacements(first: DisplacementField, second: DisplacementField) -> DisplacementField:
    """Add up two displacements of which the second starts where the first has led.

    Parameters
    ----------
    first, second : DisplacementField
        `second.xy` is `first.xy` moved by the first displacement.

    Returns
    -------
    DisplacementField
        At the points of the first. Deformation gradients multiply, F = F₂F₁.

    Raises
    ------
    ValueError
        They are no displacements, or of another number of points.

    Notes
    -----
    σ adds in squares, which is an upper bound: the noise of the frame in which the two meet enters
    both with opposite signs.
    """
    for field in (first, second):
        check_type(field, DisplacementField, "a displacement", "dic.correlate")
    if len(first.xy) != len(second.xy):
        raise ValueError(
            f"displacements must be of the same points, got {len(first.xy)} and {len(second.xy)}; "
            "measure the second at the points to which the first led"
        )
    turn, stretch = np.eye(2) + second.gradient, np.eye(2) + first.gradient
    spread = np.einsum("nac,nbc->nab", np.square(turn), np.square(first.sigma_gradient))
    return replace(
        second,
        xy=first.xy,
        u=first.u + second.u,
        v=first.v + second.v,
        sigma_u=np.hypot(first.sigma_u, second.sigma_u),
        sigma_v=np.hypot(first.sigma_v, second.sigma_v),
        gradient=turn @ stretch - np.eye(2),
        sigma_gradient=np.sqrt(spread + second.sigma_gradient**2),
        grid=first.grid,
    )
