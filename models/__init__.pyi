"""Public names of `models`: the one list, read by type checkers and by the lazy loader."""

from .data.dataset import Dataset as Dataset
from .data.reader import (
    Samples as Samples,
    read_dataset as read_dataset,
)
from .data.sampling_plan import (
    SamplingPlan as SamplingPlan,
    TouchBox as TouchBox,
    TouchLattice as TouchLattice,
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
from .forward.gauges import gauge_forward as gauge_forward
from .forward.image_motion import (
    ImageMotions as ImageMotions,
    prepare_motions as prepare_motions,
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
    Simulator as Simulator,
    large_deflection as large_deflection,
    superpose as superpose,
)
from .forward.strain_map import (
    StrainMap as StrainMap,
    prepare_strain_map as prepare_strain_map,
)
from .forward.tile_pattern import (
    TilePattern as TilePattern,
    prepare_pattern as prepare_pattern,
)
from .inverse.candidates import (
    CandidateGrid as CandidateGrid,
    prepare_candidates as prepare_candidates,
    with_forward as with_forward,
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
