"""The account of a scene: what is in and what it costs, what is left out and why.

Nothing is built but a coarse plate where forces are expected, to say which theory they need.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rig.scene.counts import tiles
from rig.scene.parts import Part, describe
from rig.scene.scene import Scene
from rig.scene.section import Section
from rig.scene.sensing import PatternEstimator, StrainEstimator
from rig.scene.source import TwinSection
from rig.scene.theory import Theory, choose, largest_force

if TYPE_CHECKING:
    from fe import LinearRange


REDUCED = Part(
    "reduced plate",
    "large deflection at a live pace",
    "made once, in half a minute, and kept in the cache; milliseconds a frame",
    ("fe", "models"),
)
IN_MODES = Part(
    "plate in modes",
    "large deflection, and what is not known of the bench",
    "made once, in half a minute, and kept in the cache; some milliseconds a touch",
    ("fe", "models"),
)


ON_BASE = Part(
    "shapes of the base",
    "bend, twist and branch from the image, and the response to touches there",
    "shapes over the range made once, in a minute, and kept in the cache; a response in seconds,"
    " beside the loop",
    ("fe", "models"),
)


@dataclass(frozen=True)
class LeftOut:
    """A part that is not in, and why."""

    name: str
    why: str


@dataclass(frozen=True)
class Account:
    """What a scene contains and what it leaves out.

    Attributes
    ----------
    theory : {"linear", "large"} or None
        Theory of deflection that is taken; None without a plate.
    regime : LinearRange or None
        What the largest force does to the plate; None where no forces are expected.
    """

    title: str
    parts: tuple[Part, ...]
    left_out: tuple[LeftOut, ...]
    theory: str | None
    regime: LinearRange | None


def account(scene: Scene) -> Account:
    """Return the account of a scene.

    Raises
    ------
    ValueError
        If forces are expected on a plate that its edges do not hold.
    """
    named = [(name, getattr(scene, name)) for name in type(scene).model_fields]
    parts = tuple(describe(name, s, scene) for name, s in named if isinstance(s, Section))
    absent = tuple(name for name, section in named if section is None)
    theory = choose(scene, scene.plate, largest_force(scene)) if scene.plate else None
    left_out = _left_out(scene, absent, theory)
    if theory is None:
        return Account(scene.title, parts, left_out, None, None)
    return Account(
        scene.title, parts + _mechanics(scene, theory), left_out, theory.name, theory.regime
    )


def made_of_plate(scene: Scene) -> str:
    """Name what the live loop makes of a plate before its first frame."""
    theory = choose(scene, scene.plate, largest_force(scene)) if scene.plate else None
    parts = _mechanics(scene, theory) if theory else ()
    return parts[0].name if parts else "plate modes"


def _mechanics(scene: Scene, theory: Theory) -> tuple[Part, ...]:
    """List what the live loop needs of the plate beside its modes."""
    match scene.estimator:
        case PatternEstimator() if scene.base is not None:
            return (ON_BASE,)
        case PatternEstimator(bench="usual"):
            return (IN_MODES,)
        case PatternEstimator() if theory.name == "large":
            return (REDUCED,)
        case _:
            return ()


def _left_out(scene: Scene, absent: tuple[str, ...], theory: Theory | None) -> tuple[LeftOut, ...]:
    left = [LeftOut(name, "the scene names none") for name in absent]
    if theory:
        other = "large deflection" if theory.name == "linear" else "linear theory"
        left.append(LeftOut(other, theory.warning + theory.sentence))
    if scene.touches and scene.touches.max_touches == 1:
        left.append(LeftOut("counting of touches", "one touch at a time is expected"))
    if scene.dic:
        if not (scene.gauges and scene.gauges.subset):
            why = f"sums over {tiles(scene.dic, scene)} tiles keep what the pixels know"
            left.append(LeftOut("subset matching", why))
        if not isinstance(scene.comparison, StrainEstimator):
            left.append(LeftOut("strain map", "the scene names no [comparison] by strain"))
    nets = [e.kind for e in (scene.estimator, scene.comparison) if e]
    if "net" not in nets and not (scene.field_net or scene.image_net or scene.touch_net):
        left.append(LeftOut("torch", "no net in this scene"))
    if scene.camera and scene.camera.kind == "telecentric":
        left.append(
            LeftOut("out-of-plane terms", "a telecentric camera sees no motion along its view")
        )
    if isinstance(scene.source, TwinSection):
        left.append(LeftOut("camera device", "images are rendered"))
    return tuple(left)
