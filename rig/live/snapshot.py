"""What the live loop shows to people after a frame: plain data, made once and never changed."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from models import Estimate, Tap
    from rig.live.gestures import Gesture
    from rig.live.learned import Learned
    from rig.live.tracks import Event


@dataclass(frozen=True)
class Mark:
    """One touch as it is drawn: where, how hard and how sure.

    Attributes
    ----------
    x, y : float
        Place in the plate frame, mm.
    force : float
        Force into the plate, N.
    sigma : tuple of float
        1-sigma ellipse of the place: semi-axes, mm, mm, and the angle of the first axis from
        plate x towards plate y, rad. Zeros where the place is exact.
    sigma_force : float
        Standard deviation of the force, N.
    identity : int or None
        Number that stays with a touch from frame to frame, where it is tracked.
    velocity : tuple of float
        Along x and y, mm/s, as far as it is sure; zero where the touch is not tracked.
    force_interval : (float, float) or None, N
        Bounds of 95 % by this frame alone where `sigma_force` says too little, near an edge for
        instance: 0 where no force would do as well, infinite where nothing bounds it.
    """

    x: float
    y: float
    force: float
    sigma: tuple[float, float, float] = (0.0, 0.0, 0.0)
    sigma_force: float = 0.0
    identity: int | None = None
    velocity: tuple[float, float] = (0.0, 0.0)
    force_interval: tuple[float, float] | None = None

    @property
    def sigma_x(self) -> float:
        """Standard deviation of the place along x, mm."""
        long, short, angle = self.sigma
        return hypot(long * cos(angle), short * sin(angle))

    @property
    def sigma_y(self) -> float:
        """Standard deviation of the place along y, mm."""
        long, short, angle = self.sigma
        return hypot(long * sin(angle), short * cos(angle))


@dataclass(frozen=True)
class Sign:
    """A figure of a frame's quality: what it is, how it reads, and whether it is a warning."""

    name: str
    says: str
    warns: bool


@dataclass(frozen=True)
class Alarm:
    """A bound of the scene that is crossed.

    Attributes
    ----------
    kind : str
        "force", "silence", "disk" or "dropped", as the scene's [alarms] has it.
    time : float, s
        Capture of the frame in which it began.
    sentence : str
        What is so, and what to do. It follows the frames; the alarm stays the same one.
    """

    kind: str
    time: float
    sentence: str = field(compare=False)


@dataclass(frozen=True, eq=False)
class StrainOverlay:
    """Strain of the seen face on a grid of the camera image.

    Attributes
    ----------
    xs : (C,) float
        Columns of the grid, px.
    ys : (R,) float
        Rows of the grid, px.
    exx, eyy, exy : (R, C) float32
        Strain along image x and y, and tensor shear; NaN where there is none.
    sigma : tuple of float
        Median standard deviation of exx, eyy and exy, strain.
    """

    xs: NDArray[np.floating]
    ys: NDArray[np.floating]
    exx: NDArray[np.float32]
    eyy: NDArray[np.float32]
    exy: NDArray[np.float32]
    sigma: tuple[float, float, float]


@dataclass(frozen=True)
class StableShape:
    """A shape that a bent plate can rest in.

    Attributes
    ----------
    name : str
    energy : float, N mm
    verdict : str
        Name of what it is worth: "STABLE", "NEAR_LIMIT", where nobody can know whether the plate
        stays in it, or "OVERSTRAINED"; see `fe.Verdict`.
    shown : bool
        Whether the image shows it.
    """

    name: str
    energy: float
    verdict: str
    shown: bool


@dataclass(frozen=True)
class BaseReading:
    """What a frame says of a base that bends and twists.

    Attributes
    ----------
    bend, twist : float
        By which the clamps came nearer, mm, and turned against each other, degrees.
    sigma_bend, sigma_twist : float
        Their standard deviations by the noise of the frame, mm and degrees.
    eigenvalue : float
        Lowest eigenvalue of the stiffness in parts of that of the flat plate: 0 at a limit point.
    verdict : str
        Name of what the shape that is shown is worth, as that of a `StableShape`.
    outcome : str
        Name of what can be said of touches: "FOUND", "NO_TOUCH", or why they cannot be known.
    shapes : tuple of StableShape
        By energy.
    all_sought : bool
        Whether others than the one that is shown and its half turns were sought.
    """

    bend: float
    twist: float
    sigma_bend: float
    sigma_twist: float
    eigenvalue: float
    verdict: str
    outcome: str
    shapes: tuple[StableShape, ...]
    all_sought: bool


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Everything that the operator page and the projector show of one frame.

    Attributes
    ----------
    sequence : int
        Number of the frame, counted from the start of the loop.
    captured : float
        Capture time on the clock of the loop, s.
    image : (H, W) uint8
        Camera image.
    plate_size : tuple of float
        Sides of the plate along its x and y, mm.
    plate_outline : (N, 2) float
        Corners of the plate in the image, px, in order round the plate; points of the edges of one
        that is bent.
    T_px_plate : (3, 3) float
        Homography from the seen face (x, y, mm) to the image (x, y, px); of a bent one the nearest.
    touches : tuple of Mark
        Touches as all frames so far show them, smoothed; in the order of `estimate`.
    from_strain : tuple of Mark or None
        Touches found from strain alone; None where none are looked for in it.
    truth : tuple of Mark or None
        Touches that the source knows to be there; None where it cannot know.
    strain : StrainOverlay or None
        The strain map of this frame.
    status : str
        One sentence for the user.
    position_error, force_error : float or None
        Mean distance, mm, and mean absolute force difference, N, from the truth in this frame.
    position_error_median, force_error_median : float or None
        Running medians of the same, mm and N.
    fps : float
        Frames that the loop finishes in a second.
    dropped : int
        Frames lost since the start.
    stages : tuple of (str, float, float)
        Name of each stage of the loop with its median and 95th percentile, ms.
    latency : tuple of float
        Capture to touches, median and 95th percentile, ms.
    noise : float
        Standard deviation of the image's noise, grey levels.
    strain_reason : str
        Why `strain` is None, as a sentence for the user.
    fresh : bool
        Whether this is a new frame; else none came, and the last one stands for it.
    events : tuple of Event
        What appeared, moved and left in this frame.
    gestures : tuple of Gesture
        Those of the last second, the newest last.
    signs : tuple of Sign
        How good the frame is; none where no touch was looked for.
    estimate : models.Estimate or None
        What this frame alone shows; None where no touch was looked for.
    notice : str
        What was done at the user's wish, for a few seconds, as a sentence; mostly empty.
    learned : Learned or None
        How far the learning of the bench has come; None where the bench is exact.
    taps : tuple of Tap
        Touches of a plate followed in time that ended: their largest force, in the frame that says
        the last of it.
    recent_taps : tuple of Tap
        Those of the last second, the newest last.
    base : BaseReading or None
        Bend and twist; None of a flat plate, and while they are not known.
    late : float
        By which an image that is stored was read later than it was captured, s.
    alarms : tuple of Alarm
        Those that stand.
    """

    sequence: int
    captured: float
    image: NDArray[np.uint8]
    plate_size: tuple[float, float]
    plate_outline: NDArray[np.floating]
    T_px_plate: NDArray[np.floating]
    touches: tuple[Mark, ...]
    from_strain: tuple[Mark, ...] | None
    truth: tuple[Mark, ...] | None
    strain: StrainOverlay | None
    status: str
    position_error: float | None
    force_error: float | None
    position_error_median: float | None
    force_error_median: float | None
    fps: float
    dropped: int
    stages: tuple[tuple[str, float, float], ...]
    latency: tuple[float, float]
    noise: float
    strain_reason: str = ""
    fresh: bool = True
    events: tuple[Event, ...] = ()
    gestures: tuple[Gesture, ...] = ()
    signs: tuple[Sign, ...] = ()
    estimate: Estimate | None = None
    notice: str = ""
    learned: Learned | None = None
    taps: tuple[Tap, ...] = ()
    recent_taps: tuple[Tap, ...] = ()
    base: BaseReading | None = None
    late: float = 0.0
    alarms: tuple[Alarm, ...] = ()

    @property
    def time(self) -> float:
        """Capture time, s on the monotonic clock."""
        return self.captured

    @property
    def given(self) -> float:
        """When the loop could have the image, s on the monotonic clock."""
        return self.captured + self.late
