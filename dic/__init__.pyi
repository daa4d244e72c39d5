"""Public names of `dic`: the one list, read by type checkers and by the lazy loader."""

from . import export as export
from .adaptive.adaptive_field import (
    adaptive_field as adaptive_field,
    adaptive_tiles as adaptive_tiles,
    tiles_at_points as tiles_at_points,
)
from .adaptive.adaptive_tiles import (
    AdaptiveTiles as AdaptiveTiles,
    denoised_tiles as denoised_tiles,
)
from .correlation.clipping import clipped_status as clipped_status
from .correlation.correlation import correlate as correlate
from .correlation.point_status import expected_sigma as expected_sigma
from .correlation.reference import (
    Reference as Reference,
    prepare as prepare,
)
from .correlation.sequence import (
    SequenceState as SequenceState,
    compose_displacements as compose_displacements,
    correlate_sequence as correlate_sequence,
    follow_frame as follow_frame,
    renewed_reference as renewed_reference,
)
from .correlation.splitting import correlate_split as correlate_split
from .correlation.stills import prepare_stills as prepare_stills
from .fields.displacement import (
    DisplacementField as DisplacementField,
    Status as Status,
)
from .fields.grid import Grid as Grid
from .fields.invariants import (
    StrainInvariants as StrainInvariants,
    strain_invariants as strain_invariants,
)
from .fields.local_fit import (
    SmoothField as SmoothField,
    smooth as smooth,
)
from .fields.strain_field import (
    StrainField as StrainField,
    StrainKind as StrainKind,
    strain as strain,
    strain_measure as strain_measure,
)
from .fields.strain_matrix import strain_operator as strain_operator
from .images.image import check_image as check_image, read_image as read_image
from .images.prefilter import Prefilter as Prefilter
from .images.quality import (
    box_sums as box_sums,
    lies_inside as lies_inside,
    noise_floor as noise_floor,
    sssig as sssig,
)
from .images.spline import (
    spline_coefficients as spline_coefficients,
    spline_gradient as spline_gradient,
)
from .images.warped import warp_image as warp_image
from .settings import (
    SettingsAdvice as SettingsAdvice,
    mean_intensity_gradient as mean_intensity_gradient,
    recommend_settings as recommend_settings,
    speckle_size as speckle_size,
    sub_pixel_bias as sub_pixel_bias,
)
from .tiles.aliasing import (
    aliasing_left as aliasing_left,
    gain_left as gain_left,
)
from .tiles.fixed_pattern import fixed_pattern_sums as fixed_pattern_sums
from .tiles.preparation import prepare_tiles as prepare_tiles
from .tiles.smooth_gradient import tile_prefilter as tile_prefilter
from .tiles.tile_field import (
    TileBlocks as TileBlocks,
    prepare_blocks as prepare_blocks,
    tile_displacement as tile_displacement,
    tile_gradient as tile_gradient,
)
from .tiles.tiles import (
    TileReference as TileReference,
    Tiles as Tiles,
    TileSums as TileSums,
    lay_tiles as lay_tiles,
    tile_sums as tile_sums,
    unbiased_gradient as unbiased_gradient,
)
