"""Large deformation: the rotation-free Kirchhoff-Love shell on the grid of the plate."""

from fe.shell.base import Base
from fe.shell.influence import ShellInfluence, shell_influence
from fe.shell.shell import Shell, shell_mesh, solve
from fe.shell.stability import Stability, Verdict
from fe.shell.state import ShellState

__all__ = [
    "Base",
    "Shell",
    "ShellInfluence",
    "ShellState",
    "Stability",
    "Verdict",
    "shell_influence",
    "shell_mesh",
    "solve",
]
