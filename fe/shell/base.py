"""The bent and twisted base of a deformable surface."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite, isinf, radians

import numpy as np
from scipy.integrate import cumulative_simpson
from scipy.optimize import brentq
from scipy.special import j0

from fe.arrays import F64
from fe.elements.mesh import Mesh
from fe.plate.checks import number
from fe.plate.plate import Plate
from fe.shell.support import Motion

# An inextensible strip between clamps stands upright at its inflections, k = sin 45° of the
# elastica, where its ends have come nearer by 2 - 2 E(k)/K(k) of its length; beyond it folds over
# itself and hides a part of the touched face.
STEEPEST = 0.5430534


@dataclass(frozen=True)
class Base:
    """How the clamps of the west and the east edge moved before the touch.

    Attributes
    ----------
    bend : float
        Δl, mm: by how much the clamps come nearer to each other. The plate bows to the touched
        side.
    twist : float
        Δθ, degrees: by how much they turn against each other about the x axis through the middle
        of the plate, each by half; the east clamp from y to z.

    Raises
    ------
    ValueError
        The bend is negative, the twist is 90 degrees or more, or one is not finite.
    """

    bend: float = 0.0
    twist: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "bend", number(self.bend, "bend of the base", "mm"))
        object.__setattr__(self, "twist", number(self.twist, "twist of the base", "degrees"))
        if not (isfinite(self.bend) and self.bend >= 0):
            raise ValueError(
                f"bend of the base must be 0 mm or more, got {self.bend:g} mm; give the distance "
                "by which the clamps come nearer"
            )
        if not abs(self.twist) < 90.0:
            raise ValueError(
                "twist of the base must lie between -90 and 90 degrees, where the ends of the "
                f"plate cross, got {self.twist:g} degrees"
            )

    @property
    def flat(self) -> bool:
        """Whether the clamps stay where they are."""
        return self.bend == 0 and self.twist == 0

    def clamps(self, plate: Plate) -> tuple[Motion, Motion]:
        """Rigid motions of the west and the east clamp."""
        pivot = np.array([0.0, plate.size[1] / 2, 0.0])
        motions: list[Motion] = []
        for sense in (-1.0, 1.0):
            angle = sense * radians(self.twist) / 2
            turn = np.array(
                [
                    [1.0, 0.0, 0.0],
                    [0.0, np.cos(angle), -np.sin(angle)],
                    [0.0, np.sin(angle), np.cos(angle)],
                ]
            )
            along = np.array([-sense * self.bend / 2, 0.0, 0.0])
            motions.append(Motion(turn, pivot - turn @ pivot + along))
        return motions[0], motions[1]


def check_base(plate: Plate, base: Base) -> None:
    """Raise where a plate cannot take a base.

    Raises
    ------
    ValueError
        The west or the east edge is not clamped, the south or the north one is held, the plate
        is not flat at rest, or the bend folds it.
    """
    if base.flat:
        return
    if plate.shape is not None:
        raise ValueError(
            f"base bends and twists a flat plate, got one with {plate.shape}; leave one of them out"
        )
    for name in ("west", "east"):
        edge = getattr(plate.sides, name)
        if edge.springs != (inf, inf, inf):
            raise ValueError(
                f"{name} edge must be clamped to bend or twist the base, got {edge.kind}"
            )
    for name in ("south", "north"):
        edge = getattr(plate.sides, name)
        if any(isinf(spring) for spring in edge.springs):
            raise ValueError(
                f"{name} edge must be free or on springs when the clamps of the others move, "
                f"got {edge.kind}"
            )
    limit = STEEPEST * plate.size[0]
    if base.bend >= limit:
        raise ValueError(
            f"bend of the base must stay below {limit:.4g} mm, where the plate stands upright and "
            f"begins to fold, got {base.bend:g} mm"
        )


def bow(plate: Plate, mesh: Mesh, bend: float) -> F64:
    """Unknowns (2 nx + 2, 2 ny + 2, 3) of a strip that bows to +z without stretching, mm.

    Its slope is θ = θm sin(2πs/a), within 2 % of the elastica's, with 1 - J0(θm) = bend / a.
    """
    a = plate.size[0]
    steepest: float = brentq(lambda angle: 1.0 - j0(angle) - bend / a, 0.0, 2.4)  # pyright: ignore[reportAssignmentType]
    s = np.linspace(0.0, a, 4001)
    angle = steepest * np.sin(2 * np.pi * s / a)
    nodes, unit = mesh.nodes[0], mesh.units[0]
    values = np.zeros((*mesh.shape, 3))
    for c, slope in ((0, np.cos(angle) - 1.0), (2, np.sin(angle))):
        place = cumulative_simpson(slope, x=s, initial=0)
        values[0::2, 0::2, c] = np.interp(nodes, s, place)[:, None]
        values[1::2, 0::2, c] = unit * np.interp(nodes, s, slope)[:, None]
    values[0::2, 0::2, 0] += bend / 2
    return values
