"""What a study needs beside this package, and whether it is there."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

import rig

SOURCE_TREE = "source tree"
PATTERN = rf"^({SOURCE_TREE}|(package|program|data) [A-Za-z0-9_.-]+)$"
"""How a need is written: "source tree", "package pyvale", "program ccx", "data star5"."""


def missing(needs: Iterable[str], data: Path | None) -> list[str]:
    """Return the needs that are not met; `data` is the folder of data of others, if there is one.

    A package is one that can be imported, a program one that is on the path, data a folder or file
    of the folder of data.
    """
    return [need for need in needs if not _there(need, data)]


def sentence(needs: Iterable[str]) -> str:
    """Say what is needed."""
    said = [f"the {need}" if need == SOURCE_TREE else f"the {_noun(need)}" for need in needs]
    return f"needs {', '.join(said)}"


def _noun(need: str) -> str:
    kind, _, name = need.partition(" ")
    return f"data '{name}' (--data FOLDER)" if kind == "data" else f"{kind} {name}"


def _there(need: str, data: Path | None) -> bool:
    kind, _, name = need.partition(" ")
    match kind:
        case "package":
            return find_spec(name) is not None
        case "program":
            return shutil.which(name) is not None
        case "data":
            return data is not None and (data / name).exists()
        case _:
            return (Path(rig.__file__).parents[1] / "pyproject.toml").is_file()
