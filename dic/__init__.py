"""Digital image correlation: images in; displacement, strain, quality and uncertainty out.

The doors are :func:`prepare`, :func:`correlate` and :func:`strain`; all else stands behind
them. Names load on first use, so that ``import dic`` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dic import export as export
    from dic import quality as quality
    from dic.correlation import correlate as correlate
    from dic.displacement import DisplacementField as DisplacementField
    from dic.displacement import Status as Status
    from dic.grid import Grid as Grid
    from dic.image import read_image as read_image
    from dic.local_fit import SmoothField as SmoothField
    from dic.local_fit import smooth as smooth
    from dic.pattern import Advice as Advice
    from dic.pattern import choose as choose
    from dic.pattern import mean_intensity_gradient as mean_intensity_gradient
    from dic.pattern import speckle_size as speckle_size
    from dic.pattern import sub_pixel_bias as sub_pixel_bias
    from dic.quality import noise_floor as noise_floor
    from dic.quality import sssig as sssig
    from dic.reference import Reference as Reference
    from dic.reference import prepare as prepare
    from dic.sequence import compose as compose
    from dic.sequence import follow as follow
    from dic.strain_field import StrainField as StrainField
    from dic.strain_field import strain as strain
    from dic.strain_matrix import strain_operator as strain_operator
    from dic.tile_field import TileBlocks as TileBlocks
    from dic.tile_field import prepare_blocks as prepare_blocks
    from dic.tile_field import tile_displacement as tile_displacement
    from dic.tiles import TileReference as TileReference
    from dic.tiles import Tiles as Tiles
    from dic.tiles import TileSums as TileSums
    from dic.tiles import lay_tiles as lay_tiles
    from dic.tiles import prepare_tiles as prepare_tiles
    from dic.tiles import tile_sums as tile_sums

_HOMES = {
    "correlation": ("correlate",),
    "displacement": ("DisplacementField", "Status"),
    "grid": ("Grid",),
    "image": ("read_image",),
    "local_fit": ("SmoothField", "smooth"),
    "pattern": ("Advice", "choose", "mean_intensity_gradient", "speckle_size", "sub_pixel_bias"),
    "quality": ("noise_floor", "sssig"),
    "reference": ("Reference", "prepare"),
    "sequence": ("compose", "follow"),
    "strain_field": ("StrainField", "strain"),
    "strain_matrix": ("strain_operator",),
    "tile_field": ("TileBlocks", "prepare_blocks", "tile_displacement"),
    "tiles": ("TileReference", "Tiles", "TileSums", "lay_tiles", "prepare_tiles", "tile_sums"),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}


__all__ = sorted([*_HOME_OF, "export", "quality"])


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name in ("export", "quality"):
        return import_module(f"dic.{name}")
    if name not in _HOME_OF:
        raise AttributeError(f"module 'dic' has no attribute {name!r}")
    return getattr(import_module(f"dic.{_HOME_OF[name]}"), name)
