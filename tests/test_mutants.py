"""The bugs of `benchmarks/mutants`: each can still be put in, and its tests are there."""

import runpy
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def mutants():
    """All bugs; reading refuses one whose text does not stand in its file once."""
    return runpy.run_path(str(ROOT / "benchmarks/mutants.py"))["read"](ROOT / "benchmarks/mutants")


def test_every_bug_changes_something_and_its_tests_are_there(mutants):
    for mutant in mutants:
        assert mutant.new != mutant.old
        assert mutant.tests
        for test in mutant.tests:
            assert (ROOT / test.split("::")[0]).exists(), f"{test} of {mutant.file}"


def test_the_bugs_lie_in_all_packages(mutants):
    rooms = Counter(mutant.room.split("/")[0] for mutant in mutants)
    assert rooms.keys() == {"dic", "fe", "models", "rig", "synthetic"}
    assert len(mutants) >= 100
