"""The pages: every link leads somewhere, every command and decision has its place, they build."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rig.cli import COMMANDS

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


def test_the_pages_build_without_a_warning(tmp_path):
    """MkDocs is strict here: a warning is an error."""
    command = [sys.executable, "-m", "mkdocs", "build", "--quiet", "--site-dir", str(tmp_path)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    built = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert built.returncode == 0, built.stderr
    assert (tmp_path / "index.html").exists()
