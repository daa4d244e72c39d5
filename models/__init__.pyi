"""Public names of `models`: the one list, read by type checkers and by the lazy loader."""

from .bench.bench import (
    MEMORY as MEMORY,
    BenchEstimate as BenchEstimate,
    HeldOut as HeldOut,
    bench_before as bench_before,
    prior_sigma as prior_sigma,
    with_camera as with_camera,
)
from .bench.diagnosis import (
    CAUSES as CAUSES,
    NO_CAUSE as NO_CAUSE,
    Cause as Cause,
    Diagnosis as Diagnosis,
    diagnose as diagnose,
)
from .bench.identify import identify as identify
from .bench.learning import (
    force_sigma as force_sigma,
    learn as learn,
    wandered as wandered,
)
from .bench.marginal import (
    MarginalForward as MarginalForward,
    marginal as marginal,
)
from .bench.otherwise import (
    Otherwise as Otherwise,
    otherwise as otherwise,
)
from .bench.press import Press as Press
from .bench.score_test import FALSE_ALARM as FALSE_ALARM
from .bench.traces import (
    NO_TRACES as NO_TRACES,
    Traces as Traces,
    left_about as left_about,
    left_by as left_by,
)
from .data.dataset import (
    Dataset as Dataset,
    StrainInfluence as StrainInfluence,
    flatten_samples as flatten_samples,
    grid_places as grid_places,
    midpoint_places as midpoint_places,
    random_places as random_places,
    simulate_dataset as simulate_dataset,
)
from .data.gauge_layout import (
    gauges_inside_edges as gauges_inside_edges,
    gauges_on_edges as gauges_on_edges,
)
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
from .deformable.known_shapes import (
    agreement as agreement,
    identify_shape as identify_shape,
    known_shapes as known_shapes,
    turned_shapes as turned_shapes,
    with_images as with_images,
)
from .deformable.seen_shape import SeenShape as SeenShape
from .deformable.shape_fit import (
    ShapeFit as ShapeFit,
    Watched as Watched,
    fit_shape as fit_shape,
)
from .deformable.shape_motions import (
    ShapeFields as ShapeFields,
    ShapeForward as ShapeForward,
)
from .deformable.shape_touches import (
    PreparedShape as PreparedShape,
    estimate_on_shape as estimate_on_shape,
    prepare_shape as prepare_shape,
)
from .deformable.surface import (
    Surface as Surface,
    SurfaceEstimate as SurfaceEstimate,
    shape_verdict as shape_verdict,
)
from .design.bench_errors import (
    bench_after as bench_after,
    cost_of as cost_of,
    errors_on_bench as errors_on_bench,
)
from .design.cramer_rao import (
    cramer_rao as cramer_rao,
    pixel_bound as pixel_bound,
    pixel_level as pixel_level,
)
from .design.expected_errors import (
    ExpectedErrors as ExpectedErrors,
    aliased_part as aliased_part,
    bias_of_interpolation as bias_of_interpolation,
    equal_tiles as equal_tiles,
    errors_of_interpolation as errors_of_interpolation,
    expected_errors as expected_errors,
    gradient_energy as gradient_energy,
    places_over_plate as places_over_plate,
    shape_over as shape_over,
)
from .design.press_calibration import (
    PressCorrection as PressCorrection,
    correct_by_presses as correct_by_presses,
)
from .dynamics.creep import (
    Creep as Creep,
    LearnedCreep as LearnedCreep,
    crept_force as crept_force,
    learn_creep as learn_creep,
)
from .dynamics.damping import LearnedDamping as LearnedDamping, learn_damping as learn_damping
from .dynamics.in_time import (
    InTime as InTime,
    RingingPlate as RingingPlate,
    estimate_in_time as estimate_in_time,
)
from .dynamics.oscillators import (
    PlateDynamics as PlateDynamics,
    plate_dynamics as plate_dynamics,
)
from .dynamics.seeing import Seeing as Seeing
from .dynamics.tap import Tap as Tap
from .estimate import (
    Estimate as Estimate,
    ForceInterval as ForceInterval,
    Result as Result,
    SolverStats as SolverStats,
)
from .field_net.field_net import (
    NetField as NetField,
    correct_tiles as correct_tiles,
    net_field as net_field,
    shipped_net as shipped_net,
)
from .field_net.inputs import net_inputs as net_inputs
from .field_net.onnx import (
    field_onnx as field_onnx,
    write_field_onnx as write_field_onnx,
)
from .field_net.store import (
    FieldNet as FieldNet,
    load_field_net as load_field_net,
    save_field_net as save_field_net,
)
from .field_net.training import (
    FieldNetRecipe as FieldNetRecipe,
    TrainedFieldNet as TrainedFieldNet,
    train_field_net as train_field_net,
)
from .forward.bench_forward import (
    BENCH as BENCH,
    BenchFields as BenchFields,
    BenchForward as BenchForward,
)
from .forward.camera_change import (
    CAMERA as CAMERA,
    CameraChange as CameraChange,
    Look as Look,
    Seen as Seen,
    moving as moving,
    varied as varied,
)
from .forward.camera_gauges import (
    CameraGauges as CameraGauges,
    prepare_camera_gauges as prepare_camera_gauges,
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
from .forward.occlusion import (
    TileFit as TileFit,
    fit_tiles as fit_tiles,
    hidden_tiles as hidden_tiles,
)
from .forward.rolling import (
    RollingShutter as RollingShutter,
    rolling_shutter as rolling_shutter,
)
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
    noise_from_sums as noise_from_sums,
    prepare_pattern as prepare_pattern,
)
from .image_net.displacement_net import (
    DISPLACEMENT_FORMATS as DISPLACEMENT_FORMATS,
    SHIPPED_DISPLACEMENT_NETS as SHIPPED_DISPLACEMENT_NETS,
    load_displacement_net as load_displacement_net,
)
from .image_net.image_net import (
    image_net_field as image_net_field,
    shipped_image_net as shipped_image_net,
)
from .image_net.onnx import (
    image_onnx as image_onnx,
    write_image_onnx as write_image_onnx,
)
from .image_net.pair_score import PairScore as PairScore, score_pairs as score_pairs
from .image_net.store import (
    ImageNet as ImageNet,
    load_image_net as load_image_net,
    save_image_net as save_image_net,
)
from .image_net.training import (
    ImageNetRecipe as ImageNetRecipe,
    TrainedImageNet as TrainedImageNet,
    train_image_net as train_image_net,
)
from .inverse.candidates import (
    CandidateGrid as CandidateGrid,
    prepare_candidates as prepare_candidates,
    with_forward as with_forward,
)
from .inverse.estimator import (
    Estimator as Estimator,
    solve as solve,
)
from .inverse.friction import friction_error as friction_error
from .inverse.irls import find_robust as find_robust
from .inverse.levenberg_marquardt import (
    LevenbergMarquardt as LevenbergMarquardt,
    covariance as covariance,
)
from .inverse.prior import (
    Prior as Prior,
    prior as prior,
)
from .inverse.solver import find as find
from .motion_errors import (
    OF_PIXELS as OF_PIXELS,
    MotionErrors as MotionErrors,
    with_motion_errors as with_motion_errors,
)
from .nets.array_file import net_format as net_format
from .nets.baselines import (
    train_adversarial as train_adversarial,
    train_convolutional as train_convolutional,
)
from .nets.batches import (
    mixed_batches as mixed_batches,
    noisy_batches as noisy_batches,
    shuffled_batches as shuffled_batches,
)
from .nets.checkpoint import Checkpoint as Checkpoint
from .nets.loss import (
    Loss as Loss,
    base_loss as base_loss,
    distance_loss as distance_loss,
    magnitude_loss as magnitude_loss,
)
from .nets.model_file import prepare_net_file as prepare_net_file
from .nets.net import (
    Net as Net,
    NetOptions as NetOptions,
    Scaling as Scaling,
    predict as predict,
)
from .nets.net_estimator import (
    NetTouchEstimator as NetTouchEstimator,
    prepare_net_estimator as prepare_net_estimator,
)
from .nets.onnx import (
    write_model_onnx as write_model_onnx,
    write_onnx as write_onnx,
)
from .nets.regression import Regression as Regression
from .nets.set_encoding import permutation_invariant_loss as permutation_invariant_loss
from .nets.store import (
    Model as Model,
    load_model as load_model,
    load_net as load_net,
    save_model as save_model,
    save_net as save_net,
)
from .nets.train import Recipe as Recipe, Trained as Trained, train_net as train_net
from .nets.tune import NetCandidate as NetCandidate, tune_net as tune_net
from .nets.two_step import (
    DeformableSurface as DeformableSurface,
    TrainedTwoStep as TrainedTwoStep,
    TwoStep as TwoStep,
    predict_two_step as predict_two_step,
    train_place as train_place,
    train_shape as train_shape,
)
from .scores.error_map import ErrorMap as ErrorMap, error_map as error_map
from .scores.matching import match as match
from .scores.score import (
    matched_error as matched_error,
    position_error as position_error,
    score_positions as score_positions,
)
from .scores.touch_score import (
    TouchPairs as TouchPairs,
    TouchScore as TouchScore,
    pair_touches as pair_touches,
    score_touches as score_touches,
)
from .touch_net.benches import (
    DescribedBench as DescribedBench,
    bench_forward as bench_forward,
    draw_bench as draw_bench,
)
from .touch_net.onnx import (
    touch_onnx as touch_onnx,
    write_touch_onnx as write_touch_onnx,
)
from .touch_net.posterior import Mixture as Mixture
from .touch_net.prior import TouchRange as TouchRange
from .touch_net.store import (
    TouchNet as TouchNet,
    load_touch_net as load_touch_net,
    save_touch_net as save_touch_net,
)
from .touch_net.touch_net import (
    SHIPPED_TOUCH_NET as SHIPPED_TOUCH_NET,
    NetTouches as NetTouches,
    TouchReader as TouchReader,
    prepare_reader as prepare_reader,
    shipped_touch_net as shipped_touch_net,
)
from .touch_net.training import (
    TouchNetRecipe as TouchNetRecipe,
    TrainedTouchNet as TrainedTouchNet,
    train_touch_net as train_touch_net,
)
from .workers import workers as workers
