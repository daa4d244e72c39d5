"""Read a scene file, put overrides into it and check it."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import Any, cast

from pydantic import ValidationError
from pydantic_core import PydanticCustomError

from rig.scene.kinds import keep_what_stays
from rig.scene.refusal import SceneError, sentence
from rig.scene.renamed import with_new_keys
from rig.scene.scene import Scene


def shipped() -> list[str]:
    """Return the names of the scenes that come with the package."""
    return sorted(path.stem for path in _package().joinpath("scenes").glob("*.toml"))


def load(scene: str | Path, overrides: Mapping[str, Any] | None = None) -> Scene:
    """Load a scene.

    Parameters
    ----------
    scene
        Name of a shipped scene ("twin"), or path of a TOML file. A relative path is looked for
        in the working folder and then beside the package.
    overrides
        Values that replace those of the file, by dotted key: ``{"dic.subset": 31}``. Where one
        makes a section another kind, as ``{"source.kind": "files"}`` does, what the file says of
        that section and the new kind does not know is left out.

    Raises
    ------
    SceneError
        If the file is missing or is no TOML, or a key or value is not as it must be.
    """
    path = _find(scene)
    table = _read(path)
    try:
        table = with_new_keys(table)
        _override_all(table, overrides or {})
        return Scene.model_validate(table)
    except PydanticCustomError as error:
        raise SceneError(f"{path.name}: {error}") from error
    except ValidationError as error:
        raise SceneError(f"{path.name}: {sentence(error, Scene)}") from error


def from_table(table: Mapping[str, Any]) -> Scene:
    """Check what a scene file would hold, as nested tables.

    Raises
    ------
    SceneError
        If a key or value is not as it must be.
    """
    try:
        return Scene.model_validate(table)
    except ValidationError as error:
        raise SceneError(sentence(error, Scene)) from error


def with_overrides(scene: Scene, overrides: Mapping[str, Any]) -> Scene:
    """Return a scene with some values replaced, by dotted key as in `load`.

    Raises
    ------
    SceneError
        If a key or value is not as it must be.
    """
    table = scene.model_dump(mode="json", exclude_none=True)
    try:
        _override_all(table, overrides)
        return Scene.model_validate(table)
    except PydanticCustomError as error:
        raise SceneError(str(error)) from error
    except ValidationError as error:
        raise SceneError(sentence(error, Scene)) from error


def parse_overrides(settings: Iterable[str]) -> dict[str, Any]:
    """Return the overrides that ``key=value`` texts of a command line name.

    A value is read as TOML, and as a plain text where it is none.

    Raises
    ------
    SceneError
        If a text has no equals sign.
    """
    overrides: dict[str, Any] = {}
    for setting in settings:
        key, equals, text = setting.partition("=")
        if not equals or not key.strip():
            raise SceneError(f"setting '{setting}' has no value; write it as section.key=value")
        overrides[key.strip()] = _value(text.strip())
    return overrides


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _package() -> Path:
    return Path(str(resources.files("rig")))


def _find(scene: str | Path) -> Path:
    if not isinstance(scene, str | os.PathLike):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise SceneError(f"scene is {scene!r}; give the name of a shipped one, or a path")
    if "\0" in str(scene):
        raise SceneError(f"scene {str(scene)!r} is no path; leave the zero byte out")
    path = Path(scene)
    named = _package() / "scenes" / f"{path}.toml"
    places = [path, _package() / path] if path.suffix else [named]
    for place in places:
        if place.is_file():
            return place
    if path.suffix:
        raise SceneError(f"scene file '{path}' does not exist; check the path")
    raise SceneError(
        f"no scene is called '{path}'; shipped are {', '.join(shipped())}, or give a path to a"
        " TOML file"
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        fault = str(error)
        raise SceneError(
            f"{path.name} is no TOML: {fault[0].lower()}{fault[1:]}; correct it there"
        ) from error
    except UnicodeDecodeError as error:
        raise SceneError(f"{path.name} is no text in UTF-8; save it as UTF-8") from error
    except OSError as error:
        raise SceneError(
            f"scene file '{path}' cannot be read ({error.strerror}); check its permissions"
        ) from error


def _with_new_keys(overrides: Mapping[str, Any]) -> dict[str, Any]:
    """Return overrides by the keys of this release."""
    renamed: dict[str, Any] = {}
    for key, value in overrides.items():
        nested: dict[str, Any] = {}
        _override(nested, key, value)
        new, value = _dotted(with_new_keys(nested), key.count(".") + 1)
        if new in renamed:
            raise SceneError(f"'{key}' sets {new} a second time; leave one of the two out")
        renamed[new] = value
    return renamed


def _dotted(nested: dict[str, Any], depth: int) -> tuple[str, Any]:
    """Return the key of a single value that lies `depth` tables deep, and the value."""
    ((name, value),) = nested.items()
    if depth == 1:
        return name, value
    below, value = _dotted(value, depth - 1)
    return f"{name}.{below}", value


def _override_all(table: dict[str, Any], overrides: Mapping[str, Any]) -> None:
    overrides = _with_new_keys(overrides)
    keep_what_stays(table, overrides, Scene)
    for key, value in overrides.items():
        _override(table, key, value)


def _override(table: dict[str, Any], key: str, value: Any) -> None:
    if not isinstance(key, str):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise SceneError(f"key {key!r} of an override is no text; write it as 'section.key'")
    *sections, last = key.split(".")
    for depth, section in enumerate(sections):
        below: Any = table.setdefault(section, {})
        if not isinstance(below, dict):
            place = ".".join(sections[: depth + 1])
            raise SceneError(f"'{key}' cannot be set: {place} is a value; set '{place}' itself")
        table = cast("dict[str, Any]", below)
    table[last] = value
