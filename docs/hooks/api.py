"""Put the entries of a package's public names, out of their docstrings, below its page in docs/api.

The public names are those of `__all__`. One without a docstring ends the build.
"""

import sys
from functools import cache
from importlib import import_module
from inspect import isfunction, ismodule
from pathlib import Path
from typing import get_origin

import griffe
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
FOLDER = "api/"
TITLES = ("Functions", "Types", "Constants", "Modules")
ENTRY = """::: {path}
    options:
      heading: {package}.{name}
      toc_label: {name}"""


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Append the entries to the page of a package."""
    if not page.file.src_uri.startswith(FOLDER):
        return markdown
    package = page.file.src_uri.removeprefix(FOLDER).removesuffix(".md")
    names = import_module(package).__all__
    kinds = {title: [] for title in TITLES}
    for name in sorted(names, key=str.lower):
        kinds[_title(_thing(package, name))].append(name)
    parts = [_part(package, title, members) for title, members in kinds.items() if members]
    return "\n\n".join([markdown.rstrip(), *parts]) + "\n"


def _part(package: str, title: str, names: list[str]) -> str:
    """Return a table of some names, and their entries."""
    homes = {name: home(package, name) for name in names}
    table = ["| name | |", "|---|---|"]
    table += [f"| [`{name}`][{path}] | {_first(path)} |" for name, path in homes.items()]
    entries = (ENTRY.format(path=path, package=package, name=name) for name, path in homes.items())
    return "\n\n".join([f"## {title}", "\n".join(table), *entries])


def _thing(package: str, name: str) -> object:
    return getattr(import_module(package), name)


def _title(thing: object) -> str:
    if ismodule(thing):
        return "Modules"
    if isfunction(thing):
        return "Functions"
    return "Types" if isinstance(thing, type) or get_origin(thing) else "Constants"


def home(package: str, name: str) -> str:
    """Return where a public name is defined, such as `dic.correlation.correlate`."""
    thing = _thing(package, name)
    if ismodule(thing):
        return thing.__name__
    if getattr(thing, "__module__", "").startswith(f"{package}."):
        return f"{thing.__module__}.{name}"
    inside = (module for module in sorted(sys.modules) if module.startswith(f"{package}."))
    return next(f"{path}.{name}" for path in inside if vars(sys.modules[path]).get(name) is thing)


def _first(path: str) -> str:
    """Return the first sentence of what a name says about itself."""
    package, _, inner = path.partition(".")
    said = _read(package)[inner].docstring
    if said is None:
        raise PluginError(f"{path} is public and has no docstring; write one")
    return said.value.split("\n\n")[0].replace("\n", " ").replace("|", "\\|")


@cache
def _read(package: str) -> griffe.Module:
    """Read the text of a package, where a type alias has a docstring too."""
    return griffe.load(package, search_paths=[ROOT], resolve_aliases=True)
