"""Put bugs in one at a time and see whether the quick tests of their room notice.

Each entry of `mutants/*.toml` is a realistic slip in one line: a sign, a factor, a swap, half a
pixel, a dropped σ. The tree is copied, the line changed, and the tests that the entry names are run
as `make test` runs them, without slow ones. A bug that no test notices is printed by name.

    python benchmarks/mutants.py [--only TEXT] [--out results/mutants.csv]

What an earlier run found of the same code and tests is not run again.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
TREE = ("dic", "fe", "models", "rig", "synthetic", "tests", "examples", "benchmarks", "docs")
FILES = ("pyproject.toml", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "mkdocs.yml", "Makefile")
BAR = 0.95  # of all bugs
LONGEST = 900  # s that the tests of one bug may take; one that hangs them is noticed


@dataclass(frozen=True)
class Mutant:
    """One line of the code and what a slip makes of it.

    Attributes
    ----------
    room : str
        Package and folder, such as `models/inverse`.
    file : str
        Path from the root of the tree.
    old, new : str
        Text that stands in the file once, and what is put in its place.
    kind : str
        Sign, factor, swap, ...
    tests : tuple of str
        Test files that are run.
    """

    room: str
    file: str
    old: str
    new: str
    kind: str
    tests: tuple[str, ...]

    def state(self) -> str:
        """Return a digest of the bug and of what its verdict follows from."""
        package = sorted((ROOT / self.file.split("/")[0]).rglob("*.py"))
        paths = [*package, *(ROOT / test for test in self.tests)]
        digest = hashlib.sha256(repr(self).encode())
        for path in paths:
            digest.update(path.read_bytes())
        return digest.hexdigest()[:16]


def read(folder: Path) -> list[Mutant]:
    """Read all entries.

    Raises
    ------
    ValueError
        If the text of an entry does not stand in its file once.
    """
    found = []
    for path in sorted(folder.glob("*.toml")):
        for entry in tomllib.loads(path.read_text(encoding="utf-8"))["mutant"]:
            mutant = Mutant(**entry | {"tests": tuple(entry["tests"])})
            times = (ROOT / mutant.file).read_text(encoding="utf-8").count(mutant.old)
            if times != 1:
                raise ValueError(
                    f"{path.name}: {mutant.old!r} stands {times} times in {mutant.file}; give text"
                    " that stands there once"
                )
            found.append(mutant)
    return found


def is_noticed(mutant: Mutant) -> bool:
    """Run the tests of a bug in a copy of the tree; True if one of them fails."""
    with tempfile.TemporaryDirectory() as place:
        tree = Path(place)
        for name in TREE:
            shutil.copytree(ROOT / name, tree / name)  # with times, so that kernels stay cached
        for name in FILES:
            shutil.copy2(ROOT / name, tree)
        changed = tree / mutant.file
        text = changed.read_text(encoding="utf-8")
        changed.write_text(text.replace(mutant.old, mutant.new), encoding="utf-8")
        if "njit" in text:  # kernels in other files hold a compiled copy of what they call
            for cached in tree.rglob("*.nbi"):
                cached.unlink()
        command = (sys.executable, "-m", "pytest", "-q", "-x", "-m", "not slow", *mutant.tests)
        environment = os.environ | {"PYTHONPATH": str(tree)}
        try:
            done = subprocess.run(
                command, cwd=tree, env=environment, capture_output=True, timeout=LONGEST
            )
        except subprocess.TimeoutExpired:
            return True
    if done.returncode not in (0, 1):
        raise RuntimeError(f"tests of {mutant.file} did not run: {done.stdout[-2000:].decode()}")
    return done.returncode == 1


def known(path: Path) -> dict[str, bool]:
    """Return the verdicts of an earlier run by the digests of their bugs."""
    if not path.exists():
        return {}
    with path.open(encoding="utf-8", newline="") as file:
        return {row["state"]: row["noticed"] == "yes" for row in csv.DictReader(file)}


def main() -> None:
    """Run what has no verdict yet; print the bugs that no test noticed, and the fraction."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="", help="run entries whose file or room holds this text")
    parser.add_argument("--out", type=Path, default=ROOT / "results" / "mutants.csv")
    given = parser.parse_args()
    mutants = [m for m in read(Path(__file__).parent / "mutants") if given.only in m.room + m.file]
    given.out.parent.mkdir(parents=True, exist_ok=True)
    verdicts = known(given.out)
    states = [mutant.state() for mutant in mutants]  # of now, whatever is changed meanwhile
    for number, (mutant, state) in enumerate(zip(mutants, states, strict=True), 1):
        if state not in verdicts:
            verdicts[state] = is_noticed(mutant)
            _append(given.out, mutant, state, verdicts[state])
        said = "noticed" if verdicts[state] else "NOT NOTICED"
        print(
            f"{number}/{len(mutants)} {mutant.file}: {mutant.new.strip()[:60]!r}: {said}",
            flush=True,
        )
    noticed = sum(verdicts[state] for state in states)
    print(f"{noticed} of {len(mutants)} noticed; bar {BAR:.0%}")
    sys.exit(noticed < BAR * len(mutants))


def _append(path: Path, mutant: Mutant, state: str, noticed: bool) -> None:
    fresh = not path.exists()
    with path.open("a", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        if fresh:
            writer.writerow(("state", "room", "file", "kind", "new", "noticed"))
        row = (state, mutant.room, mutant.file, mutant.kind, mutant.new, "yes" if noticed else "no")
        writer.writerow(row)


if __name__ == "__main__":
    main()
