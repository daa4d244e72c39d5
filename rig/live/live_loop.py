"""What every live loop can do, whatever the plate."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Protocol

from rig.live.pace import Pace
from rig.live.snapshot import Snapshot
from rig.system.timing import Stopwatch

if TYPE_CHECKING:
    from models import BenchEstimate
    from rig.live.learned import Learned

Progress = Callable[[int, int, Snapshot], object]
"""Called as ``progress(done, total, snapshot)`` while the loop gets ready."""


def to_nobody(done: int, total: int, snapshot: Snapshot) -> None:
    """Report to nobody."""


class LiveLoop(Protocol):
    """A loop on a source: iterate over it for the snapshots.

    Attributes
    ----------
    pace : Pace
        How many frames it took, and how fast.
    watch : Stopwatch
        Of its stages.
    """

    pace: Pace
    watch: Stopwatch

    def __iter__(self) -> Iterator[Snapshot]:
        """Yield a snapshot a frame until the source ends."""
        ...

    @property
    def learned(self) -> Learned | None:
        """How far the learning of the bench has come; None where nothing is learned."""
        ...

    @property
    def known(self) -> BenchEstimate | None:
        """What is known of the bench; None where it counts as exact."""
        ...

    def get_ready(self, progress: Progress = to_nobody) -> object:
        """Take the reference and do what takes time before the first frame."""
        ...

    def tare(self) -> None:
        """Take the plate as it is for untouched."""
        ...

    def weigh(self, force: float) -> None:
        """Take the touch that is held next as a known weight, N."""
        ...

    def summary(self) -> dict[str, Any]:
        """Figures of the run so far, ready for JSON."""
        ...
