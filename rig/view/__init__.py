"""The page of a whole test: from photographs to a field, and what can be read of it."""

from rig.view.server import serve
from rig.view.viewed import ViewedTest

__all__ = ["ViewedTest", "serve"]
