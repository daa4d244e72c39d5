"""Large deformation: the rotation-free Kirchhoff-Love shell on the grid of the plate."""

from fe.shell.base import Base
from fe.shell.influence import ShellInfluence, shell_influence
from fe.shell.meshes import shell_mesh
from fe.shell.shell import Shell, solve
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
