"""Public names of `rig`: the one list, read by type checkers and by the lazy loader."""

from .scene import (
    Scene as Scene,
    SceneError as SceneError,
    load as load,
)
from .system.cache import CacheError as CacheError
