"""How far the learning of a bench has come."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Learned:
    """How far the learning has come.

    Attributes
    ----------
    touches : int
        That have said something of the bench.
    gathered : int
        First touches since then, from which the bench is not found yet.
    strange : int
        That fitted no likely bench and were left aside.
    weights : int
        Of the touches, known weights.
    force_sigma : float or None
        Standard deviation of all forces by what is not known of the bench, as a fraction, in the
        middle of the plate; None before the first frame.
    weight : float or None, N
        That is waited for.
    """

    touches: int = 0
    gathered: int = 0
    strange: int = 0
    weights: int = 0
    force_sigma: float | None = None
    weight: float | None = None

    @property
    def sentence(self) -> str:
        """How far it has come, for the user."""
        parts = [f"learned from {self.touches} touch{'es' if self.touches != 1 else ''}"]
        if self.gathered:
            parts.append(f"{self.gathered} more gathered")
        if self.weights:
            parts.append(f"{self.weights} of known weight")
        if self.strange:
            parts.append(f"{self.strange} strange, left aside")
        if self.force_sigma is not None:
            parts.append(f"forces known to {100 * self.force_sigma:.1f} %")
        return ", ".join(parts)

    @property
    def summary(self) -> dict[str, Any]:
        """Its figures and what they say, ready for JSON."""
        return asdict(self) | {"sentence": self.sentence}
