"""Where a frame begins that follows no touches: the touch net in the place of a search."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.scene import Scene
from rig.scene.sensing import PatternEstimator
from rig.system.arrays import F64, Mask

if TYPE_CHECKING:
    import models

HIDDEN = "part of the pattern is hidden, and the touch net knows the whole pattern only"


@dataclass(frozen=True, eq=False)
class TouchStart:
    """A touch net before the pattern of a reference.

    Attributes
    ----------
    reader : models.TouchReader
    """

    reader: models.TouchReader


def touch_net_of(scene: Scene, theory: str, *, exact: bool) -> models.TouchNet | None:
    """Return the touch net that a scene names.

    Raises
    ------
    ValueError
        The scene's plate is none that a touch net knows, or the net is damaged.
    FileNotFoundError
        There is no such net.
    """
    estimator = scene.estimator
    if not isinstance(estimator, PatternEstimator) or estimator.start == "search":
        return None
    beyond = "" if theory == "linear" else "large deflection (plate.theory)"
    beyond = beyond if exact else "an uncertain bench (estimator.bench, or its calibration)"
    beyond = "a plate in time ([dynamics])" if scene.dynamics else beyond
    if beyond:
        raise ValueError(
            f"estimator.start is '{estimator.start}', and touch nets know plates of linear theory"
            f" at rest, not {beyond}; set estimator.start to 'search'"
        )
    from models import load_touch_net, shipped_touch_net

    return shipped_touch_net() if estimator.start == "net" else load_touch_net(estimator.start)


def prepare_start(net: models.TouchNet, estimator: models.Estimator) -> TouchStart:
    """Prepare a net for the pattern of a reference.

    Raises
    ------
    ValueError
        The net knows another plate or fewer touches, or the forward model is not linear.
    """
    from models import LinearForward, prepare_reader

    if not isinstance(estimator.forward, LinearForward):
        raise ValueError(
            f"a touch net reads a linear forward model, got a {type(estimator.forward).__name__};"
            " set estimator.start to 'search'"
        )
    return TouchStart(prepare_reader(net, estimator.forward, estimator.max_touches))


def begin(start: TouchStart | None, measured: F64, followed: F64, hidden: Mask) -> tuple[F64, str]:
    """Say where to begin: at touches that are followed (n, 3), or at those that the net proposes.

    Returns
    -------
    touches : (n, 3) float64, mm, mm, N
    reason : str
        Why the net proposes none, where it was asked and does not know.
    """
    if start is None or len(followed):
        return followed, ""
    if hidden.any():
        return followed, HIDDEN
    found = start.reader.read(measured)
    return found.start, found.reason
