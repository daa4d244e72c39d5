"""Public names of `dic`: the one list, read by type checkers and by the lazy loader."""

from . import export as export
from .correlation.correlation import correlate as correlate
from .correlation.reference import (
    Reference as Reference,
    prepare as prepare,
)
from .correlation.sequence import (
    compose as compose,
    follow as follow,
)
from .fields.displacement import (
    DisplacementField as DisplacementField,
    Status as Status,
)
from .fields.grid import Grid as Grid
from .fields.local_fit import (
    SmoothField as SmoothField,
    smooth as smooth,
)
from .fields.strain_field import (
    StrainField as StrainField,
    strain as strain,
)
from .fields.strain_matrix import strain_operator as strain_operator
from .images.image import read_image as read_image
from .images.quality import (
    noise_floor as noise_floor,
    sssig as sssig,
)
from .settings import (
    Advice as Advice,
    choose as choose,
    mean_intensity_gradient as mean_intensity_gradient,
    speckle_size as speckle_size,
    sub_pixel_bias as sub_pixel_bias,
)
from .tiles.tile_field import (
    TileBlocks as TileBlocks,
    prepare_blocks as prepare_blocks,
    tile_displacement as tile_displacement,
)
from .tiles.tiles import (
    TileReference as TileReference,
    Tiles as Tiles,
    TileSums as TileSums,
    lay_tiles as lay_tiles,
    prepare_tiles as prepare_tiles,
    tile_sums as tile_sums,
)
