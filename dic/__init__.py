"""Digital image correlation: images in; displacement, strain, quality and uncertainty out.

The doors are :func:`prepare`, :func:`correlate` and :func:`strain`; all else stands behind
them. Names load on first use, so that ``import dic`` costs nothing.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
