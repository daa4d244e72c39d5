"""`touchplate collect SCENE`: known presses, one after the other, and what they correct."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rig.commands.output import console, emit
from rig.system.process import interruptible

if TYPE_CHECKING:
    from rig.calibration.collect import Collector, Taken
    from rig.calibration.store import Calibration
    from rig.scene import Scene

PATIENCE = 10.0  # s that a scripted press may take; after so many in all the session is given up
COLUMNS = ("x_mm", "y_mm", "force_n", "found_x_mm", "found_y_mm", "found_force_n")
SIGMAS = ("sigma_x_mm", "sigma_y_mm", "sigma_force_n", "frames")


def collect(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or a TOML file.")],
    presses: Annotated[int, typer.Option(min=9, max=30, help="How many.")] = 20,
    table: Annotated[Path | None, typer.Option(metavar="FILE", help="Write them as CSV.")] = None,
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
    """Ask for known presses, see each stand still, and score what they correct on those held out.

    In the twin a scripted finger presses.
    """
    from rig.commands.run import known
    from rig.scene import load, parse_overrides

    overrides = parse_overrides(settings or []) | {"touches.max_touches": 1}
    loaded = load(scene, overrides)
    if loaded.source and loaded.source.kind == "twin":
        overrides |= {"source.script": "collect"}
    if loaded.estimator and loaded.estimator.kind == "net":
        # Presses are known from the whole pattern: a net may not be trained yet.
        overrides |= {"estimator": {"kind": "pattern"}}
    loaded = load(scene, overrides)
    # What older presses corrected is not applied: these are to say what the bench itself finds.
    calibration = known(scene, loaded).calibration.model_copy(update={"presses": None})
    with ExitStack() as open_parts, interruptible():
        collector = _ask(loaded, calibration, presses, record, open_parts)
    if table:
        _write(table, collector.taken)
    conclude(scene, collector.taken, keep, as_json)


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


def _ask(
    scene: Scene, calibration: Calibration, count: int, record: Path | None, open_parts: ExitStack
) -> Collector:
    """Run the loop until all presses are taken."""
    from rig.calibration.collect import Collector, targets
    from rig.commands.run import start
    from rig.live.snapshot import Mark
    from rig.live.view import marks
    from rig.projector.markers import fit_plate

    collector = Collector(targets(scene), count)
    loop, _ = start(scene, calibration, True, record, open_parts)
    show = None
    if scene.projector and scene.plate:
        from rig.projector import open_projector

        window = scene.projector
        screen = calibration.screen() or fit_plate(window.size, scene.plate.size)
        opened = open_projector(screen, window.display, window.full_screen, output=window.output)
        show = open_parts.enter_context(opened)
    rate = scene.camera.rate if scene.camera else 0.0
    for snapshot in islice(loop, int(PATIENCE * count * rate)):
        # Each frame by itself: the collector takes the mean of those that it holds.
        seen = () if snapshot.estimate is None else marks(snapshot.estimate)
        if collector.add_frame(seen, snapshot.captured):
            console().print(f"{len(collector.taken)} of {count} presses are taken")
        if (target := collector.target) is None:
            return collector
        if show:
            show((Mark(target.x, target.y, target.force),))
    raise ValueError(
        f"{len(collector.taken)} of {count} presses were seen; watch them with `touchplate run`"
    )


def _write(path: Path, taken: Sequence[Taken]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS + SIGMAS)
        for one in taken:
            press = (one.press.x, one.press.y, one.press.force)
            rows.writerow((*press, *one.found.tolist(), *one.sigma.tolist(), one.frames))
