"""A ChArUco board: a chessboard whose white squares carry markers, so that any part of it is known.

Its corners are found to 0.05 px; the corners of the markers alone only to half a pixel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.system.arrays import F64, AnyArray

FEWEST = 6  # corners of a view that is good for anything


@dataclass(frozen=True)
class CharucoBoard:
    """Squares along x and y, their side and that of the markers in them, mm; first marker."""

    squares: tuple[int, int] = (11, 8)
    square: float = 20.0
    marker: float = 15.0
    first: int = 0

    def __post_init__(self) -> None:
        if min(self.squares) < 3 or not 0 < self.marker < self.square:
            raise ValueError(
                f"board needs 3 × 3 squares or more with markers smaller than a square, got"
                f" {self.squares[0]} × {self.squares[1]} squares of {self.square:g} mm and markers"
                f" of {self.marker:g} mm; measure the printed board"
            )

    @property
    def size(self) -> tuple[float, float]:
        """Sides, mm."""
        return self.squares[0] * self.square, self.squares[1] * self.square

    @property
    def corners(self) -> NDArray[np.float64]:
        """Inner corners of the chessboard, (N, 2) mm, row by row, y downwards as on the print."""
        return np.asarray(self._board().getChessboardCorners(), dtype=np.float64)[:, :2]

    def draw(self, scale: float) -> NDArray[np.uint8]:
        """Image of the board, to print or to project, at `scale` px per mm."""
        width, height = (round(side * scale) for side in self.size)
        return np.asarray(self._board().generateImage((width, height)), dtype=np.uint8)

    def find(self, image: NDArray[np.uint8]) -> BoardView | None:
        """Find the corners that an image shows; None if these are fewer than `FEWEST`."""
        detector = cv2.aruco.CharucoDetector(self._board())
        px, names = cast(tuple[AnyArray | None, ...], detector.detectBoard(image))[:2]
        if px is None or names is None or len(names) < FEWEST:
            return None
        names = np.asarray(names, dtype=np.intp).ravel()
        return BoardView(self.corners[names], np.asarray(px, dtype=np.float64).reshape(-1, 2))

    def is_mirrored(self, image: NDArray[np.uint8]) -> bool:
        """Whether an image shows the board as a mirror does, which no camera may."""
        return self.find(np.ascontiguousarray(image[:, ::-1])) is not None

    def _board(self) -> Any:
        """Return OpenCV's board, which looks for no markers but its own: a tenth of the time."""
        count = self.squares[0] * self.squares[1] // 2
        every = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_1000)
        own = every.bytesList[self.first : self.first + count]
        markers = cv2.aruco.Dictionary(own, every.markerSize, every.maxCorrectionBits)
        names = np.arange(count)
        return cv2.aruco.CharucoBoard(self.squares, self.square, self.marker, markers, names)


@dataclass(frozen=True, eq=False)
class BoardView:
    """Corners that an image shows: on the board (N, 2) mm, and in the image (N, 2) px."""

    mm: NDArray[np.float64]
    px: NDArray[np.float64]


def lying_at(corner: tuple[float, float], height: float) -> F64:
    """Affine map (2, 3) from the mm of a board on the plate, its upper edge along the plate's x.

    Parameters
    ----------
    corner : (x, y), mm
        Of the plate, where the printed top left corner lies.
    height : float, mm
        Of the face it lies on: on the underside, where it is negative, x of the print runs against
        that of the plate.
    """
    return np.array([[np.copysign(1.0, height), 0.0, corner[0]], [0.0, -1.0, corner[1]]])


def on_plate(views: list[tuple[BoardView, ArrayLike]], height: float) -> BoardView:
    """Join boards that lie on a plate as patches: (N, 3) mm of the plate frame, and px.

    Parameters
    ----------
    views : list of (View, (2, 3) array)
        With each the affine map from its mm to plate x, y: a print's y runs down, the plate's up.
    height : float, mm
        Of the face they lie on over the middle plane: negative for the underside.
    """
    parts: list[F64] = []
    for view, given in views:
        T = np.asarray(given, dtype=np.float64)
        parts.append(view.mm @ T[:, :2].T + T[:, 2])
    mm = np.concatenate(parts)
    return BoardView(
        np.column_stack([mm, np.full(len(mm), height)]),
        np.concatenate([view.px for view, _ in views]),
    )
