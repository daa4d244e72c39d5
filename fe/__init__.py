"""Plate mechanics: plate and touches in; displacement and strain out."""

from fe.influence import Influence, influence
from fe.linear import Linear, State, deflect
from fe.mesh import Mesh, default_mesh
from fe.modes import Modes, modes
from fe.plate import Clamped, Plate, Touch

__all__ = [
    "Clamped",
    "Influence",
    "Linear",
    "Mesh",
    "Modes",
    "Plate",
    "State",
    "Touch",
    "default_mesh",
    "deflect",
    "influence",
    "modes",
]
