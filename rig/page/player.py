"""A recording on the page: what was seen and found then, played, paused and sought through."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dic import lay_tiles
from rig.calibration.store import parse
from rig.live.snapshot import Mark, Snapshot, StrainOverlay
from rig.live.view import marks, plate_view, true_marks
from rig.page.controls import PageControls, PageSetting, Played
from rig.page.server import Publisher
from rig.recording.fit import recorded_sentence
from rig.recording.layout import LAST, there
from rig.recording.paths import SUFFIX, recordings
from rig.recording.session import Session, frame, open_session, reported
from rig.system.arrays import F64, AnyArray

RECORDING = "recording"  # what the page calls the choice among recordings
UNKNOWN = (math.inf, math.inf, 0.0)  # σ of touches from strain is not recorded
NOT_KNOWN = math.nan, math.nan, math.nan  # σ of strain is not either
WISHES = "play", "seek", "set"
PACE = 1.0 / 30.0  # s between looks at what is asked for
AGAIN = 0.25  # s after which a frame that stands still is given again: the page waits for one


@dataclass(frozen=True, eq=False)
class Player:
    """Where a recording is played at a time of the clock.

    Attributes
    ----------
    times : (N,) float64, s
        Of the frames, from the first on.
    begun : float, s
        Place in the recording
    clock : float, s
        when the clock showed this.
    running : bool
    """

    times: F64
    begun: float = 0.0
    clock: float = 0.0
    running: bool = True

    @property
    def length(self) -> float:
        """Time of the last frame, s."""
        return float(self.times[-1])

    def seconds(self, clock: float) -> float:
        """Place at a time of the clock, s; it stays at the end."""
        gone = clock - self.clock if self.running else 0.0
        return min(self.begun + gone, self.length)

    def index(self, clock: float) -> int:
        """Give the frame that is shown at a time of the clock."""
        return max(int(np.searchsorted(self.times, self.seconds(clock), "right")) - 1, 0)

    def toggled(self, clock: float) -> Player:
        """Pause, or play on; from the beginning where the end is reached."""
        at = self.seconds(clock)
        if at >= self.length:
            return replace(self, begun=0.0, clock=clock, running=True)
        return replace(self, begun=at, clock=clock, running=not self.running)

    def sought(self, seconds: float, clock: float) -> Player:
        """Go on from another place, s."""
        return replace(self, begun=min(max(seconds, 0.0), self.length), clock=clock)


class RecordedFrames:
    """Snapshots of an open recording: its frames, with what was found in them then.

    Parameters
    ----------
    session : Session

    Raises
    ------
    ValueError
        If the recording has no frame, or names no plate or camera.
    """

    def __init__(self, session: Session):
        scene = session.scene
        if not session.frames or scene.plate is None or scene.camera is None:
            raise ValueError(
                f"recording '{session.path}' has {session.frames} frames and cannot be shown; it"
                " needs one or more, and [plate] and [camera] in its scene"
            )
        height, width = session.reference.image.shape
        plate = scene.plate.build()
        camera = parse(session.calibration, "in the recording").camera()
        if camera is None or camera.size != (width, height):
            camera = scene.camera.build(scene.plate)
        self.session = session
        columns = session.columns()
        times, numbers = columns["frames/captured"], columns[LAST]
        self.times: F64 = times - times[0]
        self._left_out = numbers - numbers[0] - np.arange(len(numbers))
        self._size, self._view = plate.size, plate_view(plate, camera)
        self._tiles = lay_tiles((height, width), scene.dic.tile) if scene.dic else None

    def snapshot(self, index: int, captured: float) -> Snapshot:
        """Show a frame as if it were captured now, s on the monotonic clock.

        Raises
        ------
        OSError
            If that part of the file is damaged.
        """
        row = self.session.row(index)
        recorded, found = frame(row), reported(row)
        identities = row["touches/identity"][: found.count].tolist()
        named = zip(marks(found), identities, strict=True)
        count = "no touch" if not found.count else f"{found.count} found"
        return Snapshot(
            sequence=recorded.sequence,
            captured=captured,
            image=recorded.image,
            plate_size=self._size,
            plate_outline=self._view.outline,
            T_px_plate=self._view.T_px_plate,
            touches=tuple(replace(mark, identity=identity) for mark, identity in named),
            from_strain=_places(row),
            truth=None if recorded.truth is None else true_marks(recorded.truth),
            strain=self._strain(row),
            status=f"frame {index + 1} of {len(self.times)} in {self.session.path.name}:"
            f" {recorded_sentence(row) or count}",
            position_error=None,
            force_error=None,
            position_error_median=None,
            force_error_median=None,
            fps=(len(self.times) - 1) / max(float(self.times[-1]), 1e-9),
            dropped=int(self._left_out[index]),
            stages=(),
            latency=(math.nan, math.nan),
            noise=self.session.reference.noise,
            strain_reason="it was not recorded",
        )

    def _strain(self, row: dict[str, AnyArray]) -> StrainOverlay | None:
        strain, tiles = row.get("frames/strain"), self._tiles
        if strain is None or tiles is None or strain.shape[:2] != tiles.shape:
            return None
        centres = tiles.xy.reshape(*tiles.shape, 2)
        exx, eyy, exy = np.moveaxis(np.asarray(strain, dtype=np.float32), -1, 0)
        return StrainOverlay(centres[0, :, 0], centres[:, 0, 1], exx, eyy, exy, NOT_KNOWN)


def _places(row: dict[str, AnyArray]) -> tuple[Mark, ...] | None:
    found = row.get("touches/from_strain")
    if found is None:
        return None
    return tuple(Mark(x, y, force, UNKNOWN, math.inf) for x, y, force in there(found).tolist())


class PagePlayer:
    """Plays the recordings of a folder on a page, until an exception such as Ctrl-C ends it.

    Parameters
    ----------
    publisher : Publisher
    clock, sleep : callable
        Monotonic time, s, and what waits for a while.
    """

    def __init__(
        self,
        publisher: Publisher,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
    ):
        self._publisher, self._clock, self._sleep = publisher, clock, sleep
        publisher.takes = WISHES
        self._notes: tuple[str, ...] = ()

    def play(self, path: Path) -> None:
        """Play a recording, then whichever of its folder is chosen; see `open_session`."""
        before: Path | None = None
        while True:
            try:
                with open_session(path) as session:
                    self._notes += (session.cut,) if session.cut else ()
                    before, path = path, self._play(RecordedFrames(session))
                    self._notes = ()
            except (OSError, ValueError) as error:
                if before is None:
                    raise
                self._notes, path, before = (str(error),), before, None

    def _play(self, frames: RecordedFrames) -> Path:
        """Play until another recording is chosen, and return its path."""
        path = frames.session.path
        names = recordings(path.parent)
        player = Player(frames.times, clock=self._clock())
        snapshot, shown, given = frames.snapshot(0, self._clock()), 0, -AGAIN
        while True:
            for wish in self._publisher.asked():
                player = _followed(player, wish, self._clock())
                if wish.get("key") == RECORDING and wish.get("value") in names:
                    return path.parent / str(wish["value"])
            now = self._clock()
            if player.index(now) != shown or now - given > AGAIN:
                shown, given = player.index(now), now
                snapshot = self._snapshot(frames, shown, replace(snapshot, captured=now))
                self._publisher.publish(snapshot, self._controls(player, now, path, names))
            self._sleep(PACE)

    def _snapshot(self, frames: RecordedFrames, index: int, last: Snapshot) -> Snapshot:
        """Show a frame; where it is damaged a note says so, and the last one stays."""
        try:
            return frames.snapshot(index, last.captured)
        except OSError as error:
            self._notes = (str(error),)
            return last

    def _controls(
        self, player: Player, now: float, path: Path, names: tuple[str, ...]
    ) -> PageControls:
        at = player.seconds(now)
        choice = PageSetting(RECORDING, "Recording", path.name, names)
        played = Played(at, player.length, player.running and at < player.length)
        return PageControls(self._notes, settings=(choice,), played=played)


def _followed(player: Player, wish: dict[str, Any], clock: float) -> Player:
    match wish:
        case {"do": "play"}:
            return player.toggled(clock)
        case {"do": "seek", "to": int() | float() as seconds} if math.isfinite(seconds):
            return player.sought(float(seconds), clock)
        case _:
            return player


def newest(folder: Path) -> Path:
    """Return the newest recording of a folder.

    Raises
    ------
    OSError
        If there is none.
    """
    for name in recordings(folder):
        return folder / name
    raise OSError(f"folder '{folder}' holds no recording *{SUFFIX}; make one with --record")
