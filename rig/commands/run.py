"""`touchplate run SCENE`: the live loop, with page and projector or without."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rig.commands.output import emit, progress, say, warn
from rig.system.once import says_once
from rig.system.process import interruptible

if TYPE_CHECKING:
    from rich.table import Table

    from rig.calibration.learned import Keeper, Known
    from rig.calibration.store import Calibration
    from rig.live.live_loop import LiveLoop
    from rig.live.snapshot import Snapshot
    from rig.projector.show import Show
    from rig.recording.control import Switch
    from rig.scene import Scene
    from rig.scene.alarms import AlarmsSection
    from rig.usb.link import BoardLink

SCREEN = (1280, 800)  # px, of a projector that is not there: the page shows what it would show
Sink = Callable[["Snapshot"], object]


def run(
    scene: Annotated[str, typer.Argument(help="Name of a shipped scene, or a TOML file.")],
    frames: Annotated[
        int | None, typer.Option(min=1, help="Stop after so many frames, else by Ctrl-C.")
    ] = None,
    headless: Annotated[bool, typer.Option(help="Neither page nor projector.")] = False,
    record: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Keep the session in a new file *.h5.")
    ] = None,
    touches: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write every touch to a new file *.csv.")
    ] = None,
    weight: Annotated[
        float | None,
        typer.Option(metavar="N", help="The first touch that is held is a known weight, N."),
    ] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override the scene.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Find touches in every frame; print the figures of the run at its end.

    Ctrl-C is the usual end of a run: exit code 0 and its figures; 130 and nothing before the first
    frame, when there are none; 1 if a recording ended before the run, as on a full disk.
    """
    import rig

    if touches:
        from rig.recording.paths import require_absent
        from rig.recording.touches_csv import TABLE

        require_absent(touches, TABLE)
    loaded = rig.load(scene, rig.scene.parse_overrides(settings or []))
    given = known(scene, loaded), frames, headless, record, as_json, touches
    live(loaded, *given, weight)


def known(name: str, scene: Scene) -> Known:
    """Read what is known of a scene's bench, and warn of what is wrong with it."""
    from rig.calibration.learned import known_now

    found = known_now(name, scene, datetime.now(UTC))
    for sentence in found.notes:
        warn(sentence)
    return found


def live(
    scene: Scene,
    known: Known,
    frames: int | None,
    headless: bool,
    record: Path | None,
    as_json: bool,
    touches: Path | None = None,
    weight: float | None = None,
) -> None:
    """Run the loop of a scene; the body of `run` and `record`.

    Where its source fails on the way, the figures of the frames before are given all the same.
    """
    loop, failure = None, None
    try:
        with ExitStack() as open_parts, interruptible():
            loop, sinks = start(scene, known.calibration, headless, record, open_parts)
            if weight is not None:
                loop.weigh(weight)
            if scene.alarms:
                from rig.live.alarms import says_new

                sinks.append(says_new(warn))
            sinks += _learning_sinks(loop, known.keeper, open_parts)
            if touches:
                from rig.recording.touches_csv import open_touches

                sinks.append(open_parts.enter_context(open_touches(touches)))
            _follow(loop, sinks, frames, scene.alarms)
    except KeyboardInterrupt:
        if loop is None or not loop.pace.frames:
            raise
        say("ended")
    except OSError as error:
        if loop is None or not loop.pace.frames:
            raise
        failure = error
    summary = loop.summary()
    emit(_table(summary), summary, as_json)
    if failure:
        raise failure
    recorded = summary["recorded"]
    if recorded and not recorded["complete"]:
        raise typer.Exit(1)


def start(
    scene: Scene,
    calibration: Calibration,
    headless: bool,
    record: Path | None,
    open_parts: ExitStack,
) -> tuple[LiveLoop, list[Sink]]:
    """Open everything that the scene names; what can fail at once comes before what is slow."""
    switch = None
    by_foot = scene.board.foot_switch if scene.board else None
    if record or (scene.page and not headless) or by_foot == "record":
        from rig.recording.control import open_switch

        switch = open_parts.enter_context(open_switch(record, scene, calibration))
    opened: list[LiveLoop] = []

    def tare() -> None:
        for loop in opened:
            loop.tare()

    def weigh(force: float) -> None:
        for loop in opened:
            loop.weigh(force)

    wishes = tare, weigh
    show, panels, outputs = _open_sinks(scene, calibration, headless, switch, open_parts, wishes)
    from rig.sources.open_loop import open_loop

    def preview(snapshot: Snapshot) -> None:
        for panel in panels:
            panel(snapshot)

    parts = scene, calibration, say, progress, preview, switch, show
    links: list[BoardLink] = []
    opened.append(open_parts.enter_context(open_loop(*parts, use_board=links.append)))
    if switch:
        outputs = [*outputs, *recording_sinks(switch)]
    if links:
        outputs = [*outputs, *_board_sinks(scene, links[0], show, tare, switch, open_parts)]
    return opened[0], [*panels, *outputs]


def recording_sinks(switch: Switch) -> list[Sink]:
    """Say where each recording lies that is begun, and why one has ended by itself."""
    return [says_once(lambda: switch.where, say), says_once(lambda: switch.failure, warn)]


def _board_sinks(
    scene: Scene,
    link: BoardLink,
    show: Show | None,
    tare: Callable[[], object],
    switch: Switch | None,
    open_parts: ExitStack,
) -> list[Sink]:
    """Have the board follow the touches and act; a tare by foot sets a demo back as key T does."""
    from rig.sources.board_sink import open_board_sink

    def renew(snapshot: Snapshot) -> None:
        if not (show and show.tare(snapshot)):
            tare()

    board = open_board_sink(scene, link, renew, switch, say, open_parts)
    return [board, says_once(lambda: board.trouble, warn)]


def _learning_sinks(loop: LiveLoop, keeper: Keeper | None, open_parts: ExitStack) -> list[Sink]:
    """Take what is typed while the loop runs, and keep what it learns, to its end."""
    from rig.commands.typed import typed

    sinks: list[Sink] = []
    if take := typed(loop, warn):
        say("type 'w 2' and Enter to lay a known weight of 2 N, 't' to renew the reference")
        sinks.append(take)
    if keeper and loop.learned is not None:
        open_parts.callback(_kept, keeper, loop)
        sinks.append(lambda snapshot: keeper.follow(loop, snapshot.captured))
    return sinks


def _kept(keeper: Keeper, loop: LiveLoop) -> None:
    """Keep what was learned at the end; a disk that is full must not hide the run's figures."""
    try:
        keeper.write(loop)
    except OSError as error:
        warn(f"what was learned of the bench is not kept ({error.strerror or error})")


def _open_sinks(
    scene: Scene,
    calibration: Calibration,
    headless: bool,
    switch: Switch | None,
    open_parts: ExitStack,
    wishes: tuple[Callable[[], object], Callable[[float], object]],
) -> tuple[Show | None, list[Sink], list[Sink]]:
    """Projector, panels and outputs; the latter take only what was estimated."""
    if not scene.plate or (headless and not scene.outputs):
        return None, [], []
    from rig.projector.markers import fit_plate

    size = scene.projector.size if scene.projector else SCREEN
    screen = calibration.screen() or fit_plate(size, scene.plate.size)
    show, panels, outputs = None, [], []
    if not headless:
        from rig.commands.page_panels import open_panels

        notes = tuple(calibration.warnings(scene, datetime.now(UTC)))
        show, panels = open_panels(scene, calibration, notes, screen, switch, open_parts, wishes)
    if scene.outputs:
        from rig.out.open import open_outputs

        max_touches = scene.touches.max_touches if scene.touches else 1
        keys = scene.projector is not None and scene.projector.content == "keys"
        outputs = open_outputs(
            scene.outputs, scene.plate.size, screen, max_touches, open_parts, keys
        )
        for url in filter(None, (getattr(sink, "url", "") for sink in outputs)):
            say(f"touches: {url}")
    return show, panels, outputs


def _follow(
    loop: LiveLoop, sinks: list[Sink], frames: int | None, bounds: AlarmsSection | None
) -> None:
    from rig.live.alarms import watched

    said, notice = None, ""
    for snapshot in watched(loop, bounds):
        if sinks:
            with loop.watch.stage("show"):
                for sink in sinks:
                    sink(snapshot)
        if snapshot.notice != notice:
            notice = snapshot.notice
            if notice:
                say(notice)
        if not snapshot.fresh and snapshot.status != said:
            said = snapshot.status
            warn(said)
        if snapshot.fresh:
            said = None
        if frames and loop.pace.frames >= frames:
            return


def _table(summary: dict[str, Any]) -> Table:
    from rich.table import Table

    table = Table("figure", "value", title=f"{summary['frames']} frames")
    table.add_row("frames a second", _text(summary["fps"]))
    table.add_row("dropped frames", str(summary["dropped"]))
    latency = summary["latency_ms"]
    table.add_row("capture to touches", f"{latency['median']:.1f} ms, p95 {latency['p95']:.1f} ms")
    if recorded := summary["recorded"]:
        table.add_row("recorded frames", f"{recorded['frames']}, {recorded['dropped']} left out")
        table.add_row("recording", recorded["status"])
    if learned := summary["learned"]:
        table.add_row("bench", learned["sentence"])
    if summary["diagnosis"]:
        table.add_row("diagnosis", summary["diagnosis"])
    for row in _base_rows(summary.get("base")):
        table.add_row(*row)
    for way in ("pattern", "strain", "net"):
        if scores := summary[way]:
            for name, value in scores.items():
                table.add_row(f"{way}: {name.replace('_', ' ')}", _text(value))
    return table


def _base_rows(base: dict[str, Any] | None) -> Iterator[tuple[str, str]]:
    """Give the rows of a base that bends and twists, as the last frame shows it."""
    last: dict[str, Any] | None = base["last"] if base else None
    if last is None:
        return
    yield "bend", f"{last['bend']:.4g} mm ± {_text(last['sigma_bend'])}"
    yield "twist", f"{last['twist']:.4g} deg ± {_text(last['sigma_twist'])}"
    for shape in last["shapes"]:
        shown = ", shown" if shape["shown"] else ""
        yield "stable shape", f"{shape['name']}: {shape['energy']:.5g} N mm{shown}"


def _text(value: float | None) -> str:
    return "–" if value is None else f"{value:.4g}"
