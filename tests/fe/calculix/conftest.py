"""CalculiX run for real, in a folder of the test."""

import pytest

from rig.studies.plates import ccx


@pytest.fixture(scope="session")
def calculix(tmp_path_factory):
    """Solve a plate with CalculiX: fields (one of each load, a sequence of touches)."""
    if ccx.program() is None:
        pytest.skip("CalculiX is not installed; run `make system-deps`")

    def solve(plate, counts, loads, **options):
        return ccx.solve(tmp_path_factory.mktemp("calculix"), plate, counts, loads, **options)

    return solve
