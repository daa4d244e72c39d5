"""Public names of `fe`: the one list, read by type checkers and by the lazy loader."""

from .elements.mesh import (
    Mesh as Mesh,
    default_mesh as default_mesh,
    grid as grid,
)
from .linear.adjoint import Adjoint as Adjoint
from .linear.compliances import compliance as compliance
from .linear.gauge_influence import (
    Influence as Influence,
    influence as influence,
)
from .linear.linear import (
    Linear as Linear,
    State as State,
    deflect as deflect,
)
from .linear.linear_range import regime as regime
from .linear.plate_modes import (
    Modes as Modes,
    modes as modes,
)
from .linear.point_influence import (
    DisplacementInfluence as DisplacementInfluence,
    displacement_influence as displacement_influence,
)
from .linear.validity import Regime as Regime
from .output.plot import draw as draw
from .output.vtu import write_vtu as write_vtu
from .plate.edges import (
    Clamped as Clamped,
    Edge as Edge,
    Edges as Edges,
    Elastic as Elastic,
    Free as Free,
    Supported as Supported,
)
from .plate.plate import (
    Patch as Patch,
    Plate as Plate,
    Touch as Touch,
)
from .reduced import (
    LargeState as LargeState,
    Reduced as Reduced,
    Trust as Trust,
    View as View,
    reduce as reduce,
)
from .shell import (
    Base as Base,
    Shell as Shell,
    ShellState as ShellState,
    Stability as Stability,
    Verdict as Verdict,
    solve as solve,
)
