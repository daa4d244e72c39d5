"""How far a bench is taken as its scene describes it."""

from __future__ import annotations

from typing import Literal

from rig.scene.scene import Scene
from rig.scene.sensing import PatternEstimator
from rig.scene.source import TwinSection


def described(scene: Scene) -> Literal["exact", "usual"]:
    """Return whether plate, edges and camera are just as a scene says, or as they usually are.

    Without a word in the scene a twin is exact unless it departs from its scene, and every other
    source shows a bench of a lab. What only an exact bench can be followed by makes it one: a base
    that bends, a plate that rings, a search that a touch net begins.
    """
    estimator = scene.estimator
    if not isinstance(estimator, PatternEstimator):
        return "exact"
    if estimator.bench is not None:
        return estimator.bench
    if scene.source is None or scene.base is not None or estimator.start != "search":
        return "exact"
    if scene.dynamics is not None and scene.dynamics.density is not None:
        return "exact"
    twin = isinstance(scene.source, TwinSection) and scene.source.departure is None
    return "exact" if twin else "usual"
