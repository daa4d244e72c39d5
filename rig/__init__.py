"""The bench: scenes, cameras, projector, live loop, operator page and commands."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rig.cache import CacheError
    from rig.scene import Scene, SceneError, load

__all__ = ["CacheError", "Scene", "SceneError", "load"]

_HOMES = {
    "CacheError": "rig.cache",
    "Scene": "rig.scene",
    "SceneError": "rig.scene",
    "load": "rig.scene",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first asked for, so that commands start quickly."""
    if name not in _HOMES:
        raise AttributeError(f"module 'rig' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)
