"""Public names of `fe`: the one list, read by type checkers and by the lazy loader."""

from .elements.hermite import (
    HERMITE_DERIVATIVES as HERMITE_DERIVATIVES,
    hermite_gram as hermite_gram,
)
from .elements.mesh import (
    Mesh as Mesh,
    default_mesh as default_mesh,
    even_grid as even_grid,
    grid as grid,
    scaled_mesh as scaled_mesh,
)
from .elements.nodal_loads import nodal_loads as nodal_loads
from .linear.adjoint import Adjoint as Adjoint
from .linear.buckling import buckling_factor as buckling_factor
from .linear.compliances import compliance as compliance
from .linear.demand import strain_demand as strain_demand
from .linear.gauge_influence import (
    Influence as Influence,
    influence as influence,
)
from .linear.linear import (
    Linear as Linear,
    LinearState as LinearState,
    deflect as deflect,
)
from .linear.linear_range import linear_range as linear_range
from .linear.mesh_error import MeshError as MeshError
from .linear.plate_modes import (
    Modes as Modes,
    modes as modes,
)
from .linear.point_influence import (
    DisplacementInfluence as DisplacementInfluence,
    displacement_influence as displacement_influence,
)
from .linear.touch_mesh import touch_mesh as touch_mesh
from .linear.validity import (
    LINEAR_TOLERANCE as LINEAR_TOLERANCE,
    LinearRange as LinearRange,
    as_percent as as_percent,
)
from .modal.bench import (
    BenchPlate as BenchPlate,
    Pressed as Pressed,
)
from .modal.build import modal_plate as modal_plate
from .modal.parameters import (
    BENCH_PARAMETERS as BENCH_PARAMETERS,
    bench_values as bench_values,
)
from .modal.plate import ModalPlate as ModalPlate
from .modal.readings import Readings as Readings, strain_readings as strain_readings
from .output.plot import draw as draw
from .output.vtu import write_sheet as write_sheet, write_vtu as write_vtu
from .plate.edges import (
    Clamped as Clamped,
    Edge as Edge,
    Edges as Edges,
    Elastic as Elastic,
    Free as Free,
    Supported as Supported,
)
from .plate.loads import (
    FaceForce as FaceForce,
    LineLoad as LineLoad,
    Load as Load,
    PointMoment as PointMoment,
    Pressure as Pressure,
)
from .plate.plate import (
    Patch as Patch,
    Plate as Plate,
    Touch as Touch,
)
from .plate.shape import Shape as Shape
from .reduced import (
    LargeState as LargeState,
    Reduced as Reduced,
    ReducedReadings as ReducedReadings,
    Trust as Trust,
    reduced_plate as reduced_plate,
)
from .reduced.large_state import drift_at as drift_at
from .reduced.whole import WholePlate as WholePlate
from .shell import (
    Base as Base,
    Shell as Shell,
    ShellInfluence as ShellInfluence,
    ShellState as ShellState,
    Stability as Stability,
    Verdict as Verdict,
    shell_influence as shell_influence,
    shell_mesh as shell_mesh,
    solve as solve,
)
from .shell.base import check_base as check_base
from .shell.base_shapes import (
    BaseShape as BaseShape,
    base_shapes as base_shapes,
    half_turned as half_turned,
    mirrored as mirrored,
    shape_name as shape_name,
)
from .shell.response import (
    ShellResponse as ShellResponse,
    base_tangent as base_tangent,
    face_motion as face_motion,
    shell_response as shell_response,
)
