"""Fields to files: HDF5, CSV and plots, each written aside and renamed: whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import U8, AnyArray
from dic.fields.displacement import DisplacementField, Status
from dic.fields.grid import Grid
from dic.fields.invariants import strain_invariants
from dic.fields.strain_field import StrainField
from dic.images.image import check_image
from dic.numbers import check_type, read_array, read_path

if TYPE_CHECKING:
    from dic.plots.plot import FieldStyle

INVARIANTS = ("principal_1", "principal_2", "principal_angle", "max_shear", "von_mises")
"""Names of the invariants of strain in files."""

DRAWN = ("u", "v", "exx", "eyy", "exy", "sigma_u", "sigma_exx", "zncc", "status")
"""Fields that `draw_fields` draws, a file each."""


@contextmanager
def aside(path: str | Path) -> Generator[Path]:
    """Give a draft beside `path`; rename it when the block ends well, remove it when not.

    Raises
    ------
    OSError
        The folder does not exist or cannot be written.
    """
    path = read_path(path)
    if not path.parent.is_dir():
        raise FileNotFoundError(f"folder {path.parent} does not exist; create it first")
    draft = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        yield draft
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def columns(disp: DisplacementField, eps: StrainField) -> dict[str, AnyArray]:
    """Every field under its name, each (N,), in the order in which files list them.

    Raises
    ------
    ValueError
        Displacement and strain are no fields, or not of the same points.
    """
    check_type(disp, DisplacementField, "disp", "dic.correlate")
    check_type(eps, StrainField, "eps", "dic.strain")
    if len(disp.xy) != len(eps.xy):
        raise ValueError(
            f"disp and eps must be of the same points, got {len(disp.xy)} and {len(eps.xy)}; "
            "take the strain of this displacement"
        )
    return {
        "x": disp.xy[:, 0],
        "y": disp.xy[:, 1],
        "u": disp.u,
        "v": disp.v,
        "sigma_u": disp.sigma_u,
        "sigma_v": disp.sigma_v,
        "zncc": disp.zncc,
        "iterations": disp.iterations,
        "valid_fraction": disp.valid_fraction,
        "status": disp.status,
        "exx": eps.exx,
        "eyy": eps.eyy,
        "exy": eps.exy,
        "sigma_exx": eps.sigma[:, 0],
        "sigma_eyy": eps.sigma[:, 1],
        "sigma_exy": eps.sigma[:, 2],
        "strain_valid": eps.valid,
    }


def invariant_columns(eps: StrainField) -> dict[str, AnyArray]:
    """Principal strains, their angle, the largest shear, von Mises, and σ of each, (N,) by name.

    The first principal strain is the larger one; the angle is from x towards y, rad.
    """
    found = strain_invariants(eps)
    fields = (found.first, found.second, found.angle, found.max_shear, found.von_mises)
    spread = zip(INVARIANTS, found.sigma.T, strict=True)
    return dict(zip(INVARIANTS, fields, strict=True)) | {f"sigma_{n}": s for n, s in spread}


def unit_of(name: str) -> str:
    """Return the unit of a field by its name; "1" where it has none."""
    if name.endswith("_mm"):
        return "mm"
    if name.endswith("angle"):
        return "rad"
    return "px" if name in ("x", "y", "u", "v", "sigma_u", "sigma_v") else "1"


def write_hdf5(
    path: str | Path,
    disp: DisplacementField,
    eps: StrainField,
    more: Mapping[str, AnyArray] | None = None,
    settings: Mapping[str, object] | None = None,
) -> None:
    """Write all fields and how they were measured into one HDF5 file.

    Fields on a grid are (R, C) data sets, others (N,); units stand in the attribute `unit`, the
    parameters in the attributes of the file. `more` are further fields (N,) by name, `settings`
    further attributes.
    """
    import h5py

    table = columns(disp, eps) | dict(more or {})
    shape = disp.grid.shape if disp.grid is not None else (len(disp.xy),)
    with aside(path) as draft, h5py.File(draft, "w") as file:
        for name, values in table.items():
            data = file.create_dataset(name, data=values.reshape(shape), compression="gzip")
            data.attrs["unit"] = unit_of(name)
        for name, value in (_parameters(disp, eps) | dict(settings or {})).items():
            file.attrs[name] = value
        for status in Status:
            file["status"].attrs[status.name] = int(status)


def write_csv(
    path: str | Path,
    disp: DisplacementField,
    eps: StrainField,
    more: Mapping[str, AnyArray] | None = None,
) -> None:
    """Write one line a point under a header of field names, in px; `nan` where it was lost.

    `more` are further fields (N,) by name.
    """
    table = columns(disp, eps) | dict(more or {})
    whole = ("iterations", "status", "strain_valid")
    formats = ["%d" if name in whole else "%.9g" for name in table]
    with aside(path) as draft:
        np.savetxt(
            draft,
            np.column_stack(list(table.values())),
            fmt=formats,
            delimiter=",",
            header=",".join(table),
            comments="",
        )


def _parameters(disp: DisplacementField, eps: StrainField) -> dict[str, object]:
    grid = {} if disp.grid is None else {"step": disp.grid.step}
    return {
        "subset": disp.subset,
        "order": disp.order,
        "prefilter": disp.prefilter,
        **grid,
        "strain_kind": eps.kind,
        "strain_window": eps.window,
        "vsg": eps.vsg,
    }


def draw_overview(
    path: str | Path, image: ArrayLike, disp: DisplacementField, eps: StrainField
) -> None:
    """Draw u, v, status, exx, eyy and exy over the grey reference (H, W), one PNG for all."""
    from dic.plots import plot

    table, image = columns(disp, eps), check_image(image, "reference")
    fields = {name: table[name] for name in ("u", "v", "status", "exx", "eyy", "exy")}
    with aside(path) as draft:
        plot.draw_sheet(draft, image, fields, disp)


def draw_fields(
    folder: str | Path, image: ArrayLike, disp: DisplacementField, eps: StrainField
) -> list[Path]:
    """Draw every field over the grey reference, one PNG each.

    Parameters
    ----------
    folder : str or Path
        Made if it does not exist.
    image : (H, W), grey levels
        The reference.

    Returns
    -------
    list of Path
        The files, by the names `DRAWN`.
    """
    from dic.plots import plot

    table, image, folder = columns(disp, eps), check_image(image, "reference"), read_path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{name}.png" for name in DRAWN]
    for name, path in zip(DRAWN, paths, strict=True):
        with aside(path) as draft:
            plot.draw(draft, image, name, table[name], disp)
    return paths


def colour_limits(name: str, values: ArrayLike) -> tuple[float, float]:
    """Return limits for the colours of a field, in the unit in which plots show it.

    A few wild points do not move them; they are symmetric for what has a sign.
    """
    from dic.plots import plot

    return plot.colour_limits(name, read_array(values, name, unit_of(name)))


def field_style(name: str) -> FieldStyle:
    """Return title, unit, factor and colours in which plots show a field, by its name."""
    from dic.plots import plot

    return plot.field_style(name)


def paint(
    image: ArrayLike,
    name: str,
    values: ArrayLike,
    grid: Grid,
    limits: tuple[float, float],
    caption: str = "",
) -> U8:
    """Draw a field over the grey reference with its colour bar.

    Parameters
    ----------
    image : (H, W), grey levels
        The reference.
    name : str
        Of the field; says title, unit and colours.
    values : (R·C,)
        NaN is left grey.
    grid : Grid
    limits : (lowest, highest)
        Of the colours, as `colour_limits` returns them.
    caption : str
        Stands behind the title.

    Returns
    -------
    (high, wide, 3) uint8, RGB

    Raises
    ------
    ValueError
        The values are not those of the grid.
    """
    from dic.plots import plot

    known = read_array(values, name, unit_of(name))
    rows, columns = check_type(grid, Grid, "grid", "that of a field").shape
    if known.shape != (rows * columns,):
        raise ValueError(f"{name} must have {rows * columns} values, got shape {known.shape}")
    return plot.paint(check_image(image, "reference"), name, known, grid, limits, caption)
