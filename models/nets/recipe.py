"""How a net is trained: how long, how fast, and with what end."""

from dataclasses import dataclass
from math import cos, pi
from typing import Literal

from models.nets.net import NetOptions, Start


@dataclass(frozen=True)
class Recipe:
    """How long and how fast to descend.

    Attributes
    ----------
    epochs
        Steps of Adam, each over the whole training set or over one batch.
    learning_rate
        Of Adam; the default is that of the library which the paper used.
    decay
        "constant" keeps the learning rate, "cosine" lets it fall to 0 at the end.
    outputs
        "raw" lets the net begin at 0 and grow to the size of its targets; "scaled" begins at
        their mean, with steps in units of their deviation.
    lbfgs_steps
        Most iterations of L-BFGS that follow in double precision, on the mean square over the
        whole training set.
    check
        Epochs between two looks at the validation set.
    start
        By which rule the first weights are drawn, see `models.nets.net.initial`.

    Raises
    ------
    ValueError
        When a number is not positive.
    """

    epochs: int = 30000
    learning_rate: float = 1e-3
    decay: Literal["constant", "cosine"] = "constant"
    outputs: Literal["raw", "scaled"] = "raw"
    lbfgs_steps: int = 0
    check: int = 1
    start: Start = "glorot"

    def __post_init__(self) -> None:
        if self.epochs < 1:
            raise ValueError(f"epochs must be at least 1, got {self.epochs}; use 30000")
        if not self.learning_rate > 0.0:
            raise ValueError(
                f"learning rate must be positive, got {self.learning_rate:g}; use 0.001"
            )
        if self.check < 1:
            raise ValueError(f"epochs between checks must be at least 1, got {self.check}; use 1")

    def rate(self, epoch: int) -> float:
        """Return the learning rate of an epoch."""
        match self.decay:
            case "constant":
                return self.learning_rate
            case "cosine":
                return self.learning_rate * 0.5 * (1.0 + cos(pi * epoch / self.epochs))


BEST = Recipe(1000, 3e-3, "cosine", "scaled", lbfgs_steps=2000)
"""What places the paper's touches best of what was tried: 0.02 mm in 10 CPU s."""

BEST_NET = NetOptions((32, 32), "silu", "asinh")
"""The net for `BEST`, of the size of the paper's."""
