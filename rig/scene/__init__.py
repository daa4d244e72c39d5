"""Scene files: one TOML file describes a bench and what is to be done with it."""

from rig.scene.load import load, parse_overrides, shipped, with_overrides
from rig.scene.refusal import SceneError
from rig.scene.scene import Scene

__all__ = ["Scene", "SceneError", "load", "parse_overrides", "shipped", "with_overrides"]
