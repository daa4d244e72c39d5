"""`touchplate replay FILE`: find the touches of a recording again."""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import emit, progress, say, warn

if TYPE_CHECKING:
    from rig.recording.session import Session


def replay(
    recording: Annotated[
        Path, typer.Argument(help="File of a recorded session, or with --page its folder.")
    ],
    page: Annotated[
        bool, typer.Option("--page", help="Show it on the page, to play, pause and seek.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find the touches of a recording again and compare them with those found then.

    The exit code is 1 if any frame has other touches, as that of `diff`.
    """
    from rig.recording.session import open_session

    if page:
        _show(recording)
        return
    with open_session(recording) as session:
        if session.cut:
            warn(session.cut)
        said = _replay(session)
    lines = [f"{said['frames']} frames, {said['different']} with other touches than then"]
    truth = said["net"] or said["pattern"]
    if truth["scored"]:
        lines.append(
            f"against the truth: median {truth['position_median_mm']:.3g} mm and"
            f" {truth['force_median_n']:.3g} N, {truth['misses']} missed,"
            f" {truth['false_touches']} false"
        )
    emit("\n".join(lines), said, as_json)
    if said["different"]:
        raise typer.Exit(1)


def _show(recording: Path) -> None:
    """Play recordings on the page until Ctrl-C."""
    from rig.commands.page_panels import open_page
    from rig.page.player import PagePlayer, newest
    from rig.scene.loop import Page
    from rig.system.process import interruptible

    path = newest(recording) if recording.is_dir() else recording
    with (
        suppress(KeyboardInterrupt),
        open_page(Page.model_validate({"port": 0}), None) as publisher,
    ):
        say(f"page: {publisher.url}   (Ctrl-C ends)")
        with interruptible():
            PagePlayer(publisher).play(path)


def _replay(session: Session) -> dict[str, Any]:
    from rig.calibration.store import parse
    from rig.live.bench import build_bench
    from rig.live.run_score import RunScore
    from rig.recording.replay import replay as play
    from rig.system.timing import Stopwatch

    with progress("plate modes") as report:
        bench = build_bench(session.scene, report, parse(session.calibration, "in the recording"))
    watch, different = Stopwatch(time.perf_counter), 0
    pattern, net = RunScore(bench.min_force), RunScore(bench.min_force)
    for one in play(session, bench, watch):
        different += not one.same
        estimate, whole = one.frame_estimate.estimate, one.frame_estimate.from_pattern
        if one.frame.truth is not None:
            pattern.add(whole or estimate, one.frame.truth)
            net.add(estimate, one.frame.truth)
    return {
        "frames": session.frames,
        "different": different,
        "stages_ms": {name: {"median": mid, "p95": slow} for name, mid, slow in watch.table()},
        "pattern": pattern.summary(),
        "net": net.summary() if bench.net else None,
    }
