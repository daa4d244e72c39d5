"""Whether linear theory holds for a plate and its touches: numbers that need no plate to read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

LINEAR_TOLERANCE = 0.05
"""Error of linear theory up to which it is taken: what a good camera bench knows of its plate."""

# Shear below this part of the deflection is not worth a word.
_SLIGHT = 0.005


@dataclass(frozen=True)
class LinearRange:
    """What a touch does to a plate, and what linear theory makes of it.

    Attributes
    ----------
    theory : {"linear", "large"}
        The smaller theory that is right to `LINEAR_TOLERANCE`.
    force : float
        Of the touch, N.
    place : tuple of float
        Where the plate deflects most for its thickness, mm.
    deflection : float
        There, under the touch, mm, positive into the plate.
    ratio : float
        Deflection over the thickness there.
    error : float
        Of linear theory, relative: the larger of its error in that deflection and in the strain of
        the touched face, root of the sum of squares over the face, of a long plate to a width and
        a half from the touch.
    shear : float
        What shear, which every theory here leaves out, adds to the deflection, in parts of it:
        an estimate.
    demand : float
        Largest equivalent strain of the touched face in parts of the strain limit of the material,
        away from edges and from the touch.
    """

    theory: Literal["linear", "large"]
    force: float
    place: tuple[float, float]
    deflection: float
    ratio: float
    error: float
    shear: float
    demand: float

    def arrays(self) -> dict[str, np.ndarray]:
        """Return everything as named arrays, for a file."""
        return {name: np.asarray(value) for name, value in asdict(self).items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> LinearRange:
        """Return the range that `arrays` came from.

        Raises
        ------
        ValueError
            One of them is missing.
        """
        missing = set(cls.__dataclass_fields__) - set(arrays)
        if missing:
            raise ValueError(
                f"stored arrays must hold {min(missing)!r}, got {', '.join(arrays)}; compute them "
                "again"
            )
        said: dict[str, Any] = {name: arrays[name].tolist() for name in cls.__dataclass_fields__}
        said["place"] = tuple(said["place"])
        return cls(**said)

    @property
    def sentence(self) -> str:
        """Text for the user."""
        x, y = self.place
        said = (
            f"w/h is up to {self.ratio:.2g} under {self.force:g} N at ({x:g}, {y:g}) mm, where "
            f"linear theory is off by {as_percent(self.error)}"
        )
        if self.shear > _SLIGHT:
            said += f"; shear, left out, adds about {as_percent(self.shear)}"
        if self.demand > 1.0:
            said += f"; the material is strained to {self.demand:.2g} times its limit"
        return said


def as_percent(fraction: float) -> str:
    """Write a relative error for people: two digits, and no more than that it is all wrong."""
    return f"{100 * fraction:.2g} %" if fraction < 0.995 else "more than 100 %"
