"""Put every key of a scene, out of the descriptions in its sections, below the page of the keys."""

import re
from collections.abc import Iterator
from inspect import getdoc
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MinLen
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import Files
from mkdocs.structure.pages import Page
from pydantic.fields import FieldInfo

from rig.scene import Scene
from rig.scene.quantity import UNITS
from rig.scene.scene import ESTIMATOR_NEEDS, NEEDS
from rig.scene.section import Section

PAGE = "scene-keys.md"
HEAD = "| key | value | if left out | meaning |\n|---|---|---|---|"
WORDS = {int: "whole number", float: "number", bool: "`true` or `false`", str: "text"}
COUNTS = {2: "two", 3: "three"}
BOUNDS = {Gt: "> {.gt:g}", Ge: "≥ {.ge:g}", Lt: "< {.lt:g}", Le: "≤ {.le:g}", MinLen: "not empty"}
UNIT = re.compile(rf", ({'|'.join(map(re.escape, filter(None, UNITS)))})(?=,|$)")


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Append a chapter for each key at the top of a scene."""
    if page.file.src_uri != PAGE:
        return markdown
    shown: dict[type[Section], str] = {}
    parts = [markdown.rstrip()]
    for name, field in Scene.model_fields.items():
        parts += _chapter(name, field, shown)
    return "\n\n".join(parts) + "\n"


def _chapter(name: str, field: FieldInfo, shown: dict[type[Section], str]) -> Iterator[str]:
    """Give what is said of a section, or of the title."""
    models = list(_sections(field.annotation))
    yield f"## {name}"
    if not models:
        yield f"{HEAD}\n{_row(name, field)}"
    elif models[0] in shown:
        like = shown[models[0]]
        yield f"{field.description}; its keys are those of [{like}](#{like})"
    else:
        yield from _needs(name)
        yield from _tables(name, field.annotation, shown)


def _needs(name: str) -> Iterator[str]:
    """Say which other sections a section asks for."""
    needs = {f"`[{name}]`": NEEDS.get(name, ())}
    if name == "estimator":
        needs = {f'`kind = "{kind}"`': others for kind, others in ESTIMATOR_NEEDS.items()}
    links = {who: [f"[{other}](#{other})" for other in others] for who, others in needs.items()}
    if said := [f"{who} needs {' and '.join(others)}" for who, others in links.items() if others]:
        yield f"{'; '.join(said)}."


def _tables(path: str, annotation: Any, shown: dict[type[Section], str]) -> Iterator[str]:
    """Give a table for each variant of a section, and below it those of the sections inside."""
    for model in [one for one in _sections(annotation) if one not in shown]:
        shown[model] = path
        fields = {key: field for key, field in model.model_fields.items() if not _tags(key, field)}
        yield f"**`{_title(path, model, annotation)}`** {getdoc(model)}"
        if fields:
            yield "\n".join([HEAD, *(_row(key, field) for key, field in fields.items())])
        for key, field in fields.items():
            yield from _tables(f"{path}.{key}", field.annotation, shown)


def _title(path: str, model: type[Section], annotation: Any) -> str:
    """Name a table as TOML does, or by what tells it from its variants."""
    if "kind" in model.model_fields and _tags("kind", model.model_fields["kind"]):
        return f'{path}.kind = "{get_args(model.model_fields["kind"].annotation)[0]}"'
    return f"[[{path}]]" if get_origin(annotation) is tuple else f"[{path}]"


def _tags(key: str, field: FieldInfo) -> bool:
    """Whether a key only tells variants apart."""
    return key == "kind" and len(get_args(field.annotation)) == 1


def _sections(annotation: Any) -> Iterator[type[Section]]:
    """Give the sections that an annotation allows."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        yield annotation
    for inner in get_args(annotation) if get_origin(annotation) is not Literal else ():
        yield from _sections(inner)


def _row(key: str, field: FieldInfo) -> str:
    meaning, _, absent = field.description.rstrip("]").partition(" [")
    unit = UNIT.search(meaning)
    cells = (
        f"`{key}`",
        _value(field.annotation, field.metadata) + (f", {unit[1]}" if unit else ""),
        "**needed**" if field.is_required() else absent or _written(field.default),
        UNIT.sub("", meaning),
    )
    return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def _written(default: Any) -> str:
    """Write a default as TOML would."""
    match default:
        case None:
            return "absent"
        case bool():
            return f"`{str(default).lower()}`"
        case str():
            return f'`"{default}"`'
        case tuple():
            return f"`[{', '.join(_written(one).strip('`') for one in default)}]`"
    return f"`{default:g}`"


def _value(annotation: Any, metadata: list) -> str:
    """Say what may be written: a kind of value and its bounds, or the words allowed."""
    origin, inside = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _value(inside[0], [*inside[1:], *metadata])
    if origin is Literal:
        return ", ".join(_written(word) for word in inside)
    if origin in (Union, UnionType):
        inside = [one for one in inside if one is not NoneType]
        return "table" if list(_sections(inside[0])) else _value(inside[0], metadata)
    if origin is tuple:
        count = "list of" if inside[-1] is Ellipsis else COUNTS[len(inside)]
        return re.sub("(number|table)", r"\1s", f"{count} {_value(inside[0], [])}", count=1)
    if list(_sections(annotation)):
        return "table"
    return f"{WORDS[annotation]} {', '.join(_bounds(metadata))}".rstrip()


def _bounds(metadata: list) -> Iterator[str]:
    for bound in metadata:
        if isinstance(bound, FieldInfo):
            yield from _bounds(bound.metadata)
        elif type(bound) in BOUNDS:
            yield BOUNDS[type(bound)].format(bound)
