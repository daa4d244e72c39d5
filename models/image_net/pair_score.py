"""The score of a net of displacement: rendered pairs that no training drew, read by it and not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from dic import adaptive_field, prepare
from models.field_net.field_net import NetField, net_field
from models.field_net.plates import draw_plates
from models.field_net.random_speckle import SPACING, draw_speckle
from models.field_net.rendered_pairs import RenderedPair, draw_pairs
from models.field_net.store import FieldNet
from models.image_net.image_net import image_net_field
from models.image_net.store import ImageNet

_SIDE, _MARGIN = 256, 68  # px, of a pair, and what its pattern has beside it
_PLATES = 4  # plates under touches


@dataclass(frozen=True)
class PairScore:
    """How a pair was measured by a net and by the adaptive field.

    Attributes
    ----------
    points : int
        That both have measured.
    squares, adaptive_squares : float, px²
        Sum of the squared errors of u and v of the net's field and of the adaptive field.
    by_net : int
        Points of the net.
    seconds, adaptive_seconds : float
        From two images.
    """

    points: int
    squares: float
    adaptive_squares: float
    by_net: int
    seconds: float
    adaptive_seconds: float


def score_pairs(
    net: FieldNet | ImageNet,
    count: int,
    seed: int,
    clock: Callable[[], float],
    report: Callable[[int, int], None] = lambda done, total: None,
) -> list[PairScore]:
    """Draw so many pairs, each of a pattern of its own, and measure them.

    Parameters
    ----------
    net : FieldNet or ImageNet
    count, seed : int
    clock : callable
        Time, s.
    report : callable
        Gets the number of pairs that were measured, and of all.

    Raises
    ------
    ValueError
        As `net_field`.
    """
    rng = np.random.default_rng(seed)
    plates = draw_plates(_PLATES, _SIDE // SPACING + 8, rng)
    scores: list[PairScore] = []
    for number in range(count):
        report(number, count)
        pool = draw_speckle(1, _SIDE + _MARGIN, rng, "cpu")
        scores.append(_score(net, draw_pairs(pool, plates, 1, _SIDE, rng)[0], clock))
    report(count, count)
    return scores


def _score(net: FieldNet | ImageNet, pair: RenderedPair, clock: Callable[[], float]) -> PairScore:
    began = clock()
    ref = prepare(pair.first, roi=pair.roi)
    classical = adaptive_field(ref, pair.second)
    middle = clock()
    found = _measure(net, pair)
    ended = clock()
    both = found.field.valid & classical.valid
    truth = pair.truth_at(classical.xy)
    squares = [
        float(np.square(np.stack([field.u, field.v]) - truth)[:, both].sum())
        for field in (found.field, classical)
    ]
    own = int(np.count_nonzero(found.by_net & both))
    points = int(np.count_nonzero(both))
    return PairScore(points, squares[0], squares[1], own, ended - middle, middle - began)


def _measure(net: FieldNet | ImageNet, pair: RenderedPair) -> NetField:
    ref = prepare(pair.first, roi=pair.roi)
    if isinstance(net, FieldNet):
        return net_field(ref, pair.second, net)
    return image_net_field(ref, pair.second, net)
