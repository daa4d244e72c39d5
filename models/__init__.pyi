"""Public names of `models`: the one list, read by type checkers and by the lazy loader."""

from .data.dataset import Dataset as Dataset
from .data.reader import (
    Samples as Samples,
    read_dataset as read_dataset,
)
from .data.sampling_plan import (
    Box as Box,
    Lattice as Lattice,
    Plan as Plan,
)
from .data.writer import (
    DatasetFile as DatasetFile,
    begin_dataset as begin_dataset,
)
from .design.cramer_rao import (
    cramer_rao as cramer_rao,
    pixel_level as pixel_level,
)
from .estimate import (
    Estimate as Estimate,
    Result as Result,
)
from .forward.gauges import gauges as gauges
from .forward.image_motion import (
    Motions as Motions,
    see_motions as see_motions,
    with_tilts as with_tilts,
)
from .forward.large import (
    LargeForward as LargeForward,
    LargePlate as LargePlate,
    large_gauges as large_gauges,
    large_plate as large_plate,
)
from .forward.linear import (
    Forward as Forward,
    LinearForward as LinearForward,
)
from .forward.occlusion import hidden_tiles as hidden_tiles
from .forward.simulator import (
    Answer as Answer,
    balance as balance,
    superpose as superpose,
)
from .forward.strain_map import (
    StrainMap as StrainMap,
    see_strain as see_strain,
)
from .forward.tile_pattern import (
    Pattern as Pattern,
    see_pattern as see_pattern,
)
from .inverse.candidates import (
    Search as Search,
    prepare_search as prepare_search,
    renewed as renewed,
)
from .inverse.irls import find_robust as find_robust
from .inverse.levenberg_marquardt import covariance as covariance
from .inverse.prior import (
    Prior as Prior,
    prior as prior,
)
from .inverse.solver import (
    find as find,
    solve as solve,
)
from .nets.net import (
    NetOptions as NetOptions,
    predict as predict,
)
from .scores.matching import match as match
from .scores.score import position_error as position_error
