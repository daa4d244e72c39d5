"""What a newcomer does with the README alone, timed: install, then each command of its five steps.

Parts: steps. A fresh clone of this repository, a virtual environment of its own, caches that are
empty; commands and scenes are those that stand in the README. Wall times; pip may have wheels in
its own cache.
"""

import os
import re
import shlex
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from PIL import Image

from rig.report.figure import Figure
from rig.studies.correlation.images import eight_bit, speckle
from rig.studies.study import line, run

ROOT = Path(__file__).parents[3]
PAIR = {"before.png": (0.0, 0.0), "after.png": (0.4, 0.2)}
TABLE = "A newcomer, with the README alone"
AGAIN = {"correlate": ["--force"]}
"""What a command asks for before it replaces what it wrote."""


def steps() -> Iterator[Figure]:
    """Clone, install, and run the commands of the five steps twice."""
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


def place_files(home: Path) -> None:
    """Write the scenes of the README, and a pair of photographs."""
    text = (home / "README.md").read_text(encoding="utf-8")
    for name, scene in re.findall(r"```toml\n# (\S+\.toml)\n(.*?)```", text, re.DOTALL):
        (home / name).write_text(scene, encoding="utf-8")
    for name, shift in PAIR.items():
        Image.fromarray(eight_bit(speckle(512, shift))).save(home / name)


def commands(home: Path) -> list[str]:
    """Return the commands of the five steps, without what is said about them."""
    text = (home / "README.md").read_text(encoding="utf-8")
    steps = text.split("## From nothing")[1].split("\n## ")[0]
    blocks = re.findall(r"```sh\n(.*?)```", steps, re.DOTALL)
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
