"""A bent plate as a VTK file of XML (.vtu), which ParaView and meshio read."""

from __future__ import annotations

import sys
from base64 import b64encode
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

from fe.arrays import F64, I64, AnyArray
from fe.output.surface import FaceSamples, PlateState, sample, writable, write_whole
from fe.plate.plate import Touch

# Numbers of the cell types in VTK's format.
_VERTEX, _QUAD = 1, 9

_TYPES = {"f8": "Float64", "f4": "Float32", "i8": "Int64", "i1": "Int8", "u1": "UInt8"}


def write_vtu(path: str | Path, state: PlateState, touches: Sequence[Touch] = ()) -> None:
    """Write the touched face in its bent shape, its strain and its touches.

    The face is a grid of quadrilaterals on the nodes of the mesh, at z = half the thickness over
    the shape at rest, plus the displacement; a touch is a vertex on it. Data of the points:
    `displacement` (3), mm; `exx`, `eyy`, `exy` of the touched face, `exy` the tensor component;
    `thickness`, mm; `force`, N into the plate, and `radius`, mm, both 0 but at touches. Warping by
    `displacement` with a factor k - 1 shows the bending k times; k = 0 is the plate at rest.

    Parameters
    ----------
    path : str or Path
        Ends in `.vtu`. An existing file is replaced.
    state : PlateState
        Of any theory.
    touches : sequence of Touch

    Raises
    ------
    ValueError
        The name does not end in `.vtu`, or a touch lies outside the plate.
    OSError
        The folder does not exist or cannot be written.
    """
    path = writable(path, (".vtu",))
    surface = sample(state, touches)
    height = state.plate.rise(surface.xy) + 0.5 * surface.thickness
    points = np.column_stack([surface.xy, height]) + surface.displacement
    cells = _cells(surface.shape, len(surface.xy))
    _write(path, points, cells, _fields(surface, touches), "exx")


def write_sheet(path: str | Path, points: F64, fields: Mapping[str, AnyArray]) -> None:
    """Write any field over a sheet of quadrilaterals.

    Parameters
    ----------
    path : str or Path
        Ends in `.vtu`. An existing file is replaced.
    points : (R, C, 3) float64
        Nodes of the sheet, by row and column.
    fields : mapping of (R, C) or (R, C, 3)
        Values at the nodes; `displacement` (R, C, 3) is what ParaView warps by.

    Raises
    ------
    ValueError
        The name does not end in `.vtu`, or a field is not of the nodes.
    OSError
        The folder does not exist or cannot be written.
    """
    path, shape = writable(path, (".vtu",)), points.shape[:2]
    for name, values in fields.items():
        if values.shape not in (shape, (*shape, 3)):
            raise ValueError(
                f"field {name} must be of {shape} nodes, got shape {values.shape}; reshape it"
            )
    flat = {name: values.reshape(-1, *values.shape[2:]) for name, values in fields.items()}
    count = points.shape[0] * points.shape[1]
    cells = _cells((shape[0], shape[1]), count)
    _write(path, points.reshape(-1, 3), cells, flat, next(iter(flat)))


def _write(
    path: Path,
    points: F64,
    cells: tuple[I64, I64],
    fields: Mapping[str, AnyArray],
    shown: str,
) -> None:
    """Write points, cells (points of them one after the other, and how many) and fields."""
    connectivity, sizes = cells
    order = f"{sys.byteorder.capitalize()}Endian"
    kind = {"type": "UnstructuredGrid", "version": "1.0"}
    file = ET.Element("VTKFile", kind, byte_order=order, header_type="UInt64")
    counts = {"NumberOfPoints": str(len(points)), "NumberOfCells": str(len(sizes))}
    piece = ET.SubElement(ET.SubElement(file, "UnstructuredGrid"), "Piece", counts)
    data = ET.SubElement(piece, "PointData", Vectors="displacement", Scalars=shown)
    for name, values in fields.items():
        _array(data, name, values)
    _array(ET.SubElement(piece, "Points"), "points", points)
    kinds = ET.SubElement(piece, "Cells")
    _array(kinds, "connectivity", connectivity)
    _array(kinds, "offsets", np.cumsum(sizes))
    _array(kinds, "types", np.where(sizes == 1, _VERTEX, _QUAD).astype(np.uint8))
    write_whole(path, ET.tostring(file, encoding="utf-8", xml_declaration=True))


def _cells(shape: tuple[int, int], points: int) -> tuple[I64, I64]:
    """Points of the cells one after the other, and how many each has: quads, then touches."""
    rows, columns = shape
    node = np.arange(rows * columns).reshape(rows, columns)
    # Counter-clockwise seen from +z, so that the normal leaves the touched face.
    quads = np.stack([node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1)
    vertices = np.arange(node.size, points)
    sizes = np.repeat([4, 1], [quads.size // 4, vertices.size])
    return np.concatenate([quads.ravel(), vertices]), sizes


def _fields(surface: FaceSamples, touches: Sequence[Touch]) -> dict[str, F64]:
    untouched = np.zeros(len(surface.xy) - len(touches))
    return {
        "displacement": surface.displacement,
        "exx": surface.strain[:, 0],
        "eyy": surface.strain[:, 1],
        "exy": surface.strain[:, 2],
        "thickness": surface.thickness,
        "force": np.append(untouched, [touch.force for touch in touches]),
        "radius": np.append(untouched, [touch.radius for touch in touches]),
    }


def _array(parent: ET.Element, name: str, values: AnyArray) -> None:
    """Add an array: its number of bytes and the bytes, both in base64."""
    element = ET.SubElement(parent, "DataArray", Name=name, type=_TYPES[values.dtype.str[1:]])
    element.set("format", "binary")
    if values.ndim == 2:
        element.set("NumberOfComponents", str(values.shape[1]))
    content = np.ascontiguousarray(values).tobytes()
    element.text = b64encode(np.uint64(len(content)).tobytes() + content).decode("ascii")
