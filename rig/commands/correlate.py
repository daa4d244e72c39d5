"""`touchplate correlate REF DEF`: images in; displacement, strain and their σ out.

DEF is one image, or a whole test: a pattern such as 'frames/*.tif', a folder, a TIFF of several
pages or a video.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from rig.commands.output import emit, folder_aside, require_free, say

if TYPE_CHECKING:
    import numpy as np
    from rich.console import Group

    import dic
    from rig.series.frames import Frames
    from rig.series.regions import Regions
    from rig.series.scale import Scale, ScaledPoints
    from rig.series.tabulate import Measured

Kind = Literal["small", "green-lagrange", "logarithmic"]
Field = Literal["subset", "split", "adaptive", "net", "image-net"]

PRINTED = {"u": (1.0, "px"), "v": (1.0, "px")} | dict.fromkeys(("exx", "eyy", "exy"), (1e6, "µε"))
"""Factor and unit in which each field is printed."""


def correlate(
    reference: Annotated[Path, typer.Argument(metavar="REF", help="Image before.")],
    deformed: Annotated[
        str,
        typer.Argument(metavar="DEF", help="Image after; or 'frames/*.tif', a folder, a video."),
    ],
    subset: Annotated[int, typer.Option(help="Side of a subset, px, odd.")] = 21,
    step: Annotated[int, typer.Option(help="Distance of neighbouring points, px.")] = 5,
    order: Annotated[int, typer.Option(help="Order of the shape function.")] = 1,
    window: Annotated[int, typer.Option(help="Side of the strain window, points, odd.")] = 5,
    kind: Annotated[Kind, typer.Option(help="Definition of strain.")] = "small",
    invariants: Annotated[
        bool,
        typer.Option("--invariants", help="Principal strains, largest shear, von Mises too."),
    ] = False,
    field: Annotated[
        Field,
        typer.Option(
            help="One subset for all; that, split along cracks; windows that the data choose; or "
            "those and a net: of tiles or of images."
        ),
    ] = "subset",
    roi: Annotated[
        Path | None, typer.Option(metavar="MASK", help="Image that is black where to leave out.")
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option(metavar="'X1,Y1,X2,Y2=L mm'", help="Two points, px, and their distance."),
    ] = None,
    camera: Annotated[
        Path | None,
        typer.Option(metavar="JSON", help="Calibration whose lens, and pose, are taken out."),
    ] = None,
    regions: Annotated[
        Path | None,
        typer.Option(metavar="TOML", help="Polygons of the ROI, extensometers, gauges."),
    ] = None,
    prefilter: Annotated[
        float | None, typer.Option(help="Gaussian before correlation, px; else as it is needed.")
    ] = None,
    auto: Annotated[
        bool, typer.Option("--auto", help="Choose subset and step for the pattern.")
    ] = False,
    follow: Annotated[
        bool,
        typer.Option("--follow", help="In turn; renew the reference as the pattern changes."),
    ] = False,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Threads for a whole test, else one a core.")
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Dask scheduler, tcp://HOST:PORT, for a whole test."),
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
    from rig.commands import whole_test
    from rig.commands.scale import scale_of
    from rig.series.measure import measure
    from rig.series.regions import Regions, read_regions
    from rig.series.tabulate import StrainOptions, strained

    frames = whole_test.frames_of(deformed)
    folder = out or Path("results") / (Path(deformed).stem if frames is None else "test")
    _check_how(frames, deformed, follow, workers, cluster)
    if frames is None:
        require_free(folder, force)
    before = dic.read_image(reference)
    drawn = read_regions(regions) if regions else Regions()
    mask = _mask(before, roi, drawn)
    on_object = scale_of(scale, camera, before.shape)
    if auto:
        subset, step = _chosen(before, deformed, frames)

    start = time.perf_counter()
    prepared = dic.prepare(
        before, subset=subset, step=step, order=order, roi=mask, prefilter=prefilter
    )
    scaled = _scaled(on_object, prepared)
    options = StrainOptions(window, kind, field, invariants, scaled)
    if frames is not None:
        run = whole_test.Run(workers, force, as_json, follow, cluster)
        whole_test.correlate(folder, prepared, frames, drawn, options, run)
        return
    after = dic.read_image(deformed)
    found = strained(measure(prepared, after, field), options)
    seconds = time.perf_counter() - start

    with folder_aside(folder) as aside:
        _write(aside, before, found, {} if scaled is None else scaled.settings)
        if plots:
            dic.export.draw_fields(aside, before, found.disp, found.strain)
    figures = _figures(found.disp, found.strain) | {"seconds": seconds, "folder": str(folder)}
    emit(_tables(figures), figures, as_json)


def _check_how(
    frames: Frames | None, deformed: str, follow: bool, workers: int | None, cluster: str | None
) -> None:
    """Refuse options that say how several frames are taken where there is one, or that differ."""
    if frames is None and (follow or cluster):
        option = "--follow" if follow else "--cluster"
        raise ValueError(f"{option} is for several frames, and '{deformed}' is one; leave it out")
    if cluster and (follow or workers):
        reason = "takes frames in turn" if follow else "counts threads of this machine"
        option = "--follow" if follow else "--workers"
        raise ValueError(f"{option} {reason}, and --cluster works elsewhere; leave out one")


def _scaled(scale: Scale | None, ref: dic.Reference) -> ScaledPoints | None:
    """Points of a reference on the object; None without a scale."""
    if scale is None:
        return None
    from rig.series.scale import scaled_points

    points = scaled_points(scale, ref.xy)
    say(f"{points.mm_per_px:.6g} mm a px, from {scale.described}")
    return points


def _mask(image: np.ndarray, roi: Path | None, drawn: Regions) -> np.ndarray | None:
    """Pixels that both the mask and the polygons leave in; None if there is neither."""
    import dic
    from rig.series.regions import mask_of

    polygons = mask_of(drawn.roi, (int(image.shape[0]), int(image.shape[1])))
    if roi is None:
        return polygons
    mask = dic.read_image(roi) > 0
    return mask if polygons is None or mask.shape != polygons.shape else mask & polygons


def _chosen(before: np.ndarray, deformed: str, frames: Frames | None) -> tuple[int, int]:
    """Subset and step for the pattern, and for the noise between it and the first frame."""
    import dic
    from rig.series.noise import image_noise

    after = dic.read_image(deformed) if frames is None else _first(frames)
    name = Path(deformed).name if frames is None else frames.names[0]
    noise = image_noise(before, after, name)
    advice = dic.recommend_settings(before, noise.level)
    say(
        f"subset {advice.subset} px, step {advice.step} px: speckles of {advice.speckle:.1f} px, "
        f"σ of {1e3 * advice.sigma:.1f} mpx at a noise of {noise.level:.3g} grey levels, "
        f"{noise.source}"
    )
    return advice.subset, advice.step


def _first(frames: Frames) -> np.ndarray | None:
    try:
        return frames.read(0)
    except (OSError, ValueError):  # it is left out of the test too
        return None


def _write(folder: Path, image: np.ndarray, found: Measured, scale: dict[str, object]) -> None:
    from dic import export

    export.write_hdf5(folder / "fields.h5", found.disp, found.strain, found.more, scale)
    export.write_csv(folder / "fields.csv", found.disp, found.strain, found.more)
    export.draw_overview(folder / "fields.png", image, found.disp, found.strain)


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
