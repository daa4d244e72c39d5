"""Plate mechanics: plate and touches in; displacement and strain out."""

from fe.adjoint import Adjoint
from fe.compliance import compliance
from fe.displacement_influence import DisplacementInfluence, displacement_influence
from fe.edges import Clamped, Edge, Edges, Elastic, Free, Supported
from fe.influence import Influence, influence
from fe.linear import Linear, State, deflect
from fe.mesh import Mesh, default_mesh, grid
from fe.modes import Modes, modes
from fe.picture import draw
from fe.plate import Patch, Plate, Touch
from fe.reduced import LargeState, Reduced, Trust, View, reduce
from fe.regime import Regime, regime
from fe.shell import Base, Shell, ShellState, Stability, Verdict, solve
from fe.vtu import write_vtu

__all__ = [
    "Adjoint",
    "Base",
    "Clamped",
    "DisplacementInfluence",
    "Edge",
    "Edges",
    "Elastic",
    "Free",
    "Influence",
    "LargeState",
    "Linear",
    "Mesh",
    "Modes",
    "Patch",
    "Plate",
    "Reduced",
    "Regime",
    "Shell",
    "ShellState",
    "Stability",
    "State",
    "Supported",
    "Touch",
    "Trust",
    "Verdict",
    "View",
    "compliance",
    "default_mesh",
    "deflect",
    "displacement_influence",
    "draw",
    "grid",
    "influence",
    "modes",
    "reduce",
    "regime",
    "solve",
    "write_vtu",
]
