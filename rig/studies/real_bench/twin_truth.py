"""The bench of the scene `bench-real` under touches of any script."""

from __future__ import annotations

from dataclasses import dataclass, field

import fe
import rig
from rig.sources.real_twin import RealTwin
from rig.sources.twin import open_play
from rig.system.arrays import F64, Grey

SCENE = "bench-real"


@dataclass(frozen=True, eq=False)
class TwinTruth:
    """A twin that is pressed where one wants; see `rig.studies.real_bench.session.Photographer`.

    Attributes
    ----------
    twin : RealTwin
    seed : int
        Of places, forces and labels.
    solved : dict
        Displacement (K, 3) mm under the touches of the last image.
    """

    twin: RealTwin
    seed: int
    solved: dict[tuple[fe.Touch, ...], F64] = field(default_factory=dict[tuple[fe.Touch, ...], F64])

    def reference(self, number: int) -> Grey:
        """Photograph the untouched plate."""
        return self.held((), None, number)

    def held(self, touches: tuple[fe.Touch, ...], before: F64 | None, number: int) -> Grey:
        """Photograph the touched plate; `before` is what moved it last, (K, 3) mm."""
        plate = self.twin.states.plate
        moved = plate.at_rest + self._pressed(touches)
        if before is not None:
            moved = moved + self.twin.departure.leftover * before
        return self.twin.photograph(moved, number)

    def left(self, touches: tuple[fe.Touch, ...]) -> F64 | None:
        """Compute what touches move, where the plate keeps a part of it."""
        return self._pressed(touches) if self.twin.departure.leftover else None

    def _pressed(self, touches: tuple[fe.Touch, ...]) -> F64:
        if touches not in self.solved:
            self.solved.clear()
            self.solved[touches] = self.twin.states.plate.pressed(touches)
        return self.solved[touches]


def twin_truth(seed: int, script: str = "tour") -> TwinTruth:
    """Build the twin of the scene.

    Raises
    ------
    ValueError
        If the scene has no departure.
    """
    twin = open_play(rig.load(SCENE, {"source.script": script}))
    if not isinstance(twin, RealTwin):
        raise ValueError(f"scene '{SCENE}' has no source.departure; write one")
    return TwinTruth(twin, seed)
