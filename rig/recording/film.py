"""A recording as a film: the plate as the camera saw it, its strain, the touches found."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from rig.recording.layout import there
from rig.recording.session import Session
from rig.system.arrays import F64, AnyArray

SIDE = 480  # px of a panel
HEAD = 34  # px above the panels, for what they are
CODEC = "mp4v"
RED, BLUE, GREY = (60, 60, 230), (255, 170, 60), (110, 110, 110)  # BGR
TITLES = "camera", "strain exx, mean of the last frames", "touches: found (dots), pressed (ring)"
KEPT = 0.8  # of the mean strain from frame to frame, for that of one frame is mostly noise
SAMPLED = 40  # frames that the scale of the strain is taken from


def to_film(session: Session, folder: Path, report: Callable[[int, int], None]) -> list[Path]:
    """Write three panels side by side at the pace of the session.

    The third is what a projector would light on the plate: every touch that was found stays, the
    last one is larger; a ring stands where was pressed, if the source knew.

    Raises
    ------
    ValueError
        If the recording names no plate.
    OSError
        If the film cannot be written.
    """
    if session.scene.plate is None:
        raise ValueError(f"recording '{session.path}' names no plate; export it as video")
    path, captured = folder / "film.mp4", session.columns()["frames/captured"]
    seconds = float(captured[-1] - captured[0]) if len(captured) > 1 else 0.0
    rate = (len(captured) - 1) / seconds if seconds > 0 else 30.0
    size = (3 * SIDE, SIDE + HEAD)
    film = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*CODEC), rate, size)
    if not film.isOpened():
        raise OSError(f"film '{path}' cannot be written with codec {CODEC}; export as tiff")
    drawing = _Drawing(session, session.scene.plate.size)
    for index in range(session.frames):
        film.write(drawing.frame(session.row(index)))
        report(index + 1, session.frames)
    film.release()
    return [path]


class _Drawing:
    """What stays from frame to frame: the scale of the strain, and where touches were."""

    def __init__(self, session: Session, plate: tuple[float, float]) -> None:
        self.plate = plate
        self.scale = _scale(session)
        self.mean: F64 | None = None
        self.trail = np.zeros((SIDE, SIDE, 3), np.uint8)
        self.head = np.zeros((HEAD, 3 * SIDE, 3), np.uint8)
        for number, title in enumerate(TITLES):
            _write(self.head, title, (number * SIDE + 10, HEAD - 11))

    def frame(self, row: dict[str, AnyArray]) -> AnyArray:
        """Draw one frame, (H, W, 3) BGR."""
        found = self._places(row["touches/place"])
        true = self._places(row["frames/truth"]) if row["frames/truth_known"] else []
        image = cv2.cvtColor(cv2.resize(row["frames/image"], (SIDE, SIDE)), cv2.COLOR_GRAY2BGR)
        for place in found:
            cv2.circle(self.trail, place, 4, BLUE, -1, cv2.LINE_AA)
        last = self.trail.copy()
        for place in found:
            cv2.circle(last, place, 9, BLUE, -1, cv2.LINE_AA)
        for place in true:
            cv2.circle(last, place, 13, RED, 2, cv2.LINE_AA)
        panels = np.hstack([image, self._strain(row.get("frames/strain")), last])
        return np.vstack([self.head, panels])

    def _places(self, touches: AnyArray) -> list[tuple[int, int]]:
        """Places of touches in a panel; y points up on the plate."""
        x, y = self.plate
        side = SIDE / max(x, y)
        return [
            (round(float(place[0]) * side), round(SIDE - float(place[1]) * side))
            for place in there(touches)
        ]

    def _strain(self, strain: AnyArray | None) -> AnyArray:
        if strain is None:
            panel = np.zeros((SIDE, SIDE, 3), np.uint8)
            _write(panel, "not recorded", (SIDE // 3, SIDE // 2))
            return panel
        exx = np.nan_to_num(strain[..., 0].astype(np.float64))
        self.mean = exx if self.mean is None else KEPT * self.mean + (1.0 - KEPT) * exx
        grey = np.clip(127.5 * (1.0 + self.mean / self.scale), 0, 255).astype(np.uint8)
        shown = cv2.resize(grey, (SIDE, SIDE), interpolation=cv2.INTER_LINEAR)
        return cv2.applyColorMap(shown, cv2.COLORMAP_TWILIGHT_SHIFTED)


def _scale(session: Session) -> float:
    """Strain at both ends of the colours: what one tile in a hundred is above."""
    if "frames/strain" not in session.arrays or not session.frames:
        return 1.0
    chosen = np.unique(np.linspace(0, session.frames - 1, SAMPLED).astype(int))
    seen: list[F64] = [np.abs(session.row(int(n))["frames/strain"][..., 0]) for n in chosen]
    found = float(np.nanquantile(np.array(seen), 0.99))
    return found if found > 0 else 1.0


def _write(panel: AnyArray, text: str, place: tuple[int, int]) -> None:
    cv2.putText(panel, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.55, (230, 230, 230), 1, cv2.LINE_AA)
