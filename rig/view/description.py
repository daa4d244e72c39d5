"""Describes a test to its page, before that asks for images and fields."""

from __future__ import annotations

from typing import Any

import dic
from dic import export
from rig.series.invariants import STRAINS
from rig.series.parts import NO_FRAME
from rig.series.plots import limits_of
from rig.series.read import SeriesResult
from rig.system.arrays import AnyArray
from rig.view.reading import axis_as_json
from rig.view.viewed import ViewedTest

_SHOWN = (
    "subset", "step", "order", "stills", "scatter", "strain_window", "strain_kind", "field",
    "mm_per_px", "scale",
)  # fmt: skip
_FIRST = ("exx", "eyy", "exy", "u", "v")


def describe(test: ViewedTest) -> dict[str, Any]:
    """Describe images, result, regions and the correlation that runs."""
    with test.reading() as result:
        return {
            "images": [] if test.frames is None else list(test.frames.names),
            "result": None if result is None else _describe_result(result, test.interval),
            "regions": test.regions.model_dump(mode="json"),
            "status": [_status(one) for one in dic.Status],
            "job": test.job.state.as_json(),
            "out": str(test.out),
        }


def _describe_result(result: SeriesResult, interval: float | None) -> dict[str, Any]:
    height, width = result.image.shape
    names = [name for name in result.fields if not name.startswith("sigma_")]
    ordered = [*(n for n in _FIRST if n in names), *(n for n in names if n not in _FIRST)]
    return {
        "path": str(result.path),
        "frames": [
            {"name": name, "error": error}
            for name, error in zip(result.names, result.errors, strict=True)
        ],
        "size": [width, height],
        "x": result.grid.xs.tolist(),
        "y": result.grid.ys.tolist(),
        "step": result.grid.step,
        "subset": result.grid.subset,
        "length": "px" if result.places is None else "mm",
        "settings": {
            name: _plain(result.settings[name]) for name in _SHOWN if name in result.settings
        },
        "fields": [_field(name, result.fields) for name in ordered],
        "strains": [*STRAINS, *export.INVARIANTS],
        "axis": axis_as_json(result, interval),
        "NO_FRAME": NO_FRAME,
    }


def _field(name: str, known: tuple[str, ...]) -> dict[str, Any]:
    sigma = f"sigma_{name}"
    return drawn_as(name) | {"sigma": drawn_as(sigma) if sigma in known else None}


def drawn_as(name: str) -> dict[str, Any]:
    """Return title, unit, factor and colours of a field."""
    style = export.field_style(name)
    return {
        "name": name,
        "title": style.title,
        "unit": style.unit,
        "factor": style.factor,
        "colours": _hex(style.colours),
    }


def limits_as_json(result: SeriesResult, name: str) -> list[float]:
    """Return the limits of the colours of a field over all frames, in its unit."""
    return list(limits_of(result, name))


def _status(one: dic.Status) -> dict[str, Any]:
    return {
        "value": int(one),
        "name": one.name.lower().replace("_", " "),
        "sentence": one.sentence,
    }


def _hex(colours: AnyArray) -> list[str]:
    return [f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue in colours.tolist()]


def _plain(value: Any) -> Any:
    """Return an attribute of the file as JSON has it."""
    return value.tolist() if hasattr(value, "tolist") else value
