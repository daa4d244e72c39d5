"""Every row of the report's table of stiff and extreme cases, held to what must be right of it."""

import subprocess
import sys

import pytest

from rig.report.figure import read
from rig.studies.stiff.case import RIGHT

ROWS = {"plates": 30, "shells": 18, "rendering": 5, "correlation": 18, "estimation": 25, "loop": 20}


@pytest.mark.slow
@pytest.mark.parametrize("part", ROWS)
def test_each_case_is_right_or_says_so(part, tmp_path):
    figures = tmp_path / "figures.csv"
    command = [sys.executable, "-m", "rig.studies.stiff.table", part, "--figures", str(figures)]
    subprocess.run(command, check=True, capture_output=True)
    rows = [figure for figure in read(figures) if figure.quantity == RIGHT]
    assert len(rows) >= ROWS[part]
    assert [f"{row.case}: {row.text}" for row in rows if row.verdict != "met"] == []
