"""Which theory of deflection a scene is computed with, and what that costs."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import TYPE_CHECKING, Literal

from rig.scene.plate import BaseSection, PlateSection
from rig.scene.scene import Scene

if TYPE_CHECKING:
    import fe
    from fe import LinearRange


FINGER = 5.0  # N, up to which a finger presses, where a scene names no forces


@dataclass(frozen=True)
class Theory:
    """The theory that a plate is computed with.

    Attributes
    ----------
    name : {"linear", "large"}
    regime : LinearRange or None
        What the largest force does to the flat plate; None where that does not decide.
    sentence : str
        What is taken, why, and how far linear theory is off, for the user.
    """

    name: Literal["linear", "large"]
    regime: LinearRange | None
    sentence: str

    @property
    def against(self) -> bool:
        """Whether linear theory is taken where it does not hold."""
        return self.name == "linear" and self.regime is not None and self.regime.theory == "large"

    @property
    def warning(self) -> str:
        """What to say first where linear theory is taken and does not hold; empty where it does."""
        return "needed, and left out all the same: " if self.against else ""

    @property
    def force(self) -> float:
        """Largest force that is expected, N."""
        return self.regime.force if self.regime else FINGER

    @property
    def limit(self) -> float:
        """Force of a touch beyond which linear theory is off by more than was accepted, N.

        That is 5 %, or what the scene insists on for the largest force that it expects; the error
        grows with the square of the force.
        """
        if self.name == "large" or self.regime is None:
            return inf
        from fe import LINEAR_TOLERANCE

        return self.regime.force * max(1.0, sqrt(LINEAR_TOLERANCE / max(self.regime.error, 1e-9)))

    def beyond(self, force: float) -> str:
        """Say what linear theory costs under a force beyond the limit; empty below."""
        if force <= self.limit or self.regime is None:
            return ""
        from fe import as_percent

        error = self.regime.error * (force / self.regime.force) ** 2
        off = as_percent(error)
        return f"{force:.2g} N is more than linear theory is good for; it is off by {off}"

    def overstrained(self, force: float) -> str:
        """Say that touches of so many newtons in all may strain the material beyond its limit.

        Empty where it bears them. Strain beside touches grows with the force at most: as the plate
        stretches, it gets stiffer. Under a touch itself it is not looked at.
        """
        demand = self.regime.demand * force / self.regime.force if self.regime else 0.0
        if demand <= 1.0:
            return ""
        return (
            f"{force:.3g} N may strain the material to {demand:.2g} times its limit, where the"
            " plate yields or breaks; press less"
        )


def choose(scene: Scene, plate: PlateSection, force: float | None) -> Theory:
    """Choose the theory for forces up to `force` N, unless the scene insists on one.

    Raises
    ------
    ValueError
        If the edges do not hold the plate, a patch leaves it, it is too thick for a theory without
        shear, or cannot be bent by the base.
    """
    if scene.base:
        _check_base(plate, scene.base)
        return Theory("large", None, "theory of large deflection: the plate is bent by its base")
    regime = None
    if force is not None:
        regime = _judge(plate.build(), force)
    name = plate.theory or (regime.theory if regime else "linear")
    return Theory(name, regime, _why(name, plate.theory is not None, regime))


def _check_base(plate: PlateSection, base: BaseSection) -> None:
    """Refuse a base that the plate cannot take."""
    import fe

    fe.check_base(plate.build(), base.build())


def _judge(plate: fe.Plate, force: float) -> LinearRange:
    """Regime of a touch, from the cache where it is there; reading it loads no mechanics."""
    import fe
    from rig.system import cache

    return fe.LinearRange.from_arrays(
        cache.fetch("regime", (fe, plate, force), lambda: fe.linear_range(plate, force).arrays())
    )


def _why(name: str, insisted: bool, regime: LinearRange | None) -> str:
    taken = {"linear": "linear theory", "large": "theory of large deflection"}[name]
    if insisted:
        taken += ", as the scene insists"
    if regime:
        return f"{taken}: {regime.sentence}"
    small = "" if insisted else ", so small ones are taken"
    return f"{taken}: the scene names no forces{small}"


def largest_force(scene: Scene) -> float | None:
    """Return the largest force that a scene expects at one place, N; None where it says nothing."""
    forces = [scene.touches.force[1]] if scene.touches else []
    if scene.dataset:
        forces.append(scene.dataset.largest)
    return max(forces, default=None)


def require_linear(scene: Scene, plate: PlateSection, force: float | None, what: str) -> Theory:
    """Return the theory of a scene for something that knows no other than the linear one.

    Raises
    ------
    ValueError
        If the plate is bent before it is touched, or linear theory is off by too much and the scene
        does not insist on it.
    """
    theory = choose(scene, plate, force)
    if scene.base:
        raise ValueError(
            f"scene '{scene.title}' has a bent plate, and {what} takes it as flat; leave [base] out"
        )
    if theory.name == "large":
        cost = f" ({theory.regime.sentence})" if theory.regime else ""
        raise ValueError(
            f"scene '{scene.title}' needs the theory of large deflection{cost}, and {what} has"
            " only the linear one; expect smaller forces, or set plate.theory to 'linear' and"
            " accept the error"
        )
    return theory
