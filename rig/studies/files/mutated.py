"""Mutated files: 2000 of each kind that the program reads.

Parts: some, all. Files are read in a process of their own, so that one that ends the process or
hangs it is counted too, as a traceback. *Refused* is an error of one sentence that says what to do;
*healed or unharmed* is what is read as it was written, or with other numbers that a bench can have.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, TimeoutError as Late
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from rig.cli import sentence
from rig.report.figure import Figure, at_most
from rig.studies.files.kinds import KINDS
from rig.studies.study import line, run

SEED = 18
TABLE = "Mutated files"
BATCH, PATIENCE = 50, 300.0  # files a call of the process, s that it may take
OUTCOMES = ("refused", "healed or unharmed", "number out of range", "traceback")
LONGEST = 500  # characters of a sentence
NONE = at_most(0)


def outcome(kind: str, whole: bytes, number: int, folder: Path) -> tuple[str, str]:
    """Mutate a file, read it, and say how that ends: one of `OUTCOMES`, and with which words."""
    chosen = KINDS[kind]
    rng = np.random.default_rng((SEED, list(KINDS).index(kind), number))
    path = folder / f"mutated{chosen.suffix}"
    path.write_bytes(chosen.mutate(whole, rng))
    try:
        wrong = list(chosen.read(path))
    except (ValueError, OSError) as error:
        said = sentence(error)
        return ("refused" if len(said) < LONGEST and "; " in said else "traceback"), said
    except Exception as error:  # noqa: BLE001  (what is looked for)
        return "traceback", f"{type(error).__name__}: {error}"
    return ("number out of range", wrong[0]) if wrong else ("healed or unharmed", "")


def whole_file(kind: str, folder: Path) -> bytes:
    """Return the bytes of a file that nothing is wrong with."""
    path = folder / f"whole{KINDS[kind].suffix}"
    KINDS[kind].make(path)
    return path.read_bytes()


def outcomes(kind: str, numbers: range) -> list[tuple[str, str]]:
    """Say how files end, in this process."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        whole = whole_file(kind, folder)
        if wrong := list(KINDS[kind].read(folder / f"whole{KINDS[kind].suffix}")):
            raise ValueError(f"a whole {kind} is not read as it is: {wrong[0]}")
        return [outcome(kind, whole, number, folder) for number in numbers]


def guarded(kind: str, numbers: range) -> list[tuple[str, str]]:
    """Say how files end in another process; one that it does not survive is found by halves."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        try:
            return pool.submit(outcomes, kind, numbers).result(PATIENCE)
        except (BrokenProcessPool, Late) as error:
            for process in list(pool._processes.values()):  # pyright: ignore[reportPrivateUsage]
                process.kill()
            lost = type(error).__name__
    if len(numbers) == 1:
        return [("traceback", lost)]
    middle = len(numbers) // 2
    return guarded(kind, numbers[:middle]) + guarded(kind, numbers[middle:])


def mutated(count: int) -> Iterator[Figure]:
    """Read `count` files of each kind."""
    total: Counter[str] = Counter()
    for kind in KINDS:
        found: Counter[str] = Counter()
        for start in range(0, count, BATCH):
            numbers = range(start, min(start + BATCH, count))
            for number, (end, said) in zip(numbers, guarded(kind, numbers), strict=True):
                found[end] += 1
                if end in OUTCOMES[2:]:
                    print(f"  {kind} {number}: {end}: {said[:200]}", flush=True)
        total += found
        yield from row(kind, found)
    yield from row(f"{total.total()} files", total)


def row(case: str, found: Counter[str]) -> Iterator[Figure]:
    """Count how the files of a kind ended."""
    count = found.total()
    return line(
        TABLE,
        case,
        refused=found["refused"],
        healed_or_unharmed=found["healed or unharmed"],
        tracebacks=(found["traceback"], "", NONE, count),
        numbers_out_of_range_accepted=(found["number out of range"], "", NONE, count),
    )


PARTS = {"some": partial(mutated, 100), "all": partial(mutated, 2000)}

if __name__ == "__main__":
    run(PARTS, __doc__)
