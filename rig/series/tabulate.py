"""The fields of a frame as a table: displacement, strain as it is asked for, σ and status."""

from __future__ import annotations

from dataclasses import dataclass

import dic
from dic import export
from rig.series.measure import BLOCK, FieldKind
from rig.series.parts import FIELDS
from rig.system.arrays import AnyArray


@dataclass(frozen=True)
class StrainOptions:
    """Side of the strain window, points, the definition of strain, and the field it is taken of.

    With `invariants` the principal strains, the largest shear and von Mises are kept too.
    """

    window: int = 5
    kind: dic.StrainKind = "small"
    field: FieldKind = "subset"
    invariants: bool = False

    def reach(self, ref: dic.Reference) -> float:
        """Distance from which the errors of two strains are free of each other, px."""
        step = 0 if ref.grid is None else ref.grid.step
        return (self.window - 1) * step + ref.subset if self.field == "subset" else BLOCK

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the fields that are kept of a point, beside its status."""
        if not self.invariants:
            return FIELDS
        return (*FIELDS, *export.INVARIANTS, *(f"sigma_{name}" for name in export.INVARIANTS))


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


def strained(disp: dic.DisplacementField, options: StrainOptions) -> Measured:
    """Take the strain of a displacement, and what else the options ask for.

    Raises
    ------
    ValueError
        As `dic.strain`.
    """
    eps = dic.strain(disp, window=options.window, kind=options.kind)
    return Measured(disp, eps, export.invariant_columns(eps) if options.invariants else {})
