"""Plate mechanics: plate and touches in; displacement and strain out."""

from fe.adjoint import Adjoint
from fe.compliance import compliance
from fe.displacement_influence import DisplacementInfluence, displacement_influence
from fe.edges import Clamped, Edge, Edges, Elastic, Free, Supported
from fe.influence import Influence, influence
from fe.linear import Linear, State, deflect
from fe.mesh import Mesh, default_mesh, grid
from fe.modes import Modes, modes
from fe.plate import Patch, Plate, Touch

__all__ = [
    "Adjoint",
    "Clamped",
    "DisplacementInfluence",
    "Edge",
    "Edges",
    "Elastic",
    "Free",
    "Influence",
    "Linear",
    "Mesh",
    "Modes",
    "Patch",
    "Plate",
    "State",
    "Supported",
    "Touch",
    "compliance",
    "default_mesh",
    "deflect",
    "displacement_influence",
    "grid",
    "influence",
    "modes",
]
