"""Every Python that the project allows and this machine has: install, demo, tests of the libraries.

Parts: python311, python312, python313, python314. Each takes the oldest interpreter of its version
that is on the PATH, in /usr/bin or among those of pyenv, and a fresh clone of this repository:
`make install`, 30 frames of the demo without page, the tests of dic, fe and models that `make test`
runs. Where torch has no build without GPU libraries, the install leaves it out: tests, and files of
tests, that are skipped for want of it are counted apart. A version without an interpreter stands as
not measured.
"""

import os
import re
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
}
"""What must end without an error, one after the other."""

TESTS = [
    ".venv/bin/python", "-m", "pytest", "-q", "-m", "not slow", "--numprocesses", "2", "-rs",
    "tests/dic", "tests/fe", "tests/models",
]  # fmt: skip


def passes(minor: int) -> Iterator[Figure]:
    """Install a clone for one Python and use it."""
    found = interpreters(minor)
    if not found:
        bar = at_most(0)
        yield from line(
            TABLE,
            f"Python 3.{minor}",
            steps_that_fail=(None, "", bar),
            tests_that_fail=(None, "", bar),
        )
        return
    version, python = min(found)
    with tempfile.TemporaryDirectory(prefix="touchplate-python-") as name:
        home = Path(name) / "touchplate"
        subprocess.run(["git", "clone", "--quiet", ROOT, home], check=True)
        case = f"Python 3.{minor}"
        yield from line(TABLE, case, interpreter=".".join(map(str, version)))
        yield from _used(case, python, home)


def _used(case: str, python: Path, home: Path) -> Iterator[Figure]:
    """Go through the steps in a clone, then its tests."""
    own = os.environ | {"TOUCHPLATE_CACHE": str(home / "cache"), "COLUMNS": "300"}
    for unwanted in ("PYTHONPATH", "VIRTUAL_ENV", "NUMBA_CACHE_DIR"):
        own.pop(unwanted, None)
    failed = 0
    for words in STEPS.values():
        command = [word.format(python=python) for word in words]
        failed += bool(subprocess.run(command, cwd=home, env=own, check=False).returncode)
    yield from line(TABLE, case, steps_that_fail=(failed, "", at_most(0), len(STEPS)))
    if not (home / TESTS[0]).is_file():
        yield from line(TABLE, case, tests_that_fail=(None, "", at_most(0)))
        return
    tested = subprocess.run(TESTS, cwd=home, env=own, capture_output=True, text=True, check=False)
    yield from _counted(case, tested.stdout)


def _counted(case: str, said: str) -> Iterator[Figure]:
    """Count the tests that failed, and what was skipped for want of torch."""
    ended = (said.splitlines() or [""])[-1]
    counts = [int(number) for number in re.findall(r"(\d+) (?:passed|failed|error)", ended)]
    failed = sum(int(number) for number in re.findall(r"(\d+) (?:failed|error)", ended))
    skipped = re.findall(r"^SKIPPED \[(\d+)\] .*torch", said, re.MULTILINE)
    bar = at_most(0)
    yield from line(
        TABLE,
        case,
        tests_that_fail=(failed if counts else None, "", bar, sum(counts)),
        skipped_for_want_of_torch=sum(map(int, skipped)),
    )


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


PARTS = {f"python3{minor}": partial(passes, minor) for minor in MINORS}

if __name__ == "__main__":
    run(PARTS, __doc__)
