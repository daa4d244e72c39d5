"""The bench: scenes, cameras, projector, live loop, operator page and commands."""

from importlib.util import find_spec
from pathlib import Path

import lazy_loader

for _name in ("dic", "fe", "models", "synthetic"):  # generic names: a user's own file may hide one
    _found = getattr(find_spec(_name), "origin", None)
    if _found != str(Path(__file__).parents[1] / _name / "__init__.py"):
        raise ImportError(f"'{_name}' is '{_found}' and not touchplate's; rename that file")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
