"""`touchplate collect SCENE`: known presses, one after the other, and what they mend."""

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
from rig.process import interruptible

if TYPE_CHECKING:
    from rig.calibration.collect import Collector, Taken
    from rig.scene import Scene

PATIENCE = 10.0  # s that a scripted press may take; after so many in all the session is given up
COLUMNS = ("x_mm", "y_mm", "force_n", "found_x_mm", "found_y_mm", "found_force_n")
SIGMAS = ("sigma_x_mm", "sigma_y_mm", "sigma_force_n", "frames")


def collect(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or a TOML file.")],
    presses: Annotated[int, typer.Option(min=9, max=30, help="How many.")] = 20,
    table: Annotated[Path | None, typer.Option(metavar="FILE", help="Write them as CSV.")] = None,
    keep: Annotated[
        bool, typer.Option(help="Put what they mend beside the scene, if it helps.")
    ] = True,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override the scene.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Ask for known presses, see each stand still, and score what they mend on those held out.

    In the twin a scripted finger presses.
    """
    import rig
    from rig.calibration import store
    from rig.calibration.collect import score

    overrides = rig.scene.parse_overrides(settings or [])
    loaded = rig.load(scene, overrides | {"source.script": "collect", "touches.most": 1})
    with interruptible(), ExitStack() as open_parts:
        collector = _ask(loaded, presses, open_parts)
    mended, scored = score(collector.taken)
    if table:
        _write(table, collector.taken)
    helps = scored.place_after < scored.place_before
    if keep and helps:  # an affine map of few presses may fit their noise
        store.keep(store.beside(scene), mended)
    said = {"presses": len(collector.taken), "slips": len(mended.slips), **asdict(scored)}
    emit(
        f"{said['presses']} presses; {scored.held_out} held out: {scored.place_before:.2f} →"
        f" {scored.place_after:.2f} mm, force {100 * scored.force_before:.1f} →"
        f" {100 * scored.force_after:.1f} %",
        said | {"gain": mended.gain, "error_mm": mended.error, "kept": keep and helps},
        as_json,
    )


def _ask(scene: Scene, count: int, open_parts: ExitStack) -> Collector:
    """Run the loop until all presses are taken."""
    from rig.calibration import store
    from rig.calibration.collect import Collector
    from rig.commands.run import start
    from rig.markers import fit_plate
    from rig.script import asked
    from rig.snapshot import Mark

    if scene.plate is None or scene.touches is None or scene.camera is None or not scene.source:
        raise ValueError(f"scene '{scene.title}' needs [touches] and a twin to collect presses")
    collector = Collector(asked(scene.plate.size, scene.touches.force, scene.source.seed), count)
    loop, _ = start(scene, store.Calibration(), True, None, open_parts)
    show = None
    if scene.projector:
        from rig.projector import open_projector

        window, screen = scene.projector, fit_plate(scene.projector.size, scene.plate.size)
        show = open_parts.enter_context(open_projector(screen, window.display, window.full_screen))
    for snapshot in islice(loop, int(PATIENCE * count * scene.camera.rate)):
        if collector.see(snapshot.touches, snapshot.captured):
            console().print(f"{len(collector.taken)} of {count} presses are taken")
        if (target := collector.target) is None:
            return collector
        if show:
            show((Mark(target.x, target.y, target.force),))
    raise ValueError(
        f"{len(collector.taken)} of {count} presses were seen; look at them with `touchplate run`"
    )


def _write(path: Path, taken: Sequence[Taken]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(COLUMNS + SIGMAS)
        for one in taken:
            press = (one.press.x, one.press.y, one.press.force)
            rows.writerow((*press, *one.found.tolist(), *one.sigma.tolist(), one.frames))
