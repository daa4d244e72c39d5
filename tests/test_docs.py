"""The pages: every link leads somewhere, every command and decision has its place, they build."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import rig
from rig.cli import COMMANDS
from rig.report.figure import read
from rig.scene.account import account

FIGURES = "<!-- figures of the report -->", "<!-- end of the figures -->"
STEPS = "<!-- times of the steps -->", "<!-- end of the times -->"
ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
LINK = re.compile(r"\]\(([^)\s]+)\)")


def names(path):
    return str(path.relative_to(ROOT))


def anchors(page):
    """Names of the headings of a page, as GitHub and MkDocs make them."""
    heads = re.findall(r"^#+ +(.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", head.lower()) for head in heads)
    return {head.strip().replace(" ", "-") for head in plain}


@pytest.mark.parametrize("page", PAGES, ids=names)
def test_every_link_leads_to_a_file_and_its_heading(page):
    for link in LINK.findall(page.read_text(encoding="utf-8")):
        if link.startswith(("http://", "https://", "mailto:")):
            continue
        place, _, heading = link.partition("#")
        target = (page.parent / place).resolve() if place else page
        assert target.exists(), f"{link} in {names(page)}"
        if heading:
            assert heading in anchors(target), f"{link} in {names(page)}"


def test_every_command_has_a_page_that_the_list_links_to():
    listed = (ROOT / "docs/commands.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        assert f"](commands/{command}.md)" in listed, command


def test_every_decision_is_in_the_list():
    listed = (ROOT / "docs/README.md").read_text(encoding="utf-8")
    for record in sorted((ROOT / "docs/decisions").glob("*.md")):
        assert f"](decisions/{record.name})" in listed, record.name


def scenes_of(page):
    """Scenes that a page shows, by the name in their first line."""
    text = page.read_text(encoding="utf-8")
    return dict(re.findall(r"```toml\n# (\S+\.toml)\n(.*?)```", text, re.DOTALL))


def test_the_scenes_of_the_readme_load_and_say_what_they_hold(tmp_path):
    scenes = scenes_of(ROOT / "README.md")
    assert scenes.keys() == {"my-plate.toml", "my-net.toml"}
    for name, text in scenes.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        said = account(rig.load(tmp_path / name))
        assert {part.name for part in said.parts} >= {"plate", "estimator"}


def lines_between(marks):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return text.split(marks[0])[1].split(marks[1])[0].strip().splitlines()[2:]


def test_every_step_of_the_readme_is_timed_by_the_report():
    measured = {}
    for figure in read(ROOT / "docs/report/raw/newcomer.csv"):
        measured.setdefault(figure.case, []).append(figure.text)
    lines = [[cell.strip(" `") for cell in line.split("|")[1:-1]] for line in lines_between(STEPS)]
    assert {command: [time for time in times if time] for command, *times in lines} == measured
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for command in measured:
        assert command in text.split(STEPS[0])[0], command


def test_every_figure_of_the_readme_is_in_the_report():
    lines = lines_between(FIGURES)
    assert len(lines) > 5
    told = {
        (figure.text, figure.asked)
        for path in (ROOT / "docs/report/raw").glob("*.csv")
        for figure in read(path)
    }
    for line in lines:
        _, _, measured, bar, _ = (cell.strip() for cell in line.split("|"))
        assert (measured, bar) in told, line


def test_the_pages_build_without_a_warning(tmp_path):
    """MkDocs is strict here: a warning is an error."""
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(tmp_path)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    assert (tmp_path / "index.html").exists()
