"""The pages: every link leads somewhere, every command and decision has its place, they build."""

import importlib
import os
import pkgutil
import re
import subprocess
import sys
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from typing import get_args
from urllib.parse import unquote, urlsplit

import pytest

import dic
import rig
from rig.cli import COMMANDS
from rig.report.figure import read
from rig.scene.account import account

FIGURES = "<!-- figures of the report -->", "<!-- end of the figures -->"
STEPS = "<!-- times of the steps -->", "<!-- end of the times -->"
ROOT = Path(__file__).parents[1]
TUTORIALS = [ROOT / "docs/tutorials" / name for name in ("photographs.md", "plate.md")]
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


def test_every_example_is_in_the_gallery():
    listed = (ROOT / "docs/gallery.md").read_text(encoding="utf-8")
    for script in sorted((ROOT / "examples").glob("*.py")):
        assert f"](../examples/{script.name})" in listed, script.name


def test_every_decision_is_in_the_list():
    listed = (ROOT / "docs/decisions/README.md").read_text(encoding="utf-8")
    for record in sorted((ROOT / "docs/decisions").glob("0*.md")):
        assert f"]({record.name})" in listed, record.name


NAME = re.compile(r"`((?:dic|fe|models|rig|synthetic)(?:\.\w+)+)(?:\(.*?\))?`")
FILE = re.compile(r"(?:dic|fe|models|rig|synthetic|benchmarks|examples|tests)(?:/[a-z\d_-]+)+\.\w+")


def is_a_name(dotted):
    """Whether it can be imported, or is a key of a scene."""
    try:
        pkgutil.resolve_name(dotted)
    except (ImportError, AttributeError):
        section, *keys = dotted.split(".")
        models = list(sections_of(rig.Scene.model_fields[section].annotation))
        return len(keys) == 1 and any(keys[0] in model.model_fields for model in models)
    return True


def sections_of(annotation):
    if hasattr(annotation, "model_fields"):
        yield annotation
    for inner in get_args(annotation):
        yield from sections_of(inner)


@pytest.mark.parametrize(
    "page", [page for page in PAGES if "report/" not in names(page)], ids=names
)
def test_every_name_and_file_of_the_code_that_a_page_names_is_there(page):
    text = page.read_text(encoding="utf-8")
    assert [name for name in NAME.findall(text) if not is_a_name(name)] == []
    assert [name for name in FILE.findall(text) if not (ROOT / name).exists()] == []


def scenes_of(page):
    """Scenes that a page shows, by the name in their first line."""
    text = page.read_text(encoding="utf-8")
    return dict(re.findall(r"```toml\n# (\S+\.toml)\n(.*?)```", text, re.DOTALL))


def test_the_scenes_of_the_tutorial_load_and_say_what_they_hold(tmp_path):
    scenes = scenes_of(TUTORIALS[1])
    assert scenes.keys() == {"my-plate.toml", "my-net.toml"}
    for name, text in scenes.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
        said = account(rig.load(tmp_path / name))
        assert {part.name for part in said.parts} >= {"plate", "estimator"}


def lines_between(page, marks):
    text = page.read_text(encoding="utf-8")
    return text.split(marks[0])[1].split(marks[1])[0].strip().splitlines()[2:]


def test_every_step_of_the_tutorials_is_timed_by_the_report():
    measured = {}
    for figure in read(ROOT / "docs/report/raw/newcomer.csv"):
        measured.setdefault(figure.case, []).append(figure.text)
    timed = {}
    for page in TUTORIALS:
        steps = page.read_text(encoding="utf-8").split(STEPS[0])[0]
        for line in lines_between(page, STEPS):
            command, *times = (cell.strip(" `") for cell in line.split("|")[1:-1])
            timed[command] = [time for time in times if time]
            assert command in steps, f"{command} in {names(page)}"
    assert timed == measured


def test_every_figure_of_the_readme_is_in_the_report():
    lines = lines_between(ROOT / "README.md", FIGURES)
    assert len(lines) > 5
    reported = {
        (figure.text, figure.asked)
        for path in (ROOT / "docs/report/raw").glob("*.csv")
        for figure in read(path)
    }
    for line in lines:
        _, _, measured, bar, _ = (cell.strip() for cell in line.split("|"))
        assert (measured, bar) in reported, line


def code_of(page):
    """Python that a page shows, one block after the other."""
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)


@pytest.fixture(scope="module")
def photographs(tmp_path_factory):
    """Folder with the pair of the example, and both images."""
    folder = tmp_path_factory.mktemp("photographs")
    example = ROOT / "examples/10_photographs.py"
    subprocess.run([sys.executable, example, folder], check=True, capture_output=True)
    before, after = (dic.read_image(folder / f"{name}.png") for name in ("before", "after"))
    return folder, {"before": before, "after": after, "reference": before}


@pytest.mark.parametrize("page", [page for page in PAGES if code_of(page)], ids=names)
def test_the_code_of_a_page_runs(page, photographs, monkeypatch):
    folder, known = photographs
    monkeypatch.chdir(folder)
    for block in code_of(page):
        exec(block, known.copy())


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Build the site as `make docs` does; MkDocs is strict, a warning ends it with 1."""
    folder = tmp_path_factory.mktemp("site")
    built = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--site-dir", str(folder)],
        cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    return folder


class Anatomy(HTMLParser):
    """What a page of the site points to, what it fetches, and the names of its places."""

    def __init__(self, path):
        super().__init__()
        self.links, self.fetched, self.places = [], [], {""}
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.places |= {given.get("id"), given.get("name")}
        if tag in ("script", "img", "link", "source"):
            self.fetched += [given[name] for name in ("src", "href") if given.get(name)]
        elif given.get("href"):
            self.links.append(given["href"])


@pytest.mark.slow
def test_every_link_of_the_site_resolves_and_nothing_is_fetched_from_outside(site):
    pages = {path: Anatomy(path) for path in site.rglob("*.html")}
    for path, page in pages.items():
        assert not [link for link in page.fetched if urlsplit(link).netloc], path
        for link in page.links + page.fetched:
            parts = urlsplit(link)
            if parts.scheme in ("http", "https", "mailto", "data"):
                continue
            base = site if parts.path.startswith("/") else path.parent
            target = (base / unquote(parts.path).lstrip("/")).resolve() if parts.path else path
            target = target / "index.html" if target.is_dir() else target
            assert target.is_file(), f"{link} in {path.relative_to(site)}"
            if parts.fragment and target in pages:
                assert unquote(parts.fragment) in pages[target].places, f"{link} in {path.name}"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dic", "fe", "models", "rig", "synthetic"])
def test_every_public_name_has_its_entry(site, name):
    page = (site / f"api/{name}.html").read_text(encoding="utf-8")
    headings = set(re.findall(r"<h3[^>]*>\s*([\w.]+)", page))
    assert headings == {f"{name}.{public}" for public in importlib.import_module(name).__all__}


@pytest.mark.slow
def test_every_key_of_a_scene_is_explained(site):
    page = (site / "scene-keys.html").read_text(encoding="utf-8")
    shown = set(re.findall(r"<td><code>(\w+)</code></td>", page))
    sections = set(re.findall(r'<h2 id="(\w+)"', page))
    assert sections == set(rig.Scene.model_fields)
    for path in (ROOT / "rig/scenes").glob("*.toml"):
        scene = tomllib.loads(path.read_text(encoding="utf-8"))
        keys = {key for section in scene.values() if isinstance(section, dict) for key in section}
        assert keys - {"kind"} <= shown, path.name


@pytest.mark.slow
def test_the_readme_is_the_home_of_the_site(site):
    title = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()[0].lstrip("# ")
    home = (site / "index.html").read_text(encoding="utf-8")
    assert re.search(rf"<h1[^>]*>{title}<", home)
