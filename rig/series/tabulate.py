"""The fields of a frame as a table: displacement, strain as it is asked for, σ and status."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import dic
from dic import export
from rig.series.measure import BY_NETS, kind_of
from rig.series.parts import FIELDS
from rig.series.readings import reach
from rig.series.scale import SCALED, ScaledPoints, in_mm, scaled_columns
from rig.system.arrays import AnyArray, Mask

if TYPE_CHECKING:
    from rig.series.measure import FieldEstimator


@dataclass(frozen=True)
class StrainOptions:
    """Side of the strain window, points, the definition of strain, and the field it is taken of.

    With `invariants` the principal strains, the largest shear and von Mises are kept too; with
    `scaled`, the points on the object, the displacement in mm, and strain is that on the object; of
    a net, which points are its own. `guess` is the motion, px, that all points of a frame start
    from; without it they are searched.
    """

    window: int = 5
    kind: dic.StrainKind = "small"
    field: FieldEstimator = "subset"
    invariants: bool = False
    scaled: ScaledPoints | None = None
    guess: tuple[float, float] | None = None

    def reach(self, ref: dic.Reference) -> float:
        """Distance from which the errors of two strains are free of each other, px."""
        step = 0 if ref.grid is None else ref.grid.step
        return reach(kind_of(self.field), self.window, step, ref.subset)

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields that are kept of a point, beside its status."""
        spread = tuple(f"sigma_{name}" for name in export.INVARIANTS)
        more = export.INVARIANTS + spread if self.invariants else ()
        by_net = ("by_net",) if kind_of(self.field) in BY_NETS else ()
        return FIELDS + more + (SCALED if self.scaled else ()) + by_net


@dataclass(frozen=True, eq=False)
class Measured:
    """Displacement and strain of a frame, and further fields (N,) of it by name."""

    disp: dic.DisplacementField
    strain: dic.StrainField
    more: dict[str, AnyArray]

    def table(self, fields: tuple[str, ...]) -> dict[str, AnyArray]:
        """Return fields (N,) by name, and the status."""
        known = export.columns(self.disp, self.strain) | self.more
        return {name: known[name] for name in (*fields, "status")}


def strained(
    disp: dic.DisplacementField, options: StrainOptions, by_net: Mask | None = None
) -> Measured:
    """Take the strain of a displacement, and what else the options ask for.

    `by_net` are the points (N,) of a net, where one was asked for.

    Raises
    ------
    ValueError
        As `dic.strain`, or the camera does not see where a point has moved to.
    """
    if options.scaled is None:
        eps, more = dic.strain(disp, options.window, options.kind), {}
    else:
        moved = in_mm(options.scaled, disp)
        eps = dic.strain(moved, options.window, options.kind, options.scaled.slopes)
        x, y = options.scaled.places.T
        more = {"x_mm": x, "y_mm": y} | scaled_columns(moved)
    more |= {} if by_net is None else {"by_net": by_net}
    return Measured(disp, eps, more | (export.invariant_columns(eps) if options.invariants else {}))
