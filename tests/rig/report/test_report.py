"""A report of small studies: one that ends well, one that fails, one that takes too long."""

import json
import re
from datetime import datetime

import pytest
from typer.testing import CliRunner

from rig.cli import application
from rig.report import crb, needs, plate_map
from rig.report.build import Order, build
from rig.report.compare import changes, kept_figures
from rig.report.figure import Bar, Figure, at_least, at_most, digits, read, write
from rig.report.pareto import Trade, front, trades
from rig.report.study import read_contents, shipped
from rig.report.table import markdown
from rig.report.verdicts import judged

CONTENTS = """
[[section]]
title = "First section"
[[section.studies]]
name = "meshes"
title = "Meshes"
text = "Coarse against *fine*."
program = "good.py"
front = "Mesh"
[[section.studies]]
name = "broken"
title = "Broken"
program = "within/bad.py"
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
NEEDY = """
[[section.studies]]
name = "needy"
title = "Needy"
program = "good.py"
needs = ["data star", "package dic"]
"""
OPEN = """
[[topic]]
title = "Some day"
bars = [{ case = "nothing found", unit = "mm", at_most = 2 }]
"""
GOOD = """
import sys
from pathlib import Path
from rig.report.figure import Figure, write
home = Path(__file__).parent
home.joinpath("count").open("a").write("x")
home.joinpath("words").write_text(" ".join(sys.argv[1:]))
found = [
    Figure("Mesh", name, what, value, unit)
    for name, time, error in (("coarse", 0.1, 1e-2), ("fine (default)", 2.0, 1e-5))
    for what, value, unit in (("time", time, "s"), ("error", error, ""))
]
write(Path(sys.argv[-1]), found)
"""
BAD = """
import sys
from pathlib import Path
from rig.report.figure import Figure, at_most, write
write(Path(sys.argv[-1]), [Figure("Before", "a", "width", 3.0, "mm", at_most(2.0))])
raise ValueError("the load is not finite")
"""
SLOW = "import sys, time\ntime.sleep(0 if '--short' in sys.argv else 60)\n"
NOW = datetime(2026, 1, 2, 3, 4)


@pytest.fixture
def home(tmp_path):
    folder = tmp_path / "studies"
    (folder / "within").mkdir(parents=True)
    for name, text in {
        "report.toml": CONTENTS,
        "good.py": GOOD,
        "within/bad.py": BAD,
        "slow.py": SLOW,
    }.items():
        (folder / name).write_text(text)
    return folder


def built(home, out, effort="normal", names=(), data=None):
    order = Order(effort, out, tuple(names), data)
    return build(read_contents(home), order, lambda *said: None, NOW)


def test_a_study_that_fails_or_takes_too_long_stands_in_the_report_with_its_words(home, tmp_path):
    out = tmp_path / "out"
    states = {result.study.name: result.outcome.state for result in built(home, out)}
    assert states == {"meshes": "done", "broken": "failed", "endless": "stopped"}
    text = (out / "report.md").read_text()
    assert "the load is not finite" in text
    assert "stopped after 1 s" in text
    assert "| a | 3 (≤ 2, **missed**) |" in text, "what a study found before it failed is shown"


def test_a_study_that_needs_what_is_not_there_is_left_out_by_name(home, tmp_path):
    (home / "report.toml").write_text(CONTENTS + NEEDY)
    (result,) = built(home, tmp_path / "out", names=["needy"])
    assert result.outcome.state == "left out"
    text = (tmp_path / "out/report.md").read_text()
    assert "left out: needs the data 'star' (--data FOLDER)" in text
    assert not (home / "count").exists()
    (tmp_path / "star").mkdir()
    (result,) = built(home, tmp_path / "out", names=["needy"], data=tmp_path)
    assert result.outcome.state == "done"
    assert f"--data {tmp_path}" in (home / "words").read_text()


def test_needs_are_met_by_what_can_be_imported_run_or_read(tmp_path):
    there = ["package rig", "program sh", f"data {tmp_path.name}", "source tree"]
    assert needs.missing(there, tmp_path.parent) == []
    gone = ["package no_such_package", "program no-such-program", "data x"]
    assert needs.missing(gone, tmp_path) == gone


def test_the_page_opens_with_the_count_of_bars_the_misses_and_the_machine(home, tmp_path):
    (home / "open_bars.toml").write_text(OPEN)
    built(home, tmp_path / "out", names=["meshes", "broken"])
    text = (tmp_path / "out/report.md").read_text()
    opening, rest = text.split("## What ran")
    assert "**Bars: 0 met, 1 missed, 1 not measured.**" in opening
    assert "| Before: a, width | 3 mm | ≤ 2 mm |" in opening
    assert "2026-01-02" in opening
    assert "](plots/front.png)" in opening
    assert "| nothing found | ≤ 2 mm |" in rest
    assert (tmp_path / "out/plots/front.png").stat().st_size > 5000


@pytest.mark.slow
def test_a_bar_is_open_until_a_study_has_its_case_and_quantity(home, tmp_path):
    other = OPEN.replace("nothing found", "a").replace("unit", 'quantity = "width", unit')
    (home / "open_bars.toml").write_text(other)
    built(home, tmp_path / "out", names=["meshes"])
    assert "not measured yet" in (tmp_path / "out/report.md").read_text()
    built(home, tmp_path / "out", names=["meshes", "broken"])
    assert "not measured yet" not in (tmp_path / "out/report.md").read_text()


def test_the_report_names_versions_and_scenes(home, tmp_path):
    built(home, tmp_path / "out", names=["meshes"])
    text = (tmp_path / "out/report.md").read_text()
    assert "numpy" in text
    assert re.search(r"twin `[0-9a-f]{12}`", text)


def test_the_html_page_needs_no_other_file(home, tmp_path):
    built(home, tmp_path / "out", names=["meshes"])
    page = (tmp_path / "out/report.html").read_text()
    assert page.count('src="data:image/png;base64,') == 2
    assert "http" not in page.replace("http-equiv", "")
    assert "<table>" in page


@pytest.mark.slow
def test_a_study_that_ended_well_is_not_run_again_until_the_code_changes(home, tmp_path):
    for _ in range(2):
        built(home, tmp_path / "out", names=["meshes"])
    assert (home / "count").read_text() == "x"
    (home / "good.py").write_text(GOOD + "\n# changed\n")
    built(home, tmp_path / "out", names=["meshes"])
    assert (home / "count").read_text() == "xx"


def test_studies_that_are_named_join_those_of_earlier_days(home, tmp_path):
    built(home, tmp_path / "out", names=["meshes"])
    (home / "good.py").write_text(GOOD + "\n# changed\n")
    order = Order("quick", tmp_path / "out", ("endless",))
    build(read_contents(home), order, lambda *said: None, datetime(2026, 1, 5))
    text = (tmp_path / "out/report.md").read_text()
    assert "| Meshes | done | 2026-01-02 |" in text
    assert "| Endless | done | 2026-01-05 |" in text
    assert "coarse → fine (default)" in text
    assert "Left out of it: Broken." in text
    assert (home / "count").read_text() == "x", "what is not named is not run again"


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


def test_a_table_with_time_and_error_gives_a_plot_and_its_pareto_front(home, tmp_path):
    built(home, tmp_path / "out", names=["meshes"])
    assert (tmp_path / "out/plots/meshes-1.png").stat().st_size > 5000
    assert "coarse → fine (default)" in (tmp_path / "out/report.md").read_text()


def test_the_front_holds_what_no_other_setting_beats_in_both():
    slow, good, bad = Trade("slow", 9.0, 1e-5), Trade("good", 1.0, 1e-3), Trade("bad", 2.0, 1e-2)
    assert front([slow, bad, good]) == [good, slow]


def test_a_case_without_a_number_is_not_drawn():
    figures = [Figure("T", "a", "time", 1.0, "s"), Figure("T", "a", "error", "refused")]
    assert trades(figures) == []


@pytest.mark.slow
def test_figures_at_places_of_a_plate_are_drawn_as_maps(tmp_path):
    places = [(x, y) for x in (5.0, 15.0, 25.0) for y in (10.0, 30.0)]
    figures = [Figure("T", plate_map.at(x, y), "place", x * y, "mm") for x, y in places]
    assert plate_map.is_map(figures)
    assert not plate_map.is_map([*figures, Figure("T", "mean", "place", 1.0, "mm")])
    plate_map.draw(figures, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 5000


def test_ratios_to_the_bound_are_drawn_as_bars(tmp_path):
    figures = [Figure("T", f"way {n}", crb.QUANTITY, n) for n in (1, 2, 20)]
    figures.append(Figure("T", "way 1", "force", 3.0, "N"))
    assert len(crb.ratios(figures)) == 3
    crb.draw(figures, tmp_path / "ratios.png")
    assert (tmp_path / "ratios.png").stat().st_size > 5000


def test_a_table_has_a_line_a_case_and_says_which_bars_are_missed():
    figures = [
        Figure("T", "a|b", "width", 1.5, "mm"),
        Figure("T", "c", "width", 2.5, "mm", at_most(2.0)),
        Figure("T", "c", "height", 3.0, "mm", samples=8),
        Figure("T", "d", "width", None, "mm", at_most(2.0)),
    ]
    assert markdown(figures).splitlines()[2:] == [
        "| a\\|b | 1.5 |  |",
        "| c | 2.5 (≤ 2, **missed**) | 3 (n = 8) |",
        "| d | not measured (≤ 2) |  |",
    ]


@pytest.mark.parametrize(
    ("value", "bar", "verdict"),
    [
        (2.0, at_most(2.0), "met"),
        (2.001, at_most(2.0), "missed"),
        (200, at_least(200), "met"),
        (199.9, at_least(200), "missed"),
        (0.95, Bar(0.9, 1.1), "met"),
        (1.2, Bar(0.9, 1.1), "missed"),
        (float("nan"), at_most(2.0), "missed"),
        (float("inf"), at_most(2.0), "missed"),
        (None, at_most(2.0), "not measured"),
        (2.0, None, ""),
        ("none", None, ""),
    ],
)
def test_a_verdict_follows_from_value_and_bar(value, bar, verdict):
    assert Figure("T", "a", "width", value, "mm", bar).verdict == verdict


def test_a_bar_asks_for_a_number():
    with pytest.raises(ValueError, match=r"a: width has the bar ≤ 2, so .*, got 'narrow'"):
        Figure("T", "a", "width", "narrow", "", at_most(2.0))


def test_bars_are_counted_by_what_came_of_them():
    values = (1.0, 3.0, None, 4.0)
    found = judged(
        [Figure("T", "a", f"{n}", value, "", at_most(2)) for n, value in enumerate(values)]
    )
    assert found.sentence == "1 met, 2 missed, 1 not measured"


def test_a_bar_eases_when_it_lets_more_pass():
    assert at_most(6).eases(at_most(5))
    assert at_least(1).eases(at_least(2))
    assert not at_most(5).eases(at_most(5))
    assert not Bar(0.95, 1.0).eases(Bar(0.9, 1.1))


def test_a_number_shows_three_digits_and_more_where_its_bar_is_near():
    assert digits(1.23456) == "1.23"
    assert digits(15876.4) == "15876"
    assert digits(2e-5) == "2e-05"
    assert digits(1.03004, at_most(1.03)) == "1.03004"
    assert digits(1.03, at_most(1.03)) == "1.03"


def test_figures_survive_their_file_with_value_bar_verdict_and_samples(tmp_path):
    figures = [
        Figure("T", "a", "width", 1.1 * 1.1, "mm", at_most(1.21)),
        Figure("T", "a", "share", 95.0, "%", Bar(93.0, 97.0), 1000),
        Figure("T", "a", "said", "one, two"),
        Figure("T", "b", "width", None, "mm", at_least(2.0)),
    ]
    write(tmp_path / "x.csv", figures)
    found = list(read(tmp_path / "x.csv"))
    assert found == figures
    assert [figure.verdict for figure in found] == ["missed", "met", "", "not measured"]


def test_figures_of_a_study_that_was_killed_are_read_to_the_last_whole_line(tmp_path):
    figures = [Figure("T", "a", "width", 1.0, "mm"), Figure("T", "b", "width", 2.0, "mm")]
    write(tmp_path / "x.csv", figures)
    text = (tmp_path / "x.csv").read_text()
    (tmp_path / "x.csv").write_text(text[:-8])
    assert list(read(tmp_path / "x.csv")) == figures[:1]


def test_figures_of_an_older_version_are_refused(tmp_path):
    (tmp_path / "x.csv").write_text("table,case,quantity,value,unit,bar,verdict\n")
    with pytest.raises(ValueError, match="a report of an older version has others"):
        list(read(tmp_path / "x.csv"))


def kept(folder, **studies):
    for name, figures in studies.items():
        (folder / "raw").mkdir(parents=True, exist_ok=True)
        (folder / "raw" / f"{name}.json").write_text("{}")
        if figures is not None:
            write(folder / "raw" / f"{name}.csv", figures)


def changed(folder):
    return changes(kept_figures(folder / "old"), kept_figures(folder / "new"), 0.2)


def width(value, bar=None, case="a", unit="mm"):
    return Figure("T", case, "width", value, unit, bar)


def test_two_reports_are_compared_by_figures_but_not_by_times(tmp_path):
    kept(tmp_path / "old", s=[width(1.0, at_most(1.2)), width(1.0, case="t", unit="ms")])
    kept(tmp_path / "new", s=[width(1.5, at_most(1.2)), width(9.0, case="t", unit="ms")])
    (change,) = changed(tmp_path)
    assert (change.kind, change.now) == ("lost", "1.5 mm")


def test_a_bar_is_lost_when_it_is_missed_gone_or_not_measured_any_more(tmp_path):
    bar = at_most(1.2)
    old = [width(1.0, bar, case) for case in "abcde"]
    new = [width(1.3, bar, "a"), width(None, bar, "b"), width(1.0, None, "c"), width(1.0, bar, "e")]
    kept(tmp_path / "old", s=old, failed=[width(1.0, bar)], unasked=[width(1.0, bar)])
    kept(tmp_path / "new", s=new, failed=None)
    found = changed(tmp_path)
    assert [(each.study, each.kind, each.before.case, each.now) for each in found] == [
        ("failed", "lost", "a", "gone"),
        ("s", "lost", "a", "1.3 mm"),
        ("s", "lost", "b", "not measured"),
        ("s", "lost", "c", "1 mm"),
        ("s", "lost", "d", "gone"),
    ]


def test_a_bar_that_asks_for_less_is_named(tmp_path):
    kept(tmp_path / "old", s=[width(1.0, at_most(5.0))])
    kept(tmp_path / "new", s=[width(1.0, at_most(6.0))])
    (change,) = changed(tmp_path)
    assert change.kind == "eased"


def test_the_command_prints_states_and_missed_bars_for_machines(home, tmp_path):
    arguments = ["report", "meshes", "broken", "--studies", str(home), "--out", str(tmp_path)]
    ended = CliRunner().invoke(application(["report"]), [*arguments, "--json"])
    said = json.loads(ended.stdout.strip().splitlines()[-1])
    assert said["studies"] == {"meshes": "done", "broken": "failed"}
    (missed,) = said["missed"]
    assert missed["bar"] == {"at_least": None, "at_most": 2.0}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (CONTENTS.replace("good.py", "gone.py"), "study 'meshes' names gone.py"),
        (CONTENTS.replace("limit = 1.0", "limit = -1.0"), "not a table of contents"),
        (CONTENTS + NEEDY.replace("data star", "luck"), "not a table of contents"),
    ],
)
def test_a_wrong_table_of_contents_is_refused_by_what_is_wrong(home, text, said):
    (home / "report.toml").write_text(text)
    with pytest.raises(ValueError, match=said):
        read_contents(home)


def test_the_contents_of_the_report_name_programs_that_are_there():
    contents = shipped()
    names = [study.name for study in contents.studies]
    assert len(names) == len(set(names)) > 5
    assert contents.program(contents.studies[0])[:2] == ("-P", "-m")


def test_an_unknown_study_and_a_folder_without_studies_are_refused(home, tmp_path):
    with pytest.raises(ValueError, match="there is no study 'mesh'; there are meshes, broken"):
        built(home, tmp_path / "out", names=["mesh"])
    with pytest.raises(OSError, match="name the folder"):
        read_contents(tmp_path)


DRAWN = """
import sys
from pathlib import Path
from rig.report.figure import Figure, drawing, write
file = Path(sys.argv[sys.argv.index("--figures") + 1])
plots = file.parents[1] / "plots"
plots.mkdir(exist_ok=True)
(plots / "bow.png").write_bytes(b"PNG")
write(file, [drawing("Bows", "both", "bow.png"), Figure("Bows", "first", "height", 2.0, "mm")])
"""


def test_what_a_study_has_drawn_stands_above_its_table(tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    (home / "drawn.py").write_text(DRAWN)
    (home / "report.toml").write_text(
        '[[section]]\ntitle = "One"\n[[section.studies]]\n'
        'name = "bows"\ntitle = "Bows"\nprogram = "drawn.py"\n'
    )
    order = Order("normal", tmp_path / "out")
    now = datetime(2026, 1, 2, 3, 4).astimezone()
    build(read_contents(home), order, lambda study, count, total: None, now)
    text = (tmp_path / "out/report.md").read_text()
    assert "![both](plots/bow.png)\n\n|  | height, mm |" in text
    assert "drawing" not in text
    html = (tmp_path / "out/report.html").read_text()
    assert "data:image/png;base64,UE5H" in html
