"""Public names of `rig`: the one list, read by type checkers and by the lazy loader."""

from .calibration.store import (
    Calibration as Calibration,
    read_calibration as read_calibration,
)
from .live.snapshot import (
    Mark as Mark,
    Snapshot as Snapshot,
)
from .scene import (
    Scene as Scene,
    SceneError as SceneError,
    load as load,
)
from .sources.frame_pairs import (
    FramePair as FramePair,
    frame_pairs as frame_pairs,
)
from .sources.run import (
    LiveRun as LiveRun,
    run as run,
)
from .system.cache import CacheError as CacheError
from .system.version import __version__ as __version__
