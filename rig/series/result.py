"""One HDF5 file for all frames of a test, and an XDMF beside it for ParaView."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

import dic
from dic import export
from rig.series.parts import NO_FRAME, Part, read_part
from rig.system.arrays import F64
from rig.system.deflate import deflate, shuffle
from rig.system.in_order import in_order

FORMAT, VERSION = "touchplate test", 2
"""What the file calls itself, and the version of its layout."""
SPARE = 1 << 20  # bytes of a result beside its fields and its image, many times what they are


def write_result(
    path: Path,
    parts: Path,
    names: Sequence[str],
    ref: dic.Reference,
    fields: Sequence[str],
    settings: Mapping[str, object],
    places: F64 | None = None,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Assemble the parts of a test: the memory of a few frames, whatever their number.

    `fields` are (F, R, C) float32, by frame, row and column of the grid; `x` (C,) and `y` (R,) are
    the places of its points, px; `frame` (F,) the names, `error` (F,) what kept a frame out, and
    `image` (H, W) the reference. `places` (R·C, 2) mm, of the points on the object, are stored as
    `place` (R, C, 2).

    Raises
    ------
    OSError
        A part is missing, or the folder cannot be written or lacks the space.
    ValueError
        The points of the reference lie on no grid.
    """
    import h5py

    grid = ref.grid
    if grid is None:
        raise ValueError("a whole test is correlated on a grid; leave out the points")
    _require_space(path.parent, parts, ref.image.nbytes)
    shape = len(names), *grid.shape
    with export.aside(path) as draft, h5py.File(draft, "w") as file:
        for name, value in ({"format": FORMAT, "version": VERSION} | dict(settings)).items():
            file.attrs[name] = value
        file.create_dataset("image", data=ref.image, compression="gzip", shuffle=True)
        file["x"], file["y"] = grid.xs, grid.ys
        if places is not None:
            file["place"] = places.reshape(*grid.shape, 2)
            file["place"].attrs["unit"] = "mm"
        text = h5py.string_dtype("utf-8")
        file.create_dataset("frame", data=list(names), dtype=text)
        errors = file.create_dataset("error", (len(names),), dtype=text)
        for name in (*fields, "status"):
            kind = np.int8 if name == "status" else np.float32
            data = file.create_dataset(
                name, shape, kind, chunks=(1, *grid.shape), compression="gzip", shuffle=True
            )
            data.attrs["unit"] = export.unit_of(name)
        file["status"].attrs["NO_FRAME"] = NO_FRAME
        for status in dic.Status:
            file["status"].attrs[status.name] = int(status)
        # Read in this thread: NumPy parses the header of an array as Python, and CPython 3.11 fails
        # where two threads do so at once.
        read = (_part(parts, number) for number in range(len(names)))
        packed = in_order(_packed, read, os.cpu_count() or 1)
        for number, (chunks, error) in enumerate(packed):
            for name, chunk in chunks.items():
                file[name].id.write_direct_chunk((number, 0, 0), chunk)
            errors[number] = error
            report(number + 1, len(names))


def _require_space(folder: Path, parts: Path, image: int) -> None:
    """Refuse a disk that may be full before the parts are in: HDF5 does not survive that."""
    needed = sum(part.stat().st_size for part in parts.iterdir()) + image + SPARE
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise OSError(
            f"folder '{folder}' has {free / 1e6:.1f} MB free, and the result may need"
            f" {needed / 1e6:.1f} MB; free space there, or name another with --out"
        )


def _part(parts: Path, number: int) -> Part:
    """Read the fields of a frame."""
    part = read_part(parts, number)
    if part is None:
        raise OSError(f"part {number} in '{parts}' is missing; correlate again")
    return part


def _packed(part: Part) -> tuple[dict[str, bytes], str]:
    """Compress the fields of a frame; what kept it out goes with them."""
    fields, error = part
    return {name: deflate(shuffle(values)) for name, values in fields.items()}, error


def write_xdmf(path: Path, data: Path, frames: int, grid: dic.Grid, fields: Sequence[str]) -> None:
    """Describe the fields to ParaView: a layer of nodes over time, by references into the HDF5.

    It lies in z = 0 as a VTU of `touchplate export` does: readers set a 2DCoRectMesh on its edge.
    """
    shape = 1, *grid.shape
    root = ET.Element("Xdmf", Version="3.0")
    series = ET.SubElement(
        ET.SubElement(root, "Domain"),
        "Grid",
        Name="frames",
        GridType="Collection",
        CollectionType="Temporal",
    )
    for number in range(frames):
        one = ET.SubElement(series, "Grid", Name=f"frame {number}", GridType="Uniform")
        ET.SubElement(one, "Time", Value=str(number))
        ET.SubElement(one, "Topology", TopologyType="3DCoRectMesh", Dimensions=_text(shape))
        place = ET.SubElement(one, "Geometry", GeometryType="ORIGIN_DXDYDZ")
        _numbers(place, (0, int(grid.ys[0]), int(grid.xs[0])))  # z, y, x, as the dimensions
        _numbers(place, (grid.step, grid.step, grid.step))
        for name in (*fields, "status"):
            _slab(one, name, f"{data.name}:/{name}", number, (frames, *grid.shape))
    with export.aside(path) as draft:
        ET.ElementTree(root).write(draft, encoding="utf-8", xml_declaration=True)


def _text(values: Sequence[int]) -> str:
    return " ".join(map(str, values))


def _numbers(parent: ET.Element, values: tuple[int, int, int]) -> None:
    item = ET.SubElement(parent, "DataItem", Dimensions="3", NumberType="Float", Format="XML")
    item.text = _text(values)


def _slab(
    grid: ET.Element, name: str, place: str, number: int, shape: tuple[int, int, int]
) -> None:
    """Refer to one frame of a data set (F, R, C), a layer (1, R, C)."""
    layer = 1, *shape[1:]
    field = ET.SubElement(grid, "Attribute", Name=name, AttributeType="Scalar", Center="Node")
    part = ET.SubElement(field, "DataItem", ItemType="HyperSlab", Dimensions=_text(layer))
    corner = ET.SubElement(part, "DataItem", Dimensions="3 3", Format="XML")
    corner.text = _text((number, 0, 0, 1, 1, 1, *layer))
    kind, size = ("Char", "1") if name == "status" else ("Float", "4")
    whole = ET.SubElement(
        part,
        "DataItem",
        Dimensions=_text(shape),
        Format="HDF",
        NumberType=kind,
        Precision=size,
    )
    whole.text = place
