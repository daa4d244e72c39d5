"""Guides that look at a board: for the lens from many sides, for the pose from where it lies."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from rig.calibration.board import BoardView, CharucoBoard, lying_at, on_plate
from rig.calibration.guide import Progress
from rig.calibration.lens import FEWEST, Lens, calibrate_lens
from rig.calibration.pose import Pose, find_pose
from rig.projector.content import Content
from rig.system.frame import Frame

STILL = 1.0  # px by which corners may move from frame to frame: more blurs them
APART = 0.015  # of the image's width, by which a new view must differ: a tilt of 30° makes 0.025
VIEWS = 10  # of a lens
SERIES = 10  # frames whose mean gives a pose
CORNERS = 0.4  # of the board's corners that a view must show
MIRRORED = (
    "the board is seen in a mirror; switch off the camera's mirror image, or let it look at the"
    " board itself"
)


@dataclass
class LensGuide:
    """Takes views of a board by itself, whenever it is held still in a new way.

    Parameters
    ----------
    board : CharucoBoard
    wanted : int
        Number of views.
    """

    board: CharucoBoard
    wanted: int = VIEWS
    _views: dict[int, BoardView] = field(default_factory=dict[int, BoardView])
    _last: BoardView | None = None
    _size: tuple[int, int] = (0, 0)
    _lens: Lens | None = None
    _says: str = "hold the board before the camera"

    @property
    def progress(self) -> Progress:
        """See `Guide`."""
        views = tuple((name, f"{len(view.mm)} corners") for name, view in self._views.items())
        error = self._lens.error if self._lens else None
        return Progress(self._says, len(self._views), self.wanted, error, views)

    @property
    def shows(self) -> Content:
        """See `Guide`."""
        return ()

    def add_frame(self, frame: Frame) -> None:
        """See `Guide`."""
        view, last = self.board.find(frame.image), self._last
        self._last, self._size = view, (frame.image.shape[1], frame.image.shape[0])
        if view is None and self.board.is_mirrored(frame.image):
            self._says = MIRRORED
        elif view is None or len(view.mm) < CORNERS * len(self.board.corners):
            self._says = "hold the whole board before the camera"
        elif last is None or _moved(view, last) > STILL:
            self._says = "hold the board still"
        elif any(_moved(view, one) < APART * self._size[0] for one in self._views.values()):
            self._says = "now tilt the board to another side, or hold it elsewhere in the image"
        else:
            self._views[max(self._views, default=-1) + 1] = view
            self._says = "taken; now tilt the board to another side"
            self._fit()

    def drop(self, view: int) -> None:
        """See `Guide`."""
        self._views.pop(view, None)
        self._fit()

    def result(self) -> Lens | None:
        """See `Guide`."""
        return self._lens if len(self._views) >= self.wanted else None

    def _fit(self) -> None:
        """Fit the lens to what is there; views that do not fit are dropped at once."""
        self._lens = None
        if len(self._views) < FEWEST:
            return
        try:
            self._lens = calibrate_lens(list(self._views.values()), self._size)
        except ValueError as error:
            self._says = str(error)
            return
        names = list(self._views)
        for bad in self._lens.left_out:
            del self._views[names[bad]]


@dataclass
class PoseGuide:
    """Finds the plate from a board that lies on it, as the mean of a series of frames.

    Parameters
    ----------
    lens : Lens
    board : CharucoBoard
    at : (x, y), mm
        Where the printed top left corner lies on the plate, see `lying_at`.
    height : float, mm
        Of the seen face over the middle plane: negative for the underside.
    """

    lens: Lens
    board: CharucoBoard
    at: tuple[float, float]
    height: float
    wanted: int = SERIES
    _views: list[BoardView] = field(default_factory=list[BoardView])
    _says: str = "lay the board on the plate"

    @property
    def progress(self) -> Progress:
        """See `Guide`."""
        return Progress(self._says, len(self._views), self.wanted)

    @property
    def shows(self) -> Content:
        """See `Guide`."""
        return ()

    def add_frame(self, frame: Frame) -> None:
        """See `Guide`."""
        view = self.board.find(frame.image)
        if view is None:
            mirrored = self.board.is_mirrored(frame.image)
            self._views = []
            self._says = (
                MIRRORED if mirrored else "lay the board on the plate, in view of the camera"
            )
            return
        self._says = "leave the board alone"
        if self._views and _moved(view, self._views[-1]) > STILL:
            self._views = []
        self._views.append(view)

    def drop(self, view: int) -> None:
        """See `Guide`; the series begins anew."""
        self._views = []

    def result(self) -> Pose | None:
        """See `Guide`."""
        if len(self._views) < self.wanted:
            return None
        laid = lying_at(self.at, self.height)
        return find_pose(self.lens, on_plate([(_mean(self._views), laid)], self.height))


def _moved(one: BoardView, other: BoardView) -> float:
    """RMS distance of the corners that both views show, px; infinite if they share none."""
    pairs = _shared(one, other)
    if not len(pairs[0]):
        return float("inf")
    away = one.px[pairs[0]] - other.px[pairs[1]]
    return float(np.sqrt(np.square(away).sum(axis=1).mean()))


def _shared(one: BoardView, other: BoardView) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the same corners in two views."""
    here, there = np.nonzero((one.mm[:, None] == other.mm[None]).all(axis=2))
    return here, there


def _mean(views: list[BoardView]) -> BoardView:
    """Mean of the corners that all views show."""
    mm, total, seen = views[0].mm, views[0].px.copy(), np.ones(len(views[0].mm))
    for view in views[1:]:
        here, there = _shared(views[0], view)
        total[here] += view.px[there]
        seen[here] += 1
    every = seen == len(views)
    return BoardView(mm[every], total[every] / len(views))
