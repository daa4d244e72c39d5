"""The projector: its window, where its light may fall, and what that light does to the strain.

`window` shows marks in a process of its own, `modes` says where they go, `light` takes what the
camera sees of them out of an image, `dark` lets only frames without light pass, and `interference`
says when light spoils the strain.
"""

from rig.projector.window import Projector, open_projector

__all__ = ["Projector", "open_projector"]
