"""What is said of a scene that is refused: one sentence with key, value, unit and remedy."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import Any, get_args

from pydantic import BaseModel, BeforeValidator, ValidationError
from pydantic.fields import FieldInfo

from rig.scene.kinds import kind_of, models_of
from rig.scene.quantity import Quantity

BOUNDS = {
    "greater_than": ("more than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
NUMBER = ("float_type", "float_parsing", "finite_number")
LIST = ("missing", "too_long", "too_short", "tuple_type")
WANTED = {
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "a text",
    "string_too_short": "a text that is not empty",
    "model_type": "a table of keys",
    "model_attributes_type": "a table of keys",
}
"""What to give instead, by the type of error that pydantic names."""

LONGEST = 60  # characters of a value that are repeated


class SceneError(ValueError):
    """A scene that cannot be used; its text is one sentence for the user."""


def sentence(error: ValidationError, model: type[BaseModel]) -> str:
    """Return the sentence for the first thing wrong; an unknown key comes before what it caused."""
    details = sorted(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
    first = details[0]
    return _sentence(dict(first), tuple(first["loc"]), model)


def _sentence(error: dict[str, Any], loc: tuple[int | str, ...], model: type[BaseModel]) -> str:
    path, owner, field = _walk(loc, model)
    match error["type"]:
        case "scene":
            return error["msg"]
        case "extra_forbidden":
            return _unknown(path, owner)
        case "missing" if isinstance(loc[-1], str):
            return _missing(path, field)
        case "union_tag_not_found":
            return f"{_name(path)}.kind is missing; say which kind of {path[-1]} it is"
        case "union_tag_invalid":
            tag, tags = error["ctx"]["tag"], error["ctx"]["expected_tags"]
            return f"{_name(path)}.kind is '{tag}'; give one of {tags}"
        case "missing":
            path = path[:-1]
        case _:
            pass
    return f"{_name(path)} is {_value(error['input'], field)}; give {_wanted(error, field)}"


def _walk(
    loc: tuple[int | str, ...], model: type[BaseModel]
) -> tuple[tuple[int | str, ...], type[BaseModel], FieldInfo | None]:
    """Follow a location to its owner and field; names of union members are no part of the path."""
    path: list[int | str] = []
    owner, field = model, None
    members: list[type[BaseModel]] = []
    for step in loc:
        chosen = [m for m in members if step == kind_of(m)]
        if len(members) > 1 and chosen:
            owner, members = chosen[0], chosen
            continue
        path.append(step)
        if isinstance(step, int):
            continue
        owner = members[0] if members else owner
        field = owner.model_fields.get(step)
        members = models_of(field.annotation) if field else []
    return tuple(path), owner, field


def _name(path: Sequence[int | str]) -> str:
    return "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in path).lstrip(".")


def _value(value: Any, field: FieldInfo | None) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return f"{value:g} {_unit(field)}".rstrip()
    text = repr(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."


def _quantity(field: FieldInfo | None) -> Quantity | None:
    if field is None:
        return None
    return _search([*field.metadata, field.annotation])


def _search(parts: Sequence[Any]) -> Quantity | None:
    for part in parts:
        if isinstance(part, BeforeValidator) and isinstance(part.func, Quantity):
            return part.func
        nested = [*getattr(part, "__metadata__", ()), *get_args(part)]
        if nested and (found := _search(nested)):
            return found
    return None


def _unit(field: FieldInfo | None) -> str:
    quantity = _quantity(field)
    return quantity.unit if quantity else ""


def _wanted(error: dict[str, Any], field: FieldInfo | None) -> str:
    kind, context = error["type"], error.get("ctx", {})
    if kind in BOUNDS:
        words, key = BOUNDS[kind]
        return f"{words} {context[key]:g} {_unit(field)}".rstrip()
    if kind in NUMBER:
        quantity = _quantity(field)
        return quantity.wanted() if quantity else "a number"
    if kind in LIST:
        return _list(field)
    if kind == "literal_error":
        return context["expected"]
    return WANTED.get(kind) or error["msg"].removeprefix("give ")


def _list(field: FieldInfo | None) -> str:
    parts = get_args(field.annotation) if field else ()
    return "a list of values" if Ellipsis in parts else f"a list of {len(parts)} values"


def _unknown(path: tuple[int | str, ...], owner: type[BaseModel]) -> str:
    name, known = str(path[-1]), list(owner.model_fields)
    place = f" in [{_name(path[:-1])}]" if len(path) > 1 else ""
    near = difflib.get_close_matches(name, known, n=1)
    remedy = f"did you mean '{near[0]}'?" if near else f"known are {', '.join(known)}"
    return f"unknown key '{name}'{place}; {remedy}"


def _missing(path: tuple[int | str, ...], field: FieldInfo | None) -> str:
    about = f" ({field.description})" if field else ""
    place = f" to [{_name(path[:-1])}]" if len(path) > 1 else ""
    return f"{_name(path)} is missing; add it{place}{about}"
