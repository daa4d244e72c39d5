"""Digital image correlation: images in; displacement, strain, quality and uncertainty out.

The doors are :func:`prepare`, :func:`correlate` and :func:`strain`; all else stands behind
them. Names load on first use, so that ``import dic`` costs nothing.
"""

import lazy_loader  # pyright: ignore[reportMissingTypeStubs]

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(  # pyright: ignore[reportUnknownVariableType]
    __name__, __file__
)
