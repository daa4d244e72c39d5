"""`touchplate dataset SCENE`: write the samples of a scene, or go on where a run was cut off."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from rig.commands.output import Report, console, emit, progress, require_suffix, warn
from rig.plates.cached import influence, reduced
from rig.scene import Scene, load, parse_overrides
from rig.scene.bench import RingSection
from rig.scene.dataset import DatasetSection
from rig.scene.plate import BaseSection, PlateSection
from rig.scene.theory import choose

if TYPE_CHECKING:
    import numpy as np
    from rich.table import Table

    from models import Simulator


def dataset(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or path of a TOML file.")],
    out: Annotated[
        Path | None, typer.Option(help="HDF5 file; results/SCENE/dataset.h5 by default.")
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", help="Replace a value: section.key=value.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler, tcp://host:8786; this process by default.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Write the samples of a scene to disk; a run that was cut off goes on where it ended."""
    import models
    from models import workers

    if out:
        require_suffix(out, "data set", ".h5")
    task = _task(load(scene, parse_overrides(settings or [])))
    plan = task.samples.build(task.plate)
    gauges = task.gauges.build(task.plate)
    path = out or Path("results") / Path(scene).stem / "dataset.h5"
    file = models.begin_dataset(path, plan, gauges, _about(task))
    if file.found:
        console().print(f"{file.found} of {plan.rows} samples are there already")
    with workers(scheduler, warn) as each:
        with progress("influence") as report:
            answer = _answer(task, gauges, report)
        began = time.monotonic()
        with progress("samples") as report:
            file.fill(answer, report, each)
        seconds = time.monotonic() - began
    data = models.read_dataset(path)
    figures = {
        "dataset": str(path),
        "samples": len(data),
        "touches": plan.touches,
        "gauges": len(gauges),
        "bytes": path.stat().st_size,
        "found": file.found,
        "seconds": seconds,
    }
    emit(_table(task.title, figures), figures, as_json)


@dataclass(frozen=True)
class BlockTask:
    """The sections of a scene that a data set is made from."""

    title: str
    plate: PlateSection
    base: BaseSection | None
    gauges: RingSection
    samples: DatasetSection
    radius: float
    theory: Literal["linear", "large"]


def _task(scene: Scene) -> BlockTask:
    """Return what a data set is made from; say which theory where that matters."""
    match scene:
        case Scene(
            plate=PlateSection() as plate,
            gauges=RingSection() as gauges,
            dataset=DatasetSection() as samples,
        ):
            pass
        case _:
            raise ValueError(
                f"scene '{scene.title}' has no data set; add [dataset] and [gauges], as"
                " paper-two-magnitudes has them"
            )
    radius = scene.touches.radius if scene.touches else 0.0
    if scene.base:
        _check_base(plate, scene.base, radius)
    theory = choose(scene, plate, samples.largest)
    if theory.against or (theory.name == "large" and not scene.base):
        console().print(theory.sentence)
    return BlockTask(scene.title, plate, scene.base, gauges, samples, radius, theory.name)


def _check_base(plate: PlateSection, base: BaseSection, radius: float) -> None:
    from fe import check_base

    check_base(plate.build(), base.build())
    if radius:
        raise ValueError(
            f"touches on a bent plate are points, got a radius of {radius:g} mm; set touches.radius"
            " to 0 or leave [base] out"
        )


def _answer(task: BlockTask, gauges: np.ndarray, report: Report) -> Simulator:
    """Return what gives the strains of touches; a flat plate's come from the cache if there."""
    import models

    plate = task.plate.build()
    if task.base is None and task.theory == "large":
        together = task.samples.touches * task.samples.largest
        return models.large_deflection(reduced(plate, together, report).gauges(gauges), task.radius)
    if task.base is None:
        flat = influence(plate, gauges, report)
        return models.superpose(partial(flat.strain, radius=task.radius))
    from fe import Shell, shell_influence, shell_mesh

    bent = Shell(plate, shell_mesh(plate)).at(task.base.build())
    console().print(f"bent by its base: {bent.stability.verdict.value}")
    return models.superpose(shell_influence(bent, gauges).strain, before=bent.strain(gauges))


def _about(task: BlockTask) -> dict[str, Any]:
    sections = {
        "plate": task.plate,
        "base": task.base,
        "gauges": task.gauges,
        "dataset": task.samples,
    }
    named = {name: part.model_dump(mode="json") for name, part in sections.items() if part}
    return named | {"touches": {"radius": task.radius}, "theory": task.theory}


def _table(title: str, figures: dict[str, Any]) -> Table:
    from rich.table import Table

    table = Table("figure", "value", title=title)
    table.add_row("file", figures["dataset"])
    table.add_row("samples", f"{figures['samples']} of {figures['touches']} touches")
    table.add_row("strains", f"exx, eyy, exy of {figures['gauges']} gauges")
    table.add_row("size", f"{figures['bytes'] / 1e6:.1f} MB")
    table.add_row("written in", f"{figures['seconds']:.2f} s")
    return table
