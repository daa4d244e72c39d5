"""`touchplate correlate REF DEF`: two images in; displacement, strain and their σ out."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from rig.commands.output import emit, folder_aside, require_free

if TYPE_CHECKING:
    import numpy as np
    from rich.console import Group

    import dic

Kind = Literal["small", "green-lagrange", "logarithmic"]

PRINTED = {"u": (1.0, "px"), "v": (1.0, "px")} | dict.fromkeys(("exx", "eyy", "exy"), (1e6, "µε"))
"""Factor and unit in which each field is printed."""


def correlate(
    reference: Annotated[Path, typer.Argument(metavar="REF", help="Image before.")],
    deformed: Annotated[Path, typer.Argument(metavar="DEF", help="Image after.")],
    subset: Annotated[int, typer.Option(help="Side of a subset, px, odd.")] = 21,
    step: Annotated[int, typer.Option(help="Distance of neighbouring points, px.")] = 5,
    order: Annotated[int, typer.Option(help="Order of the shape function.")] = 1,
    window: Annotated[int, typer.Option(help="Side of the strain window, points, odd.")] = 5,
    kind: Annotated[Kind, typer.Option(help="Definition of strain.")] = "small",
    roi: Annotated[
        Path | None, typer.Option(metavar="MASK", help="Image that is black where to leave out.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of the results, else results/DEF.")
    ] = None,
    plots: Annotated[
        bool, typer.Option("--plots", help="Draw each field alone too, σ and ZNCC among them.")
    ] = False,
    force: Annotated[bool, typer.Option(help="Replace files of an earlier run.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write u, v, Exx, Eyy, Exy, σ, ZNCC and status as HDF5 and CSV, and a plot of them."""
    import dic

    folder = out or Path("results") / deformed.stem
    require_free(folder, force)
    before, after = dic.read_image(reference), dic.read_image(deformed)
    mask = None if roi is None else dic.read_image(roi) > 0

    start = time.perf_counter()
    prepared = dic.prepare(before, subset=subset, step=step, order=order, roi=mask)
    field = dic.correlate(prepared, after)
    strain = dic.strain(field, window=window, kind=kind)
    seconds = time.perf_counter() - start

    with folder_aside(folder) as aside:
        _write(aside, before, field, strain)
        if plots:
            dic.export.draw_fields(aside, before, field, strain)
    figures = _figures(field, strain) | {"seconds": seconds, "folder": str(folder)}
    emit(_tables(figures), figures, as_json)


def _write(
    folder: Path, image: np.ndarray, field: dic.DisplacementField, strain: dic.StrainField
) -> None:
    from dic import export

    export.write_hdf5(folder / "fields.h5", field, strain)
    export.write_csv(folder / "fields.csv", field, strain)
    export.draw_overview(folder / "fields.png", image, field, strain)


def _figures(field: dic.DisplacementField, strain: dic.StrainField) -> dict[str, Any]:
    from dic import Status

    return {
        "points": len(field.xy),
        "status": {s.name.lower(): float((field.status == s).mean()) for s in Status},
        "u": _spread(field.u, field.sigma_u),
        "v": _spread(field.v, field.sigma_v),
        "exx": _spread(strain.exx, strain.sigma[:, 0]),
        "eyy": _spread(strain.eyy, strain.sigma[:, 1]),
        "exy": _spread(strain.exy, strain.sigma[:, 2]),
        "strain_points": int(strain.valid.sum()),
        "strain_kind": strain.kind,
        "vsg": float(strain.vsg),
    }


def _spread(values: np.ndarray, sigma: np.ndarray) -> dict[str, float] | None:
    """Mean and scatter over the measured points, and their median σ; None where there are none."""
    import numpy as np

    measured = np.isfinite(values) & np.isfinite(sigma)
    if not measured.any():
        return None
    return {
        "mean": float(values[measured].mean()),
        "sd": float(values[measured].std()),
        "sigma": float(np.median(sigma[measured])),
    }


def _tables(figures: dict[str, Any]) -> Group:
    from rich.box import SIMPLE
    from rich.console import Group
    from rich.table import Table

    fields = Table("field", "mean", "sd", "median σ", "unit", box=SIMPLE)
    for name, (scale, unit) in PRINTED.items():
        spread = figures[name]
        row = (
            [f"{spread[key] * scale:.4g}" for key in ("mean", "sd", "sigma")]
            if spread
            else ["-"] * 3
        )
        fields.add_row(name, *row, unit)
    fractions = [f"{name} {part:.1%}" for name, part in figures["status"].items() if part]
    return Group(
        f"{figures['points']} points: {', '.join(fractions)}",
        fields,
        f"strain is {figures['strain_kind']}, gauge length {figures['vsg']:g} px,"
        f" at {figures['strain_points']} points",
        f"{figures['seconds']:.2f} s; written to {figures['folder']}",
    )
