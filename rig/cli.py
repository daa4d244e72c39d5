"""The command `touchplate`: imports the command that is asked for and no other.

What a user can correct, a ValueError or an OSError, ends in one sentence on stderr and exit code 2;
anything else is a fault of this program and shows where it happened.
"""

import errno
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from io import TextIOWrapper
from typing import Annotated, Any, NoReturn, TextIO

import typer

COMMANDS = {
    "setup": "Set a bench up, from nothing to calibrated: on a page, step by step.",
    "new": "Write the scene of a bench from what is known of it.",
    "show": "Say what a scene contains, what it leaves out and why.",
    "design": "Say what a bench will reach, before anything is bought.",
    "print": "Print the board of a calibration or a speckle pattern, at true scale.",
    "correlate": "Correlate a pair or a whole test: displacement, strain and their uncertainty.",
    "view": "Show a whole test on a page, or correlate images there.",
    "profile": "Read lines, extensometers and gauges from the result of a whole test.",
    "run": "Run the live loop of a scene.",
    "record": "Run the live loop and keep all that it sees and says.",
    "replay": "Find the touches of a recording again.",
    "export": "Write a recording or a whole test as tables, arrays, surfaces, plots or a video.",
    "calibrate": "Calibrate camera, plate, projector, noise or latency, step by step.",
    "diagnose": "Name what of a bench is not as its scene says, from images of touches.",
    "collect": "Ask for known presses, and learn from them what the bench has wrong.",
    "outputs": "List the screens of the desktop, let them flash, and choose the projector.",
    "dataset": "Write a data set of simulated touches.",
    "train": "Train the net of a scene on simulated touches.",
    "tune": "Search over layers and sizes of the net of a scene.",
    "score": "Repeat the test of a trained net.",
    "report": "Error against run time, stiff and extreme cases: run the studies, write the page.",
    "doctor": "Say what this machine has for a bench, what it lacks, and the remedy.",
}
TRACEBACK = "--traceback"
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""One thread for BLAS: the solves are small, and its threads would fight the loop for the cores."""

REMEDIES = {
    errno.ENOENT: "; check the path",
    errno.EACCES: "; change its permissions, or name another place",
    errno.EROFS: "; name a place that can be written",
    errno.EISDIR: "; name a file in it",
    errno.ENOTDIR: "; name a folder",
    errno.ENOSPC: "; free some space, or name another place",
}
"""What a user can do about an error of the system."""


def main() -> None:
    """Run the command line of this process."""
    for variable in THREADS:
        os.environ.setdefault(variable, "1")
    for stream in (sys.stdout, sys.stderr):
        _replace_what_it_lacks(stream)
    warnings.showwarning = partial(_show_warning, warnings.showwarning)
    arguments = [argument for argument in sys.argv[1:] if argument != TRACEBACK]
    try:
        application(arguments)(arguments)
    except (ValueError, OSError) as error:
        if TRACEBACK in sys.argv or os.environ.get("TOUCHPLATE_TRACEBACK"):
            raise
        sys.stderr.write(f"touchplate: {sentence(error)}\n")
        sys.exit(2)


def application(arguments: Sequence[str]) -> typer.Typer:
    """Return the command line with the commands named in `arguments`; of others the help alone."""
    app = typer.Typer(
        callback=_options,
        help="A plain speckled plate feels touch.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
    )
    for name, text in COMMANDS.items():
        part = _part(name) if name in arguments else _not_asked
        if isinstance(part, typer.Typer):
            app.add_typer(part, name=name, help=text)
        else:
            app.command(name, help=text)(part)
    return app


def sentence(error: ValueError | OSError) -> str:
    """Return the text of an error as one line, with a remedy where the system said only what."""
    text = str(error)
    if isinstance(error, OSError) and error.strerror:
        named = f"'{error.filename}': " if error.filename else ""
        text = f"{named}{error.strerror}{REMEDIES.get(error.errno or 0, '')}"
    return " ".join(text.split()) or type(error).__name__


def _replace_what_it_lacks(stream: TextIO) -> None:
    """Let a stream write ? for a letter that its encoding lacks: cp1252 pipes have no ν."""
    if isinstance(stream, TextIOWrapper) and stream.errors == "strict":
        stream.reconfigure(errors="replace")


def _show_warning(usual: Callable[..., None], message: Warning | str, *about: Any) -> None:
    """Give a warning of ours to users, such as that of a renamed key, as one sentence."""
    if type(message).__module__.partition(".")[0] == "rig":
        sys.stderr.write(f"touchplate: {message}\n")
    else:
        usual(message, *about)


def _version(asked: bool) -> None:
    if asked:
        from rig.system.version import __version__

        typer.echo(f"touchplate {__version__}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Say the version.")
    ] = False,
    traceback: Annotated[  # taken out of the arguments by `main`; here for its help
        bool, typer.Option(TRACEBACK, help="Show where an error happened.")
    ] = False,
) -> None:
    pass


def _part(name: str) -> Callable[..., None] | typer.Typer:
    """Command, or group of commands, of a name."""
    return getattr(import_module(f"rig.commands.{name}"), name)


def _not_asked() -> NoReturn:
    raise RuntimeError("only a command that was asked for is run")
