"""Where the points of a reference start from in a frame: a guess, or a search of the image."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import F64, I64, AnyArray, Mask
from dic.correlation import features, islands, seeds
from dic.correlation.deformed_image import DeformedImage, read_parts
from dic.correlation.newton import Points
from dic.correlation.reference import Reference
from dic.fields import shape
from dic.fields.displacement import DisplacementField, Status
from dic.numbers import read_array

_SEED_SPACINGS = 60, 30  # px, the second where holes or lost parts leave too few
_ENOUGH = 0.4  # fraction of the seeds found from which they are enough
_TURNED = 0.25  # fraction of the seeds below which the image may be turned or stretched


class Start(NamedTuple):
    """Motion to start from, 0 where it is not known.

    Attributes
    ----------
    shift : (N, 2) float64, px
    gradient : (N, 2, 2) float64 or None
        None where all of it is 0.
    known : (N,) bool
    repeats : bool
        The pattern repeats, so that none is known.
    alone : (N,) bool or None
        Points of small parts of the ROI, whose motion is their own; None where there are none.
    """

    shift: F64
    gradient: F64 | None
    known: Mask
    repeats: bool
    alone: Mask | None = None

    @property
    def anywhere(self) -> bool:
        """Whether any point is known."""
        return not self.repeats and bool(self.known.any())

    def motion(self, order: int) -> F64:
        """Coefficients of the shape function, (N, 2, P)."""
        motion = np.zeros((len(self.shift), 2, shape.count(order)))
        motion[:, :, 0] = self.shift
        if self.gradient is not None:
            motion[:, :, 1:3] = self.gradient
        return motion


def start(
    ref: Reference, image: AnyArray, guess: DisplacementField | ArrayLike | None, usable: Mask
) -> Start:
    """Take the motion of a guess, or search for some of the points `usable` (N,) bool.

    Raises
    ------
    ValueError
        The guess does not belong to the reference.
    """
    if guess is None:
        grey = image.astype(np.float32)
        places, found, known, repeats = _search(ref, grey, usable)
        motion, alone = np.zeros((len(known), 2, 3)), None
        motion[places] = found
        if ref.islands is not None and not repeats:
            motion, known, alone = islands.search(ref, ref.islands, grey, motion, known)
        gradient = motion[:, :, 1:] if ref.order else None
        return Start(motion[:, :, 0], gradient, known, repeats, alone)
    given = _read_guess(ref, guess)
    known = np.isfinite(given.sum(axis=1))
    if not known.any():
        return start(ref, image, None, usable)
    given[~known] = 0.0
    if ref.order == 0 or not isinstance(guess, DisplacementField):
        return Start(given, None, known, False)
    return Start(given, np.where(known[:, None, None], guess.gradient, 0.0), known, False)


def nowhere(ref: Reference, image: AnyArray, begun: Start) -> tuple[Points, DeformedImage]:
    """Give the points of a frame in which none could be found to start from."""
    points = Points(begun.motion(ref.order))
    points.repeats = (ref.status == Status.OK) & begun.repeats
    return points, read_parts(image)


def _read_guess(ref: Reference, guess: DisplacementField | ArrayLike) -> F64:
    """Return the displacement (N, 2) px of a guess, or raise ValueError."""
    if isinstance(guess, DisplacementField):
        given = np.column_stack([guess.u, guess.v])
    else:
        given = read_array(guess, "guess", "px")
    if given.shape != ref.xy.shape:
        raise ValueError(
            f"guess must be {ref.xy.shape} px, one (u, v) a point, got {given.shape}; "
            "take NaN where none is known"
        )
    largest = max(ref.image.shape)
    if (given > largest).any() or (given < -largest).any():
        raise ValueError(
            f"guess holds motions up to {np.nanmax(np.abs(given)):g} px, more than the image of "
            f"{largest} px; set what is not known to NaN"
        )
    return given


def _search(ref: Reference, image: AnyArray, usable: AnyArray):
    """Find some points (S,) of a reference, their motion (S, 2, 3), and which are known (N,).

    And whether the pattern repeats, so that none is known.
    """
    places, motion, found = np.zeros(0, dtype=np.int64), np.zeros((0, 2, 3)), np.zeros(0, bool)
    repeats = False
    for spacing in _SEED_SPACINGS:
        places = _seed_places(ref, usable, spacing)
        motion, found, repeats = seeds.find(ref.image, image, ref.xy[places])
        # Closer seeds find more where some are found; where none is, they find none either.
        if repeats or not found.any() or np.count_nonzero(found) >= _ENOUGH * len(places):
            break
    few = np.count_nonzero(found) < _ENOUGH * len(places)
    if not repeats and few and ref.subset > seeds.USUAL.side:
        wide = seeds.find(ref.image, image, ref.xy[places], seeds.wide(ref.subset))
        if wide[2] or np.count_nonzero(wide[1]) > np.count_nonzero(found):
            motion, found, repeats = wide
    if not repeats and np.count_nonzero(found) < _TURNED * len(places):
        turn = features.affine(ref.image, image)
        if turn is not None:
            xy, straight = ref.xy[places], features.straighten(image, turn)
            rest, there, _ = seeds.find(ref.image, straight, xy)
            if np.count_nonzero(there) > np.count_nonzero(found):
                motion, found = features.follow(xy, turn, rest), there
    known = np.zeros(len(usable), dtype=bool)
    known[places] = found
    return places, motion, known, repeats


def _seed_places(ref: Reference, usable: Mask, spacing: int) -> I64:
    """Choose the points to search for: in each cell of the image the one nearest its middle.

    Points whose subset is whole come first: a hole in a template is found in other holes.
    """
    places = np.flatnonzero(usable)
    cell, offset = np.divmod(ref.xy[places], spacing)
    away = np.abs(offset - spacing / 2).max(axis=1)
    away += spacing * (ref.light[places, 2] < ref.subset**2)
    nearest = np.argsort(away, kind="stable")
    _, first = np.unique(cell[nearest] @ (1.0, 1e5), return_index=True)
    return places[nearest[first]]
