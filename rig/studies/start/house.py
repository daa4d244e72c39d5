"""The order of the code itself: rooms, names, types, and the bugs that its tests notice.

Parts: rooms (folders and imports), words (tests of names and vocabulary), types (strict pyright
outside of compiled kernels), quick (`touchplate report --quick` of a wheel in an empty folder),
bugs (`benchmarks/mutants.py`, an hour on one core). All but the last take minutes.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rig.report.figure import Bar, Figure, at_least, at_most
from rig.studies.study import line, run

ROOT = Path(__file__).parents[3]
PACKAGES = ("dic", "fe", "models", "rig", "synthetic")
NONE = at_most(0.0)
TESTS = {
    "imports across packages of names that are not public": (
        "tests/test_layout.py::test_a_package_takes_from_others_what_they_offer"
    ),
    "retired words in code, documents, page and report": "tests/test_vocabulary.py",
    "bars that are words": "tests/rig/report/test_report.py::test_a_bar_asks_for_a_number",
}
"""Tests, each of a package or a file, that fail where one is left."""


def rooms() -> Iterator[Figure]:
    """Count rooms, and circles among the folders that import one another."""
    yield from row("circles of folders", circles(imports()), "", NONE)
    for package, most in (("models", 10), ("rig", 20)):
        inside = [path for path in (ROOT / package).iterdir() if (path / "__init__.py").exists()]
        yield from row(f"rooms on top of {package}", len(inside), "", at_most(most))


def words() -> Iterator[Figure]:
    """Count the tests of names that fail."""
    for case, test in TESTS.items():
        yield from row(case, failures(test), "", NONE)


def types() -> Iterator[Figure]:
    """Count what strict pyright finds."""
    done = program("-m", "pyright", home=ROOT)
    found = re.search(r"(\d+) errors?", done.stdout)
    count = int(found.group(1)) if found else None
    yield from row("errors of strict types outside of kernels", count, "", NONE)


def quick() -> Iterator[Figure]:
    """Report from a wheel that stands alone."""
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        (place / "empty").mkdir()
        install = ("-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation")
        program(*install, "--target", str(place / "wheel"), str(ROOT), home=place)
        began = time.perf_counter()
        call = "from rig.cli import main; main()"
        report = ("-c", call, "report", "--quick", "--json")
        done = program(*report, home=place / "empty", path=place / "wheel")
        took = time.perf_counter() - began
        states = json.loads(done.stdout.splitlines()[-1])["studies"].values()
        case = "report --quick from a wheel in an empty folder"
        failed = sum(state != "done" for state in states)
        yield from line("The house", case, time=(took, "s", at_most(120.0)))
        yield from line("The house", case, failed_studies=(failed, "", NONE))


def bugs() -> Iterator[Figure]:
    """Put bugs in one at a time and count those that tests notice."""
    done = program("benchmarks/mutants.py", home=ROOT)
    noticed, tried = map(int, re.findall(r"(\d+) of (\d+) noticed", done.stdout)[0])
    cell = (100.0 * noticed / tried, "%", at_least(95.0), tried)
    yield from line("The house", "realistic bugs that the quick tests notice", found=cell)


def row(case: str, value: float | None, unit: str, bar: Bar) -> Iterator[Figure]:
    """Make the one figure of a line."""
    yield from line("The house", case, found=(value, unit, bar))


def imports() -> set[tuple[str, str]]:
    """Pairs of folders of which one imports of the other; those of types alone left out."""
    import grimp

    graph = grimp.build_graph(*PACKAGES, exclude_type_checking_imports=True)
    pairs = (
        (folder(one), folder(other))
        for one in graph.modules
        for other in graph.find_modules_directly_imported_by(one)
    )
    return {(a, b) for a, b in pairs if not within(a, b) and not within(b, a)}


def folder(module: str) -> str:
    """Folder of a module, with dots."""
    place = ROOT.joinpath(*module.split("."))
    return module if place.is_dir() else module.rpartition(".")[0]


def within(inner: str, outer: str) -> bool:
    """Whether a folder is another or lies in it."""
    return f"{inner}.".startswith(f"{outer}.")


def circles(pairs: Iterable[tuple[str, str]]) -> int:
    """Count the groups of folders that reach one another."""
    edges = list(pairs)
    names = sorted({name for edge in edges for name in edge})
    index = {name: number for number, name in enumerate(names)}
    a, b = np.array([(index[one], index[other]) for one, other in edges]).T
    graph = coo_array((np.ones(len(a)), (a, b)), shape=(len(names), len(names)))
    _, groups = connected_components(graph, directed=True, connection="strong")
    return int(np.sum(np.bincount(groups) > 1))


def failures(test: str) -> int:
    """Count the tests that fail, those that are expected to among them."""
    done = program("-m", "pytest", "-q", "-p", "no:cacheprovider", test, home=ROOT)
    if done.returncode not in (0, 1):
        raise SystemExit(f"{test} did not run: {done.stdout[-300:]}")
    return sum(map(int, re.findall(r"(\d+) x?failed", done.stdout)))


def program(*words: str, home: Path, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run Python with some words in a folder, packages from a path first."""
    environment = os.environ | ({"PYTHONPATH": str(path)} if path else {})
    return subprocess.run(
        (sys.executable, *words),
        cwd=home, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


PARTS = {"rooms": rooms, "words": words, "types": types, "quick": quick, "bugs": bugs}

if __name__ == "__main__":
    run(PARTS, __doc__)
