"""`touchplate view RESULT`: a whole test on a page; or images, to be correlated there."""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from rig.commands.output import emit, say
from rig.commands.photographs import say_if_coloured


def view(
    what: Annotated[
        str,
        typer.Argument(
            metavar="WHAT",
            help="fields.h5 of a test, or images: a folder, 'frames/*.tif', a video.",
        ),
    ],
    frames: Annotated[
        str | None,
        typer.Option(metavar="IMAGES", help="Images of the test of a result, to show under it."),
    ] = None,
    regions: Annotated[
        Path | None,
        typer.Option(metavar="TOML", help="ROI, extensometers and gauges to begin with."),
    ] = None,
    interval: Annotated[
        float | None, typer.Option(help="Time from frame to frame, s, else they are counted.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Folder of a correlation, else results/test.")
    ] = None,
    port: Annotated[int, typer.Option(help="Port on 127.0.0.1; 0 takes a free one.")] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Show images, fields, σ, points, lines, extensometers and gauges of a test on a page."""
    from rig.series.regions import read_regions
    from rig.system.process import interruptible
    from rig.view import serve
    from rig.view.viewed import open_test
    from rig.web.access import access_of

    if interval is not None and not interval > 0:
        raise ValueError(f"interval must be positive, got {interval:g} s; give the time a frame")
    drawn = read_regions(regions) if regions else None
    with (
        suppress(KeyboardInterrupt),
        open_test(what, frames, out, drawn, interval) as test,
        serve(test, port, access_of("user", control=True)) as address,
    ):
        say_if_coloured(test.frames)
        if as_json:
            emit("", {"page": address, "out": str(test.out)}, as_json)
            sys.stdout.flush()  # whoever waits for the address has a pipe
        say(f"page: {address}   (Ctrl-C ends)")
        with interruptible():
            _wait()


def _wait() -> None:
    """Wait for Ctrl-C."""
    import threading

    never = threading.Event()
    while True:
        never.wait(3600)
