"""A report of small studies: one that ends well, one that fails, one that takes too long."""

import json
import re
from datetime import datetime

import pytest
from typer.testing import CliRunner

from rig.cli import application
from rig.report import bars, plate_map
from rig.report.build import build
from rig.report.compare import changes
from rig.report.figure import Figure, judged, read, write
from rig.report.pareto import Trade, front, trades
from rig.report.study import read_contents, shipped
from rig.report.table import markdown

CONTENTS = """
[[section]]
title = "First section"
[[section.studies]]
name = "meshes"
title = "Meshes"
text = "Coarse against *fine*."
program = "good.py"
[[section.studies]]
name = "broken"
title = "Broken"
program = "bad.py"
[[section]]
title = "Second section"
[[section.studies]]
name = "endless"
title = "Endless"
program = "slow.py"
quick = ["--short"]
full = ["--long"]
limit = 1.0
"""
GOOD = """
import sys
from pathlib import Path
from rig.report.figure import Figure, write
home = Path(__file__).parent
home.joinpath("count").open("a").write("x")
found = [
    Figure("Mesh", name, what, value, unit)
    for name, time, error in (("coarse", "0.1", "1e-2"), ("fine (default)", "2", "1e-5"))
    for what, value, unit in (("time", time, "s"), ("error", error, ""))
]
write(Path(sys.argv[-1]), found)
"""
BAD = """
import sys
from pathlib import Path
from rig.report.figure import Figure, write
write(Path(sys.argv[-1]), [Figure("Before", "a", "width", "1", "mm", "≤ 2", "met")])
raise ValueError("the load is not finite")
"""
SLOW = "import sys, time\ntime.sleep(0 if '--short' in sys.argv else 60)\n"
NOW = datetime(2026, 1, 2, 3, 4)


@pytest.fixture
def home(tmp_path):
    folder = tmp_path / "studies"
    folder.mkdir()
    for name, text in {
        "report.toml": CONTENTS,
        "good.py": GOOD,
        "bad.py": BAD,
        "slow.py": SLOW,
    }.items():
        (folder / name).write_text(text)
    return folder


def built(home, out, effort="normal", names=()):
    return build(read_contents(home), effort, out, list(names), lambda *told: None, NOW)


def test_a_study_that_fails_or_takes_too_long_stands_in_the_report_with_its_words(home, tmp_path):
    out = tmp_path / "out"
    states = {result.study.name: result.outcome.state for result in built(home, out)}
    assert states == {"meshes": "done", "broken": "failed", "endless": "stopped"}
    text = (out / "report.md").read_text()
    assert "the load is not finite" in text
    assert "stopped after 1 s" in text
    assert "| a | 1 (≤ 2) |" in text, "the figures of a study that failed later are shown"


def test_the_report_names_date_machine_versions_and_scenes(home, tmp_path):
    built(home, tmp_path / "out", names=["meshes"])
    text = (tmp_path / "out/report.md").read_text()
    assert "2026-01-02" in text
    assert "numpy" in text
    assert re.search(r"twin `[0-9a-f]{12}`", text)


def test_the_html_page_needs_no_other_file(home, tmp_path):
    built(home, tmp_path / "out", names=["meshes"])
    page = (tmp_path / "out/report.html").read_text()
    assert 'src="data:image/png;base64,' in page
    assert "http" not in page.replace("http-equiv", "")
    assert "<table>" in page


def test_a_study_that_ended_well_is_not_run_again_until_the_code_changes(home, tmp_path):
    for _ in range(2):
        built(home, tmp_path / "out", names=["meshes"])
    assert (home / "count").read_text() == "x"
    (home / "good.py").write_text(GOOD + "\n# changed\n")
    built(home, tmp_path / "out", names=["meshes"])
    assert (home / "count").read_text() == "xx"


def test_the_words_of_the_effort_reach_the_study(home, tmp_path):
    (result,) = built(home, tmp_path / "out", "quick", ["endless"])
    assert result.outcome.state == "done"


def test_what_an_effort_leaves_out_is_named(home, tmp_path):
    contents = home / "report.toml"
    left_out = 'program = "good.py"\nquick = false'
    contents.write_text(contents.read_text().replace('program = "good.py"', left_out))
    assert [r.study.name for r in built(home, tmp_path / "out", "quick", ["meshes", "broken"])] == [
        "broken"
    ]
    assert "Left out of it: Meshes; Endless." in (tmp_path / "out/report.md").read_text()


def test_a_table_with_time_and_error_gives_a_picture_and_its_pareto_front(home, tmp_path):
    built(home, tmp_path / "out", names=["meshes"])
    assert (tmp_path / "out/pictures/meshes-1.png").stat().st_size > 5000
    assert "coarse → fine (default)" in (tmp_path / "out/report.md").read_text()


def test_the_front_holds_what_no_other_setting_beats_in_both():
    slow, good, bad = Trade("slow", 9.0, 1e-5), Trade("good", 1.0, 1e-3), Trade("bad", 2.0, 1e-2)
    assert front([slow, bad, good]) == [good, slow]


def test_a_case_without_a_number_is_not_drawn():
    figures = [Figure("T", "a", "time", "1", "s"), Figure("T", "a", "error", "refused")]
    assert trades(figures) == []


def test_figures_at_places_of_a_plate_are_drawn_as_maps(tmp_path):
    places = [(x, y) for x in (5.0, 15.0, 25.0) for y in (10.0, 30.0)]
    figures = [Figure("T", plate_map.at(x, y), "place", f"{x * y}", "mm") for x, y in places]
    assert plate_map.is_map(figures)
    assert not plate_map.is_map([*figures, Figure("T", "mean", "place", "1", "mm")])
    plate_map.draw(figures, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 5000


def test_ratios_to_the_bound_are_drawn_as_bars(tmp_path):
    figures = [Figure("T", f"way {n}", bars.QUANTITY, f"{n}") for n in (1, 2, 20)]
    figures.append(Figure("T", "way 1", "force", "3", "N"))
    assert len(bars.ratios(figures)) == 3
    bars.draw(figures, tmp_path / "bars.png")
    assert (tmp_path / "bars.png").stat().st_size > 5000


def test_a_table_has_a_line_a_case_and_says_which_bars_are_missed():
    figures = [
        Figure("T", "a|b", "width", "1.5", "mm"),
        judged(Figure("T", "c", "width", "2.5", "mm"), 2.5, 2.0),
        Figure("T", "c", "height", "3", "mm"),
    ]
    assert markdown(figures).splitlines()[2:] == [
        "| a\\|b | 1.5 |  |",
        "| c | 2.5 (≤ 2, **missed**) | 3 |",
    ]


def test_figures_of_a_study_that_was_killed_are_read_to_the_last_whole_line(tmp_path):
    figures = [Figure("T", "a", "width", "1", "mm"), Figure("T", "b", "width", "2", "mm")]
    write(tmp_path / "x.csv", figures)
    text = (tmp_path / "x.csv").read_text()
    (tmp_path / "x.csv").write_text(text[:-8])
    assert list(read(tmp_path / "x.csv")) == figures[:1]


def test_two_reports_are_compared_by_figures_but_not_by_times(tmp_path):
    for name, width, time in (("old", "1.0", "1"), ("new", "1.5", "9")):
        (tmp_path / name / "raw").mkdir(parents=True)
        verdict = "met" if name == "old" else "missed"
        write(
            tmp_path / name / "raw" / "s.csv",
            [
                Figure("T", "a", "width", width, "mm", "≤ 1.2", verdict),
                Figure("T", "a", "time", time, "ms"),
            ],
        )
    (change,) = changes(tmp_path / "old", tmp_path / "new", 0.2)
    assert change.lost
    assert change.ratio == pytest.approx(1.5)


def test_the_command_prints_states_and_missed_bars_for_machines(home, tmp_path):
    arguments = ["report", "meshes", "--studies", str(home), "--out", str(tmp_path / "out")]
    ended = CliRunner().invoke(application(["report"]), [*arguments, "--json"])
    told = json.loads(ended.stdout.strip().splitlines()[-1])
    assert told["studies"] == {"meshes": "done"}
    assert told["missed"] == []


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (CONTENTS.replace("good.py", "gone.py"), "study 'meshes' names gone.py"),
        (CONTENTS.replace("limit = 1.0", "limit = -1.0"), "not a table of contents"),
    ],
)
def test_a_wrong_table_of_contents_is_refused_by_what_is_wrong(home, text, said):
    (home / "report.toml").write_text(text)
    with pytest.raises(ValueError, match=said):
        read_contents(home)


def test_the_contents_of_the_report_name_programs_that_are_there():
    contents = shipped()
    names = [study.name for section in contents.sections for study in section.studies]
    assert len(names) == len(set(names)) > 5


def test_an_unknown_study_and_a_folder_without_studies_are_refused(home, tmp_path):
    with pytest.raises(ValueError, match="there is no study 'mesh'; there are meshes, broken"):
        built(home, tmp_path / "out", names=["mesh"])
    with pytest.raises(OSError, match="name the folder"):
        read_contents(tmp_path)
