"""What commands put out: text and progress on stderr, results on stdout, files in folders."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console, RenderableType

Report = Callable[..., None]
"""Called as ``report(done, total)`` or ``report(done, total, note)``."""


@cache
def console() -> Console:
    """Return the console of the running text, on stderr."""
    return _plain(stderr=True)


def _plain(stderr: bool) -> Console:
    """Return a console that writes text as it is: names of [sections] are no markup."""
    from rich.console import Console

    return Console(stderr=stderr, markup=False, emoji=False)


def say(sentence: str) -> None:
    """Write a sentence for the user."""
    console().print(sentence, highlight=False)


def warn(sentence: str) -> None:
    """Write a sentence that the user should not overlook."""
    console().print(sentence, style="yellow", highlight=False)


@contextmanager
def progress(title: str) -> Generator[Report]:
    """Give a function that draws a progress bar; the bar appears when it is first called.

    So a result that comes from the cache draws nothing.
    """
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}", markup=False),
        console=console(),
    )
    task = bar.add_task(title, total=1, note="")

    def report(done: int, total: int, note: str = "") -> None:
        bar.start()
        bar.update(task, completed=done, total=total, note=note)

    try:
        yield report
    finally:
        if bar.live.is_started:
            bar.stop()


def emit(renderable: RenderableType, data: Mapping[str, Any], as_json: bool) -> None:
    """Write a result on stdout: the renderable for people, or `data` as one JSON object.

    Raises
    ------
    ValueError
        If `data` holds a number that JSON does not have (NaN, infinity); write None for it.
    """
    if as_json:
        sys.stdout.write(json.dumps(data, allow_nan=False) + "\n")
    else:
        _plain(stderr=False).print(renderable)


def require_suffix(path: Path, what: str, suffix: str) -> None:
    """Refuse a file to write whose name says that it holds something else.

    Raises
    ------
    OSError
        If `path` is a folder.
    ValueError
        If it does not end in `suffix`.
    """
    if path.is_dir():
        raise IsADirectoryError(f"{what} {path} is a folder; give the name of a file in it")
    if path.suffix != suffix:
        raise ValueError(f"{what} must be a file *{suffix}, got '{path}'; name it so")


def require_folder_of(path: Path, what: str, suffix: str) -> None:
    """Refuse a file to write that ends otherwise than in `suffix`, or whose folder is not there.

    Raises
    ------
    OSError
    """
    if path.suffix != suffix or not path.absolute().parent.is_dir():
        raise OSError(
            f"{what} '{path}' must be a *{suffix} in a folder that exists; name such a one"
        )


def require_free(folder: Path, force: bool) -> None:
    """Refuse a folder that holds something, unless files in it may be replaced.

    Raises
    ------
    OSError
        If `folder` is a file, or holds anything and `force` is not set.
    """
    if folder.exists() and not folder.is_dir():
        raise OSError(f"'{folder}' is a file; name a folder")
    if folder.is_dir() and any(folder.iterdir()) and not force:
        raise OSError(f"folder '{folder}' is not empty; pass --force to replace files in it")


@contextmanager
def folder_aside(folder: Path) -> Generator[Path]:
    """Give a folder to write into; what it holds in the end is moved to `folder`, or nothing is."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as aside:
        yield Path(aside)
        folder.mkdir(exist_ok=True)
        for path in sorted(Path(aside).iterdir()):
            path.replace(folder / path.name)
