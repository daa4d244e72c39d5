"""The page of the paper's figures says what the studies do."""

from pathlib import Path

import pytest

from rig.scene import load, parse_overrides
from rig.studies.paper.drawn.contents import ROWS, lacking

PAGE = Path(__file__).parents[3] / "docs/paper/figures.md"


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.name} {row.what}")
def test_every_row_stands_on_the_page_and_its_command_loads(row):
    text = PAGE.read_text(encoding="utf-8")
    line = f"| {row.name} | {row.what} | `{row.command}` | [{row.drawing}]"
    assert line in text
    settings = row.settings.replace("--set ", "").split()
    assert load(row.scene, parse_overrides(settings)).title


def test_what_a_row_lacks_is_named(tmp_path):
    row = ROWS[1]
    assert lacking(row, tmp_path) == ["figure"]
    (tmp_path / row.drawing).write_bytes(b"")
    assert lacking(row, tmp_path) == []
    assert lacking(row._replace(seeds=4), tmp_path) == ["spread"]
    long = row._replace(scene="paper-deformable")
    assert lacking(long._replace(seeds=3), tmp_path) == []
    assert lacking(long._replace(seeds=2), tmp_path) == ["spread"]
    assert lacking(row._replace(scene="nowhere"), tmp_path) == ["command"]
