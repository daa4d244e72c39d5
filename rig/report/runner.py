"""Run a study in a process of its own and keep its outcome."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal

from rig.report.figure import Figure, read

State = Literal["done", "failed", "stopped", "left out"]
TAIL = 400  # characters of its last words


@dataclass(frozen=True)
class Outcome:
    """Outcome of a study.

    Attributes
    ----------
    key : str
        Of everything that it depends on; a study with the same key need not run again.
    state : {"done", "failed", "stopped", "left out"}
        "stopped" where it ran into its limit, "left out" where it needs what is not there.
    seconds, cpu : float, s
        Wall time and CPU time.
    words : str
        Its last words where it did not end well, or what it needs.
    date : str
        Day on which it ran, "2026-11-23"; empty where an older release kept it.
    """

    key: str
    state: State
    seconds: float
    cpu: float
    words: str = ""
    date: str = ""


@dataclass(frozen=True)
class Place:
    """The files of one study in the folder of a report."""

    folder: Path
    name: str

    @property
    def figures(self) -> Path:
        """Its figures, CSV."""
        return self.folder / f"{self.name}.csv"

    @property
    def outcome(self) -> Path:
        """Its outcome, JSON."""
        return self.folder / f"{self.name}.json"


def run(
    words: tuple[str, ...], place: Place, key: str, limit: float | None, now: datetime
) -> Outcome:
    """Run a program and keep figures and outcome at their place; `limit` is in s, None for none.

    `words` are what Python is called with: a file, or options and a module, and what follows.

    An interruption of this process ends the program, and leaves no outcome.
    """
    _clear(place)
    command = [sys.executable, *words, "--figures", str(place.figures.absolute())]
    began, before = time.monotonic(), _children()
    state: State = "done"
    try:
        ended = subprocess.run(
            command, capture_output=True, text=True, timeout=limit, env=_environment(), check=False
        )
        said = ended.stderr
        if ended.returncode:
            state, said = "failed", said or f"exit code {ended.returncode}"
    except subprocess.TimeoutExpired:
        state, said = "stopped", f"stopped after {limit:.0f} s"
    last = said.strip()[-TAIL:] if state != "done" else ""
    wall, cpu, date = time.monotonic() - began, _children() - before, f"{now:%Y-%m-%d}"
    return _keep(place, Outcome(key, state, wall, cpu, last, date))


def leave_out(place: Place, key: str, why: str) -> Outcome:
    """Keep that a study was left out, and why."""
    _clear(place)
    return _keep(place, Outcome(key, "left out", 0.0, 0.0, why))


def _clear(place: Place) -> None:
    place.folder.mkdir(parents=True, exist_ok=True)
    place.outcome.unlink(missing_ok=True)
    place.figures.unlink(missing_ok=True)


def _keep(place: Place, outcome: Outcome) -> Outcome:
    place.outcome.write_text(json.dumps(asdict(outcome), indent=1), encoding="utf-8")
    return outcome


def kept(place: Place, key: str) -> Outcome | None:
    """Return the outcome that is kept, where it is of the same key and ended well."""
    outcome = stored(place)
    return outcome if outcome and outcome.key == key and outcome.state == "done" else None


def stored(place: Place) -> Outcome | None:
    """Return the outcome that is kept, of whatever code and effort; None where there is none."""
    if not place.outcome.exists():
        return None
    return Outcome(**json.loads(place.outcome.read_text(encoding="utf-8")))


def figures(place: Place) -> tuple[Figure, ...]:
    """Return the figures of a study, as far as it came."""
    return tuple(read(place.figures))


def _environment() -> dict[str, str]:
    """One thread for BLAS, as in the loop, and the program's messages in one language."""
    return os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "LC_ALL": "C.UTF-8"}


def _children() -> float:
    used = os.times()
    return used.children_user + used.children_system
