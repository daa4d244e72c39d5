"""The bench: scenes, cameras, projector, live loop, operator page and commands."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
