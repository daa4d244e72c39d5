"""The plan of a data set: which touches its samples have, by block, from a seed.

A plan is frozen numbers, so the same plan gives the same touches, and block k of them can be had
without those before it: a data set that was cut off goes on where it ended.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Literal

import numpy as np

from models.arrays import F64, I64

BLOCK = 4096
"""Samples in a block. The seed of a block holds its number, so another size is another data set."""

# Combinations are numbered by int64.
_MAX_INDEX = 2**62


@dataclass(frozen=True, eq=False)
class TouchLattice:
    """Places and forces from a list each: no two touches of a sample share a place.

    Attributes
    ----------
    places : (P, 2) float64, mm
    forces : (S,) float64, N
    """

    places: F64
    forces: F64


@dataclass(frozen=True)
class TouchBox:
    """Places and forces anywhere between bounds, drawn evenly.

    Attributes
    ----------
    low, high : tuple of float
        Bounds of x, mm, y, mm, and force, N.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class SamplingPlan:
    """Which touches each sample has.

    Attributes
    ----------
    source : TouchLattice or TouchBox
        What touches are taken from. Of a lattice each combination of places and forces comes once
        at most.
    touches : int
        Touches of a sample, 1 to 3.
    samples : int or None
        None for every combination of a lattice, in order; else that many, drawn.
    seed : int
    order : {"canonical", "doubled"}
        "canonical" sorts the touches of a sample by x, then y. "doubled" writes each sample a
        second time with its touches the other way round, the "wrong training dataset" of the
        paper's figure S6.

    Raises
    ------
    ValueError
        A number is out of range, or a lattice has not so many combinations.
    """

    source: TouchLattice | TouchBox
    touches: int
    samples: int | None
    seed: int = 0
    order: Literal["canonical", "doubled"] = "canonical"

    def __post_init__(self) -> None:
        if not 1 <= self.touches <= 3:
            raise ValueError(f"touches of a sample must be 1 to 3, got {self.touches}")
        if self.samples is not None and self.samples < 1:
            raise ValueError(f"number of samples must be at least 1, got {self.samples}")
        if self.order == "doubled" and self.touches == 1:
            raise ValueError("order 'doubled' swaps touches and needs 2 or 3, got 1")
        match self.source:
            case TouchBox() if self.samples is None:
                raise ValueError("random touches need a number of samples, got none; use 3000")
            case TouchLattice():
                self._check_combinations()
            case TouchBox():
                pass

    def _check_combinations(self) -> None:
        available = self.combinations
        if not 1 <= available <= _MAX_INDEX:
            raise ValueError(
                f"touches at different places of a lattice must have 1 to {_MAX_INDEX:.0e} "
                f"combinations, got {available:.0e}; change spacing or margin"
            )
        if self.samples is not None and self.samples > available:
            raise ValueError(
                f"the lattice has {available} combinations of {self.touches} touches, "
                f"got {self.samples} samples; ask for no more than that"
            )

    @property
    def combinations(self) -> int:
        """Number of combinations of a lattice; 0 for a box, which has no end of them."""
        match self.source:
            case TouchLattice(places=places, forces=forces):
                return comb(len(places), self.touches) * len(forces) ** self.touches
            case TouchBox():
                return 0

    @property
    def count(self) -> int:
        """Number of samples before they are doubled."""
        return self.samples or self.combinations

    @property
    def copies(self) -> int:
        """Rows that a sample takes."""
        return 2 if self.order == "doubled" else 1

    @property
    def rows(self) -> int:
        """Rows of the data set."""
        return self.copies * self.count

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return -(-self.count // BLOCK)

    def block(self, number: int) -> F64:
        """Return the touches of a block: (rows, touches, 3) float64; x, y in mm, force in N."""
        first, last = BLOCK * number, min(BLOCK * (number + 1), self.count)
        match self.source:
            case TouchLattice() as lattice:
                drawn = _combine(lattice, self._codes[first:last], self.touches)
            case TouchBox(low=low, high=high):
                rng = np.random.default_rng([self.seed, number])
                drawn = rng.uniform(low, high, (last - first, self.touches, 3))
        order = np.lexsort((drawn[..., 1], drawn[..., 0]), axis=1)
        drawn = np.take_along_axis(drawn, order[..., None], axis=1)
        if self.order == "canonical":
            return drawn
        return np.stack([drawn, drawn[:, ::-1]], axis=1).reshape(-1, self.touches, 3)

    @cached_property
    def _codes(self) -> I64:
        """Numbers of the combinations that are taken: all, or drawn without a repetition."""
        if self.samples is None:
            return np.arange(self.count)
        rng = np.random.default_rng(self.seed)
        return rng.choice(self.combinations, self.samples, replace=False)


def _combine(lattice: TouchLattice, codes: I64, touches: int) -> F64:
    """Touches (n, touches, 3) of numbered combinations.

    The places c1 < c2 < … of combination r are the digits of r in the combinatorial number system,
    r = C(c1, 1) + C(c2, 2) + …; those of the forces are digits to the base of their number.
    """
    places, forces = lattice.places, lattice.forces
    rank, digits = np.divmod(codes, len(forces) ** touches)
    combined = np.empty((len(codes), touches, 3))
    for k in range(touches, 0, -1):
        below = np.array([comb(c, k) for c in range(len(places))])
        chosen = np.searchsorted(below, rank, side="right") - 1
        rank -= below[chosen]
        digits, digit = np.divmod(digits, len(forces))
        combined[:, k - 1, :2] = places[chosen]
        combined[:, k - 1, 2] = forces[digit]
    return combined
