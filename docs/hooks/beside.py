"""Bring what stands beside docs/ into the site: README, examples, scenes and a few files.

In the tree a page links to such a file where it lies; the site has it at another place, so links
follow. The README is the home of the site, and an example or scene is a page with its text.
"""

import re
from pathlib import Path
from posixpath import dirname, join, normpath, relpath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
HOMES = {"README.md": "index.md"}
"""Files whose place in the site is not the one in the tree."""

PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md")
SOURCES = ("examples/*.py", "examples/*.service", "rig/scenes/*.toml", "LICENSE")
LANGUAGES = {".py": "python", ".toml": "toml", ".service": "ini", "": "text"}
"""A source becomes a page that shows its text, in the language of its kind."""

CODE_OR_LINK = re.compile(r"```.*?```|`[^`\n]*`|(?<=\]\()(?P<link>[^)\s#]+)", re.DOTALL)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the files from beside."""
    for name in PAGES:
        files.append(File.generated(config, _place(name), abs_src_path=str(ROOT / name)))
    for path in sorted(path for pattern in SOURCES for path in ROOT.glob(pattern)):
        name = path.relative_to(ROOT).as_posix()
        files.append(File.generated(config, _place(name), content=_page_of(path)))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn links between places in the tree into links between places in the site."""
    here = page.file.src_uri
    tree = {_place(name): name for name in PAGES}.get(here, f"docs/{here}")

    def follow(found: re.Match) -> str:
        if found["link"] is None or ":" in found["link"]:
            return found[0]
        there = _place(normpath(join(dirname(tree), found["link"])))
        return relpath(there, dirname(here) or ".")

    return CODE_OR_LINK.sub(follow, markdown)


def _place(name: str) -> str:
    """Return where a file of the tree stands in the site."""
    if name.startswith("docs/"):
        return name.removeprefix("docs/")
    if Path(name).suffix in LANGUAGES:
        return f"{name}.md"
    return HOMES.get(name, name)


def _page_of(path: Path) -> str:
    """Return a page that shows the text of a file."""
    text = path.read_text(encoding="utf-8")
    return f"# {path.name}\n\n```{LANGUAGES[path.suffix]}\n{text}```\n"
