"""Every Python that the project allows and this machine has: install, demo, tests of the libraries.

Parts: python311, python312, python313, python314. Each takes the oldest interpreter of its version
that is on the PATH, in /usr/bin or among those of pyenv, and a fresh clone of this repository:
`make install`, 30 frames of the demo without page, the tests of dic, fe and models that `make test`
runs. A version without an interpreter stands as not measured.
"""

import os
import subprocess
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from rig.report.figure import Figure, at_most
from rig.studies.study import line, run

ROOT = Path(__file__).parents[3]
TABLE = "Every Python"
MINORS = (11, 12, 13, 14)
STEPS = {
    "install": ["make", "install", "PYTHON={python}"],
    "demo": [".venv/bin/touchplate", "run", "bench-real", "--headless", "--frames", "30"],
    "tests": [
        ".venv/bin/python", "-m", "pytest", "-q", "-m", "not slow", "--numprocesses", "2",
        "tests/dic", "tests/fe", "tests/models",
    ],
}  # fmt: skip
"""What must end without an error, one after the other."""


def passes(minor: int) -> Iterator[Figure]:
    """Install a clone for one Python and use it."""
    found = interpreters(minor)
    bar = at_most(0)
    if not found:
        yield from line(TABLE, f"Python 3.{minor}", steps_that_fail=(None, "", bar))
        return
    version, python = min(found)
    failed = list(_failing(python))
    case = f"Python {'.'.join(map(str, version))}"
    yield from line(TABLE, case, steps_that_fail=(len(failed), "", bar, len(STEPS)))
    if failed:
        yield from line(TABLE, case, what_fails=", ".join(failed))


def interpreters(minor: int) -> list[tuple[tuple[int, ...], Path]]:
    """Return version and path of each interpreter of a version that runs."""
    name = f"python3.{minor}"
    folders = [*map(Path, os.get_exec_path()), Path("/usr/bin")]
    folders += (Path.home() / ".pyenv/versions").glob(f"3.{minor}.*/bin")
    paths = (folder / name for folder in folders if (folder / name).is_file())
    return [(version, path) for path in paths if (version := _version(path))]


def _version(path: Path) -> tuple[int, ...] | None:
    """Return what an interpreter says that it is; None where it does not run."""
    asked = [path, "-c", "import platform; print(platform.python_version())"]
    said = subprocess.run(asked, capture_output=True, text=True, check=False)
    numbers = said.stdout.strip().split(".")
    return tuple(map(int, numbers)) if all(part.isdigit() for part in numbers) else None


def _failing(python: Path) -> Iterator[str]:
    """Give the steps that fail; without an install there are no others."""
    with tempfile.TemporaryDirectory(prefix="touchplate-python-") as name:
        home = Path(name) / "touchplate"
        subprocess.run(["git", "clone", "--quiet", ROOT, home], check=True)
        own = os.environ | {"TOUCHPLATE_CACHE": str(home / "cache")}
        for unwanted in ("PYTHONPATH", "VIRTUAL_ENV", "NUMBA_CACHE_DIR"):
            own.pop(unwanted, None)
        for step, words in STEPS.items():
            command = [word.format(python=python) for word in words]
            done = subprocess.run(command, cwd=home, env=own, check=False)
            if done.returncode:
                yield step
                if step == "install":
                    return


PARTS = {f"python3{minor}": partial(passes, minor) for minor in MINORS}

if __name__ == "__main__":
    run(PARTS, __doc__)
