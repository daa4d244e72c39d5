"""The result of a whole test for other programs: tables, arrays, surfaces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np

import fe
from rig.series.plots import to_mp4, to_png
from rig.series.read import SeriesResult
from rig.system.arrays import AnyArray

Report = Callable[[int, int], None]
_LARGEST = 1 << 31  # bytes that a variable of MATLAB's format 5 may have


def to_csv(result: SeriesResult, folder: Path, field: str, report: Report) -> list[Path]:
    """Write a table for each frame, a line a point, and one of the frames."""
    paths = [folder / "frames.csv"]
    lines = zip(result.names, result.errors, strict=True)
    text = "".join(f"{n},{_quoted(name)},{_quoted(said)}\n" for n, (name, said) in enumerate(lines))
    paths[0].write_text("number,frame,error\n" + text, encoding="utf-8")
    for number in _reported(result, report):
        paths.append(folder / f"frame-{number:06d}.csv")
        write_frame(paths[-1], result, number)
    return paths


def write_frame(path: Path, result: SeriesResult, number: int) -> None:
    """Write one frame as CSV, a line a point: where it is, and all fields."""
    table = _places(result) | result.frame(number)
    np.savetxt(
        path,
        np.column_stack([values.ravel() for values in table.values()]),
        fmt=["%d" if name == "status" else "%.7g" for name in table],
        delimiter=",",
        header=",".join(table),
        comments="",
    )


def to_npz(result: SeriesResult, folder: Path, field: str, report: Report) -> list[Path]:
    """Write all fields as arrays of NumPy."""
    path = folder / "fields.npz"
    np.savez_compressed(path, allow_pickle=False, **_arrays(result, report))
    return [path]


def to_mat(result: SeriesResult, folder: Path, field: str, report: Report) -> list[Path]:
    """Write all fields as variables of MATLAB, format 5; names of frames as cells.

    Raises
    ------
    ValueError
        A field is larger than the format allows.
    """
    from scipy.io import savemat

    size = 4 * len(result.names) * result.grid.xs.size * result.grid.ys.size
    if size >= _LARGEST:
        raise ValueError(
            f"a field has {size / 2**30:.1f} GiB and MATLAB's format 5 takes 2 GiB; read"
            f" '{result.path}' with h5read there"
        )
    arrays = _arrays(result, report)
    cells = {name: arrays[name].astype(object) for name in ("frame", "error")}
    settings = {name: value for name, value in result.settings.items() if name != "format"}
    path = folder / "fields.mat"
    savemat(path, arrays | cells | {"settings": settings}, do_compression=True)
    return [path]


def to_vtu(result: SeriesResult, folder: Path, field: str, report: Report) -> list[Path]:
    """Write a surface a frame for ParaView, and a PVD that puts them in time.

    Points lie at the reference in px, or in mm where the test has a scale, and `displacement` is
    in the same unit.
    """
    flat = np.stack(np.meshgrid(result.grid.xs, result.grid.ys), axis=-1)
    points, moved = (flat, "u v") if result.places is None else (result.places, "u_mm v_mm")
    points = np.dstack([points, np.zeros(result.grid.shape)]).astype(np.float64)
    paths: list[Path] = []
    for number in _reported(result, report):
        fields = result.frame(number)
        parts = [fields[name] for name in moved.split()]
        vector = np.dstack([*parts, np.zeros(result.grid.shape)])
        paths.append(folder / f"frame-{number:06d}.vtu")
        fe.write_sheet(paths[-1], points, fields | {"displacement": vector})
    return [_collected(folder / "frames.pvd", paths), *paths]


Way = Callable[[SeriesResult, Path, str, Report], list[Path]]
WAYS: dict[str, Way] = {
    "csv": to_csv,
    "npz": to_npz,
    "mat": to_mat,
    "vtu": to_vtu,
    "png": to_png,
    "mp4": to_mp4,
}
"""What writes each kind of file; the field named is that of plots and videos."""


def _reported(result: SeriesResult, report: Report) -> Iterator[int]:
    for number in range(len(result.names)):
        yield number
        report(number + 1, len(result.names))


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"'


def _places(result: SeriesResult) -> dict[str, AnyArray]:
    """Where the points are, (R, C) each, px and mm."""
    x, y = np.meshgrid(result.grid.xs, result.grid.ys)
    places = {"x": x, "y": y}
    if result.places is not None:
        places |= {"x_mm": result.places[..., 0], "y_mm": result.places[..., 1]}
    return places


def _arrays(result: SeriesResult, report: Report) -> dict[str, AnyArray]:
    """All fields (F, R, C), the places (R, C), names and errors (F,)."""
    arrays = {
        name: np.empty((len(result.names), *result.grid.shape), values.dtype)
        for name, values in result.frame(0).items()
    }
    for number in _reported(result, report):
        for name, values in result.frame(number).items():
            arrays[name][number] = values
    texts = {"frame": np.array(result.names), "error": np.array(result.errors)}
    return _places(result) | texts | arrays


def _collected(path: Path, paths: list[Path]) -> Path:
    root = ET.Element("VTKFile", type="Collection", version="1.0")
    collection = ET.SubElement(root, "Collection")
    for number, one in enumerate(paths):
        ET.SubElement(collection, "DataSet", timestep=str(number), file=one.name)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    return path
