"""`touchplate correlate REF DEF`: images in; displacement, strain and their σ out.

REF is one image, or several of the specimen at rest, whose mean is the reference. DEF is one image,
or a whole test: a pattern such as 'frames/*.tif', a folder, a TIFF of several pages or a video.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from rig.commands.output import require_free, say, warn

if TYPE_CHECKING:
    import numpy as np

    import dic
    from models import FieldNet, ImageNet
    from rig.series.frames import Frames
    from rig.series.regions import Regions
    from rig.series.scale import Scale, ScaledPoints

Kind = Literal["small", "green-lagrange", "logarithmic"]
Field = Literal["subset", "split", "adaptive", "net", "image-net"]


def correlate(
    reference: Annotated[
        str, typer.Argument(metavar="REF", help="Image before; or 'stills/*.tif', a folder.")
    ],
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
    net: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Net of `train dic-net` or `train image-net` to take."),
    ] = None,
    roi: Annotated[
        Path | None, typer.Option(metavar="MASK", help="Image that is black where to leave out.")
    ] = None,
    scale: Annotated[
        str | None,
        typer.Option(metavar="'X1,Y1,X2,Y2=L mm'", help="Two points, px, and their distance."),
    ] = None,
    board: Annotated[
        str | None,
        typer.Option(metavar="IMAGE", help="Image of a ChArUco board where the specimen lies."),
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
    guess: Annotated[
        str | None,
        typer.Option(metavar="U,V", help="Motion to start from, px; else it is searched for."),
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
    from rig.commands import pair, photographs, whole_test
    from rig.commands.compiling import compiling_announced
    from rig.commands.scale import scale_of
    from rig.series.measure import require_points
    from rig.series.regions import Regions, read_regions
    from rig.series.tabulate import StrainOptions

    frames = whole_test.frames_of(deformed)
    folder = out or Path("results") / (Path(deformed).stem if frames is None else "test")
    if frames is None:
        _refuse(deformed, {"--follow": follow, "--cluster": cluster, "--workers": workers})
        require_free(folder, force)
    else:
        _check_how(follow, workers, cluster, plots)
    start = _guess(guess, field, net, follow)
    stills = photographs.read_stills(reference)
    before = _mean(stills)
    _require_on_image(start, before)
    after = photographs.read(Path(deformed)) if frames is None else None
    drawn = read_regions(regions) if regions else Regions()
    mask = _mask(before, roi, drawn)
    estimator = field if net is None else _net(net, field)
    on_object = scale_of(scale, board, camera, before.shape)
    if auto:
        first = _first(frames) if after is None else after
        subset, step = _chosen(before, first, frames.names[0] if frames else Path(deformed).name)

    with compiling_announced():
        prepared = _prepared(stills, subset, step, order, mask, prefilter)
        require_points(prepared)
        scaled = _scaled(on_object, prepared)
        strain = StrainOptions(window, kind, estimator, invariants, scaled, start)
        _warn_off_the_points(drawn, prepared)
        if frames is not None:
            run = whole_test.Run(workers, force, as_json, follow, cluster)
            whole_test.correlate(folder, prepared, frames, drawn, strain, run)
        elif after is not None:
            written = pair.Written(plots, force, as_json)
            named = Path(deformed).name, after
            pair.correlate(folder, prepared, named, drawn, strain, written)


def _mean(stills: list[np.ndarray]) -> np.ndarray:
    """Mean of the stills (H, W); of a single one itself, whose depth says where it clips."""
    import numpy as np

    return stills[0] if len(stills) == 1 else np.mean(stills, axis=0)


def _prepared(
    stills: list[np.ndarray],
    subset: int,
    step: int,
    order: int,
    mask: np.ndarray | None,
    prefilter: float | None,
) -> dic.Reference:
    """Prepare the reference, the mean of the stills where there are several."""
    import dic

    if len(stills) > 1:
        return dic.prepare_stills(
            stills, subset=subset, step=step, order=order, roi=mask, prefilter=prefilter
        )
    return dic.prepare(
        stills[0], subset=subset, step=step, order=order, roi=mask, prefilter=prefilter
    )


def _refuse(deformed: str, options: Mapping[str, object]) -> None:
    """Refuse options that say how several frames are taken where there is one."""
    for option, given in options.items():
        if given:
            raise ValueError(
                f"{option} is for several frames, and '{deformed}' is one; leave it out"
            )


def _check_how(follow: bool, workers: int | None, cluster: str | None, plots: bool) -> None:
    """Refuse options that several frames do not have, or that differ in how they are taken."""
    if plots:
        raise ValueError(
            "--plots draws the fields of a pair; leave it out, and draw those of a test with"
            " `touchplate export --to png`"
        )
    if cluster and (follow or workers):
        reason = "takes frames in turn" if follow else "counts threads of this machine"
        option = "--follow" if follow else "--workers"
        raise ValueError(f"{option} {reason}, and --cluster works elsewhere; leave out one")


def _guess(
    text: str | None, field: Field, net: Path | None, follow: bool
) -> tuple[float, float] | None:
    """Read the motion that all points start from, px; None where there is none."""
    if text is None:
        return None
    if follow:
        raise ValueError("--follow starts from the frame before, not from --guess; leave out one")
    if net or field.endswith("net"):
        raise ValueError("a net takes no --guess; leave it out or take another --field")
    try:
        u, v = (float(number) for number in text.split(","))
    except ValueError:
        u = v = float("nan")
    if not (isfinite(u) and isfinite(v)):
        raise ValueError(f"guess must be u and v in px, such as 12.5,-3, got '{text}'; write it so")
    return u, v


def _require_on_image(guess: tuple[float, float] | None, image: np.ndarray) -> None:
    """Refuse a motion px by which every point would leave the image (H, W)."""
    height, width = image.shape
    if guess and not (abs(guess[0]) < width and abs(guess[1]) < height):
        raise ValueError(
            f"guess {guess[0]:g},{guess[1]:g} px moves all points off the image of"
            f" {width}x{height} px; give the motion in px"
        )


def _warn_off_the_points(drawn: Regions, ref: dic.Reference) -> None:
    """Warn of each extensometer and gauge that will read nothing."""
    from rig.series.gauges import off_the_points

    if ref.grid is not None:
        for sentence in off_the_points(drawn, ref.grid):
            warn(sentence)


def _net(path: Path, field: Field) -> FieldNet | ImageNet:
    """Read the net of a file; refuse a field that is measured by another one."""
    from models import load_displacement_net
    from rig.series.measure import kind_of

    net = load_displacement_net(path)
    if field not in ("subset", kind_of(net)):
        raise ValueError(
            f"--net {path} measures --field {kind_of(net)}, not --field {field}; leave out one"
        )
    return net


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
    import numpy as np

    from rig.series.regions import mask_of

    height, width = image.shape
    polygons = mask_of(drawn.roi, (int(height), int(width)))
    parts = [polygons] if roi is None else [polygons, _read_mask(roi, image.shape)]
    drawn_in = [part for part in parts if part is not None]
    if not drawn_in:
        return None
    mask = np.logical_and.reduce(drawn_in)
    if not mask.any():
        raise ValueError("the ROI leaves no pixel of the reference; draw it over the pattern")
    return mask


def _read_mask(path: Path, shape: tuple[int, ...]) -> np.ndarray:
    """Read the mask of an image (H, W), True where it is not black."""
    from rig.series.photograph import read_photograph

    mask = read_photograph(path) > 0
    if mask.shape != shape:
        raise ValueError(
            f"mask '{path}' has {mask.shape[1]}x{mask.shape[0]} px and the reference"
            f" {shape[1]}x{shape[0]} px; draw it over the reference"
        )
    return mask


def _chosen(before: np.ndarray, after: np.ndarray | None, name: str) -> tuple[int, int]:
    """Subset and step for the pattern, and for the noise between it and the first frame."""
    import dic
    from rig.series.noise import image_noise

    noise = image_noise(before, after, name)
    advice = dic.recommend_settings(before, noise.level)
    say(
        f"subset {advice.subset} px, step {advice.step} px: speckles of {advice.speckle:.1f} px, "
        f"σ of {1e3 * advice.sigma:.1f} mpx at a noise of {noise.level:.3g} grey levels, "
        f"{noise.source}"
    )
    return advice.subset, advice.step


def _first(frames: Frames | None) -> np.ndarray | None:
    try:
        return frames.read(0) if frames else None
    except (OSError, ValueError):  # it is left out of the test too
        return None
