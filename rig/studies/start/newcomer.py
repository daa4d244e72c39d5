"""What a newcomer does with the tutorials alone, timed: install, then each of their commands.

Parts: steps. A fresh clone of this repository, a virtual environment of its own, caches that are
empty; commands and scenes are those that stand in the tutorials, photographs those of their
example. Wall times; pip may have wheels in its own cache.
"""

import os
import re
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from rig.report.figure import Figure
from rig.studies.study import line, run

ROOT = Path(__file__).parents[3]
TUTORIALS = ("docs/tutorials/photographs.md", "docs/tutorials/plate.md")
TABLE = "A newcomer, with the README alone"
AGAIN = {"correlate": ["--force"]}
"""What a command asks for before it replaces what it wrote."""


def steps() -> Iterator[Figure]:
    """Clone, install, and run the commands of the tutorials twice."""
    with tempfile.TemporaryDirectory() as name:
        home = Path(name) / "touchplate"
        subprocess.run(["git", "clone", "--quiet", ROOT, home], check=True)
        place_files(home)
        caches = os.environ | {"TOUCHPLATE_CACHE": str(home / "cache")}
        took = seconds(["make", "install"], home, caches)
        yield from line(TABLE, "make install", first_time=(took, "s"))
        for command in commands(home):
            words = [str(home / ".venv/bin/touchplate"), *shlex.split(command)[1:]]
            first = seconds(words, home, caches)
            again = seconds(words + AGAIN.get(words[1], []), home, caches)
            name = command.removeprefix(".venv/bin/")
            yield from line(TABLE, name, first_time=(first, "s"), again=(again, "s"))


def tutorials(home: Path) -> str:
    """Return what both say."""
    return "\n".join((home / page).read_text(encoding="utf-8") for page in TUTORIALS)


def place_files(home: Path) -> None:
    """Write the scenes of the tutorials, and a pair of photographs."""
    found = re.findall(r"```toml\n# (\S+\.toml)\n(.*?)```", tutorials(home), re.DOTALL)
    for name, scene in found:
        (home / name).write_text(scene, encoding="utf-8")
    example = home / "examples/10_photographs.py"
    subprocess.run([sys.executable, example, home], check=True, stdout=subprocess.DEVNULL)


def commands(home: Path) -> list[str]:
    """Return their commands, without what is said about them."""
    blocks = re.findall(r"```sh\n(.*?)```", tutorials(home), re.DOTALL)
    lines = [row.partition(" #")[0].strip() for block in blocks for row in block.splitlines()]
    return [row for row in lines if row.startswith(".venv/bin/touchplate")]


def seconds(words: list[str], home: Path, environment: dict[str, str]) -> float:
    """Wall time of a command that must end well."""
    began = time.perf_counter()
    ended = subprocess.run(
        words, cwd=home, env=environment, capture_output=True, text=True, check=False
    )
    if ended.returncode:
        raise SystemExit(f"{shlex.join(map(str, words))}: {ended.stderr[-300:]}")
    return time.perf_counter() - began


PARTS = {"steps": steps}

if __name__ == "__main__":
    run(PARTS, __doc__)
