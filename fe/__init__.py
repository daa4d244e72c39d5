"""Plate mechanics: plate and touches in; displacement and strain out.

Names load on first use: a linear plate never loads the shell.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fe.adjoint import Adjoint as Adjoint
    from fe.compliances import compliance as compliance
    from fe.edges import Clamped as Clamped
    from fe.edges import Edge as Edge
    from fe.edges import Edges as Edges
    from fe.edges import Elastic as Elastic
    from fe.edges import Free as Free
    from fe.edges import Supported as Supported
    from fe.gauge_influence import Influence as Influence
    from fe.gauge_influence import influence as influence
    from fe.linear import Linear as Linear
    from fe.linear import State as State
    from fe.linear import deflect as deflect
    from fe.linear_range import regime as regime
    from fe.mesh import Mesh as Mesh
    from fe.mesh import default_mesh as default_mesh
    from fe.mesh import grid as grid
    from fe.picture import draw as draw
    from fe.plate import Patch as Patch
    from fe.plate import Plate as Plate
    from fe.plate import Touch as Touch
    from fe.plate_modes import Modes as Modes
    from fe.plate_modes import modes as modes
    from fe.point_influence import DisplacementInfluence as DisplacementInfluence
    from fe.point_influence import displacement_influence as displacement_influence
    from fe.reduced import LargeState as LargeState
    from fe.reduced import Reduced as Reduced
    from fe.reduced import Trust as Trust
    from fe.reduced import View as View
    from fe.reduced import reduce as reduce
    from fe.shell import Base as Base
    from fe.shell import Shell as Shell
    from fe.shell import ShellState as ShellState
    from fe.shell import Stability as Stability
    from fe.shell import Verdict as Verdict
    from fe.shell import solve as solve
    from fe.validity import Regime as Regime
    from fe.vtu import write_vtu as write_vtu

_HOMES = {
    "adjoint": ("Adjoint",),
    "compliances": ("compliance",),
    "edges": ("Clamped", "Edge", "Edges", "Elastic", "Free", "Supported"),
    "gauge_influence": ("Influence", "influence"),
    "linear": ("Linear", "State", "deflect"),
    "linear_range": ("regime",),
    "mesh": ("Mesh", "default_mesh", "grid"),
    "picture": ("draw",),
    "plate": ("Patch", "Plate", "Touch"),
    "plate_modes": ("Modes", "modes"),
    "point_influence": ("DisplacementInfluence", "displacement_influence"),
    "reduced": ("LargeState", "Reduced", "Trust", "View", "reduce"),
    "shell": ("Base", "Shell", "ShellState", "Stability", "Verdict", "solve"),
    "validity": ("Regime",),
    "vtu": ("write_vtu",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME_OF)


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'fe' has no attribute {name!r}")
    return getattr(import_module(f"fe.{_HOME_OF[name]}"), name)
