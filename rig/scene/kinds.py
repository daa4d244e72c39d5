"""Sections of several kinds: which there are, and what a section keeps that becomes another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast, get_args

from pydantic import BaseModel


def models_of(annotation: Any) -> list[type[BaseModel]]:
    """Return the sections that the type of a field names."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in models_of(part)]


def kind_of(model: type[BaseModel]) -> str | None:
    """Return the kind of a section, or None for one without kinds."""
    field = model.model_fields.get("kind")
    return get_args(field.annotation)[0] if field else None


def keep_what_stays(
    table: dict[str, Any], overrides: Mapping[str, Any], model: type[BaseModel]
) -> None:
    """Drop from `table` what a section that becomes another kind by an override does not know.

    Parameters
    ----------
    table
        A scene as nested tables; changed in place.
    overrides
        Values by dotted key. Of these only ``section.kind`` matters here.
    model
        What the whole table is checked by.
    """
    for key, kind in overrides.items():
        *sections, last = key.split(".")
        if last != "kind" or not sections or not isinstance(kind, str):
            continue
        section, models = _section(table, sections, model)
        chosen = [m for m in models if kind_of(m) == kind]
        if len(models) > 1 and chosen:
            for name in set(section) - set(chosen[0].model_fields):
                del section[name]


def _section(
    table: dict[str, Any], names: list[str], model: type[BaseModel]
) -> tuple[dict[str, Any], list[type[BaseModel]]]:
    """Return a section, empty where the table has none, and the models it may be of."""
    models, section = [model], table
    for name in names:
        below: Any = section.get(name, {})
        fields = [m.model_fields[name] for m in models if name in m.model_fields]
        models = [found for field in fields for found in models_of(field.annotation)]
        if not isinstance(below, dict) or not models:
            return {}, []
        section = cast("dict[str, Any]", below)
    return section, models
