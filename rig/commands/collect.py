"""`touchplate collect SCENE`: known presses, one after the other, and the bench they show."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from dataclasses import asdict, replace
from itertools import islice, starmap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.commands.output import console, emit, progress, say, warn
from rig.system.process import interruptible

if TYPE_CHECKING:
    from models import BenchEstimate
    from rig.calibration.bench_presses import Listed, ShownPress
    from rig.calibration.collect import Collector, Taken
    from rig.calibration.press_folder import PressFolder
    from rig.calibration.store import Calibration
    from rig.live.bench import Bench
    from rig.live.snapshot import Snapshot
    from rig.scene import Scene

    See = Callable[[Snapshot, Taken | None], None]

PRESSES = 20  # that are asked for
PATIENCE = 10.0  # s that a scripted press may take; after so many in all the session is given up
COLUMNS = ("x_mm", "y_mm", "force_n", "found_x_mm", "found_y_mm", "found_force_n")
SIGMAS = ("sigma_x_mm", "sigma_y_mm", "sigma_force_n", "frames")


def collect(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or a TOML file.")],
    presses: Annotated[
        int | None, typer.Option(min=9, max=30, help=f"How many to ask for; {PRESSES} unless said.")
    ] = None,
    table: Annotated[Path | None, typer.Option(metavar="FILE", help="Write them as CSV.")] = None,
    listed: Annotated[
        Path | None,
        typer.Option(
            "--list",
            metavar="LIST.csv",
            help="Take those of recorded images: press,first_frame,last_frame,x_mm,y_mm,force_n",
        ),
    ] = None,
    images: Annotated[
        Path | None,
        typer.Option(
            metavar="PATH",
            help="Keep images and list in this folder, else in SCENE.presses; with --list the"
            " folder or video that has them, else that of the scene.",
        ),
    ] = None,
    record: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Keep the session in a new file *.h5.")
    ] = None,
    keep: Annotated[
        bool,
        typer.Option(help="Put what they correct beside the scene, if it makes nothing worse."),
    ] = True,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override the scene.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Ask for known presses, see each stand still, and find the bench that they show.

    What was pressed is kept: a collection that was stopped goes on by the same command. In the twin
    a scripted finger presses. Scenes without an estimator of the whole pattern get a map of places
    and forces instead. With --list the presses of recorded images are taken, and none is asked for.
    """
    from rig.calibration.collect import require_live
    from rig.commands.run import known
    from rig.scene import load, parse_overrides

    if listed and (presses or record):
        raise ValueError(
            "presses of a list are neither asked for nor recorded; leave out --presses and --record"
        )

    overrides = parse_overrides(settings or []) | {"touches.max_touches": 1}
    loaded = load(scene, overrides)
    if loaded.source and loaded.source.kind == "twin":
        overrides |= {"source.script": "collect"}
    whole = loaded.estimator is not None and loaded.estimator.kind == "pattern"
    if loaded.estimator is not None and loaded.estimator.kind == "net":
        # Presses are known from the whole pattern: a net may not be trained yet. What they correct
        # is a bench that is just as described, as a net takes it.
        overrides |= {"estimator": {"kind": "pattern", "bench": "exact"}}
    loaded = load(scene, overrides)
    # What older presses corrected is not applied: these are to say what the bench itself finds.
    calibration = known(scene, loaded).calibration.model_copy(update={"presses": None})
    if listed:
        bench_of = _usual if whole else _exact
        _take_listed(scene, loaded, calibration, bench_of, listed, images, table, keep, as_json)
        return
    require_live(loaded)
    count = presses or PRESSES
    if not whole:
        taken = _collected(loaded, calibration, count, record)
        if table:
            _write(table, map(_row, taken))
        conclude(scene, taken, keep, as_json)
        return
    folder = _press_folder(loaded, images or Path(f"{Path(scene).stem}.presses"))
    taken = _collected(loaded, calibration, count, record, folder)
    if table:
        _write(table, map(_row, taken))
    _identify(scene, loaded, calibration, folder, keep, as_json)


def _usual(scene: Scene, calibration: Calibration) -> Bench:
    """Build a bench of which nothing is known but the scene; presses are to show it."""
    from rig.calibration.bench_presses import usual_bench

    with progress("plate modes") as report:
        return usual_bench(scene, calibration, report)


def _exact(scene: Scene, calibration: Calibration) -> Bench:
    """Build a bench as the scene says it is; presses are to show where that is wrong."""
    from rig.live.bench import build_bench

    with progress("plate modes") as report:
        built = build_bench(scene, report, calibration)
    return replace(built, strain=False, max_touches=1)


def _take_listed(
    scene: str,
    loaded: Scene,
    calibration: Calibration,
    bench_of: Callable[[Scene, Calibration], Bench],
    path: Path,
    images: Path | None,
    table: Path | None,
    keep: bool,
    as_json: bool,
) -> None:
    """Take listed presses out of recorded images, and conclude from them as from live ones."""
    from rig.calibration.bench_presses import identify_shown, listed_images, read_list
    from rig.calibration.collect import recorded_images
    from rig.calibration.listed_presses import known_presses, see_presses

    source, listed = images or recorded_images(loaded), read_list(path)
    frames = listed_images(loaded, listed, source)
    bench = bench_of(loaded, calibration)
    seen = see_presses(bench, listed, frames)
    for sentence in seen.left_out:
        warn(f"left out: {sentence}")
    say(f"{len(seen.shown)} of {len(listed)} presses are taken")
    if table:
        _write(table, starmap(_listed_row, seen.shown))
    if bench.known is None:
        taken = list(known_presses(seen.shown))
        if len(taken) < len(seen.shown):
            warn(f"{len(taken)} of them count: a map needs the place and the force of a press")
        conclude(scene, taken, keep, as_json)
        return
    with progress("the bench") as report:
        found = identify_shown(bench, seen.chain, seen.shown, (), report)
    names = [one.press for one, _ in seen.shown]
    _keep_bench(scene, loaded, found, names, seen.left_out, source, keep, as_json)


def _press_folder(scene: Scene, path: Path) -> PressFolder:
    from rig.calibration.press_folder import open_press_folder

    if scene.dic is None:
        raise ValueError(
            f"scene '{scene.title}' has no [dic] to see presses with; add it, as twin has it"
        )
    return open_press_folder(path, scene.dic.reference_frames)


def _identify(
    scene: str,
    loaded: Scene,
    calibration: Calibration,
    folder: PressFolder,
    keep: bool,
    as_json: bool,
) -> None:
    """Find the bench that the presses of a folder show, say it, and put it beside the scene."""
    from rig.calibration import bench_presses

    listed = folder.listed
    with progress("plate modes") as report:
        given = loaded, calibration, listed, folder.path, (), report
        found = bench_presses.identify_bench(*given)
    names = [one.press for one in listed]
    _keep_bench(scene, loaded, found, names, (), folder.path, keep, as_json)


def _keep_bench(
    scene: str,
    loaded: Scene,
    found: BenchEstimate,
    presses: list[str],
    left_out: Sequence[str],
    images: Path,
    keep: bool,
    as_json: bool,
) -> None:
    """Say what bench presses show, and put it beside the scene."""
    from rig.calibration import steps, store
    from rig.calibration.bench_refusal import require_sound
    from rig.commands.bench_table import described, table

    path, size = store.beside(scene), steps.plate_of(loaded).size
    require_sound(found, size)
    if keep:
        store.keep(path, found, loaded)
    said = described(found, presses, size)
    said |= {"presses": len(presses), "left_out": list(left_out), "images": str(images)}
    said |= {"kept": keep, "path": str(path)}
    emit(table(said), said, as_json)


def conclude(scene: str, taken: Sequence[Taken], keep: bool, as_json: bool) -> None:
    """Say what presses correct, and put it beside the scene if it makes nothing worse."""
    from rig.calibration import store
    from rig.calibration.collect import score

    corrected, scored = score(taken)
    kept = keep and scored.helps
    if kept:
        store.keep(store.beside(scene), corrected)
    said = {"presses": len(taken), "slips": len(corrected.slips), **asdict(scored)}
    what = ", ".join(corrected.terms) or "nothing, for they prove nothing wrong"
    said |= {"corrects": corrected.terms, "gain": corrected.gain}
    said |= {"error_mm": corrected.error, "kept": kept}
    sentence = (
        f"{len(taken)} presses correct {what}; each held out in turn: {scored.place_before:.2f} →"
        f" {scored.place_after:.2f} mm, force {100 * scored.force_before:.1f} →"
        f" {100 * scored.force_after:.1f} %"
    )
    emit(sentence, said, as_json)


def _collected(
    scene: Scene,
    calibration: Calibration,
    count: int,
    record: Path | None,
    folder: PressFolder | None = None,
) -> list[Taken]:
    """Run the loop until all presses are taken; those that a folder has are not asked for again.

    Raises
    ------
    ValueError
        The source ended, or patience, before all were taken.
    """
    from rig.calibration.collect import Collector, targets
    from rig.calibration.press_folder import KeptFrames

    asked, before = targets(scene), 0 if folder is None else len(folder.listed)
    wanted = Collector(asked if folder is None else folder.left(asked), count - before)
    if wanted.target is None:
        return wanted.taken
    kept = KeptFrames(folder)

    def see(snapshot: Snapshot, taken: Taken | None) -> None:
        kept(snapshot, taken)
        if taken:
            console().print(f"{before + len(wanted.taken)} of {count} presses are taken")

    with ExitStack() as open_parts, interruptible():
        _ask(scene, calibration, wanted, record, open_parts, see)
    if len(wanted.taken) < wanted.wanted:
        seen = f"{before + len(wanted.taken)} of {count} presses were seen"
        if folder is None:
            raise ValueError(f"{seen}; watch them with `touchplate run`")
        raise ValueError(f"{seen}; they are kept in '{folder.path}', go on by the same command")
    return wanted.taken


def _ask(
    scene: Scene,
    calibration: Calibration,
    collector: Collector,
    record: Path | None,
    open_parts: ExitStack,
    see: See,
) -> None:
    """Run the loop until all presses are taken, or for as long as patience lasts."""
    from rig.commands.run import start
    from rig.live.snapshot import Mark
    from rig.live.view import marks
    from rig.projector.markers import fit_plate

    loop, _ = start(scene, calibration, True, record, open_parts)
    show = None
    if scene.projector and scene.plate:
        from rig.projector import open_projector

        window = scene.projector
        screen = calibration.screen() or fit_plate(window.size, scene.plate.size)
        opened = open_projector(screen, window.display, window.full_screen, output=window.output)
        show = open_parts.enter_context(opened)
    rate = scene.camera.rate if scene.camera else 0.0
    for snapshot in islice(loop, int(PATIENCE * collector.wanted * rate)):
        # Each frame by itself: the collector takes the mean of those that it holds.
        seen = () if snapshot.estimate is None else marks(snapshot.estimate)
        taken = collector.add_frame(seen, snapshot.captured)
        see(snapshot, taken)
        if (target := collector.target) is None:
            return
        if show:
            show((Mark(target.x, target.y, target.force),))


def _row(one: Taken) -> tuple[object, ...]:
    press = one.press.x, one.press.y, one.press.force
    return (*press, *one.found.tolist(), *one.sigma.tolist(), one.frames)


def _listed_row(one: Listed, shown: ShownPress) -> tuple[object, ...]:
    """Give the row of a listed press; what the list does not say stays empty."""
    first, last = one.frames
    press = *(one.place or ("", "")), one.force
    return (*press, *shown.touch.tolist(), *shown.sigma.tolist(), last - first + 1)


def _write(path: Path, rows: Iterable[tuple[object, ...]]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS + SIGMAS, *rows])
