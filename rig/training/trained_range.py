"""What a net learnt, and whether it is asked for more: beyond it a net says anything."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from rig.scene import Scene, with_overrides
from rig.scene.sensing import NetEstimator

FIXED = ("plate", "gauges", "camera", "pattern", "estimator")
"""Sections that a trained model cannot be tested with others of."""


class _Asked(NamedTuple):
    """One quantity: its key, the range that was learnt and the one that is asked."""

    key: str
    unit: str
    learnt: tuple[float, float]
    asked: tuple[float, float]


def replaced(scene: Scene, overrides: Mapping[str, Any]) -> Scene:
    """Return the scene of a model with other touches to test on.

    Raises
    ------
    ValueError
        If a key or value is not as it must be, or is one that the model was trained for.
    """
    if not overrides:
        return scene
    changed = with_overrides(scene, overrides)
    for name in FIXED:
        if getattr(changed, name) != getattr(scene, name):
            raise ValueError(
                f"the model was trained for the [{name}] of its scene, and another is asked; train"
                " one for it"
            )
    return changed


def require_within(learnt: Scene, asked: Scene) -> None:
    """Refuse touches beyond those that a model learnt.

    Raises
    ------
    ValueError
        With the quantity, what is asked, what was learnt and what to do.
    """
    for name, unit, (low, high), (least, largest) in _ranges(learnt, asked):
        if least < low or largest > high:
            raise ValueError(
                f"the model learnt {name} from {low:g} to {high:g} {unit}, and {least:g} to"
                f" {largest:g} {unit} is asked, where it may say anything; train it with --set"
                f" {name}=[{min(low, least):g},{max(high, largest):g}]"
            )
    before, now = (scene.dataset.touches if scene.dataset else 1 for scene in (learnt, asked))
    if before != now:
        raise ValueError(
            f"the model learnt samples of {before} touches, and {now} are asked; train one for them"
            f" with --set dataset.touches={now}"
        )


def _ranges(learnt: Scene, asked: Scene) -> Iterator[_Asked]:
    before, now = learnt.training, asked.training
    if before is None or now is None:
        return
    if not _knows_any_force(learnt):
        yield _Asked("training.force", "N", before.force, now.force)
    if before.bases and now.bases:
        yield _Asked("training.bases.bend", "mm", before.bases.bend, now.bases.bend)
        yield _Asked("training.bases.twist", "deg", before.bases.twist, now.bases.twist)


def _knows_any_force(scene: Scene) -> bool:
    """Whether the force does not reach the net."""
    net = scene.estimator
    return isinstance(net, NetEstimator) and (
        net.inputs == "relative" or net.base_strain == "direction"
    )
