"""A board before the twin's camera, so that a guided calibration can be rehearsed without a bench.

It is held still for a second, tilted to another side, and so on; or it lies on the plate. The truth
is the camera of the scene.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

import synthetic
from rig.calibration.board import CharucoBoard
from rig.system.arrays import F32, F64, AnyArray

HOLD = 1.2  # s that the board is held in one way
FINE = 8.0  # px per mm of the drawn board: about four for each of the camera's
TABLE = 0.35  # what lies round the board, between black and white
TILTS = (
    (0, 0), (30, 0), (-30, 0), (0, 30), (0, -30), (22, 22), (-22, 22), (22, -22), (-22, -22),
    (35, 0), (0, 35), (-35, 0), (0, -35), (15, 30), (-15, -30),
)  # fmt: skip
"""Turns about x and y, degrees, one after the other."""
ASIDE = 0.4  # of the board's sides by which it is held off the middle, towards where it tilts


@dataclass(frozen=True, eq=False)
class HeldBoard:
    """A board in the hand, or on the plate.

    Attributes
    ----------
    board : CharucoBoard
    camera : synthetic.Camera
    middle : (3,) float64, mm
        Where the middle of the board is, in the frame of the plate.
    tilts : tuple of (x, y), degrees
        In which it is held, one after the other.
    """

    board: CharucoBoard
    camera: synthetic.Camera
    middle: F64
    tilts: tuple[tuple[float, float], ...] = TILTS
    _drawn: dict[int, F32] = field(default_factory=dict[int, F32])

    def light(self, time: float) -> F32:
        """Return what the camera sees, (H, W) from 0 to 1, as it begins anew for each exposure."""
        turn = int(time / HOLD) % len(self.tilts)
        if turn not in self._drawn:
            self._drawn[turn] = self._seen(*self.tilts[turn])
        return self._drawn[turn].copy()

    def _seen(self, about_x: float, about_y: float) -> F32:
        """Look each pixel up in the drawn board, through the lens and at the tilt."""
        width, height = self.camera.size
        columns, rows = np.meshgrid(np.arange(width), np.arange(height))
        pixels = np.stack([columns, rows], axis=-1).reshape(-1, 2)
        pose = self.camera.T_cam_plate @ self._pose(about_x, about_y)
        held = replace(self.camera, T_cam_plate=pose)
        places = held.on_plate(pixels.astype(np.float64), 0.0)
        a, b = self.board.size
        down = np.column_stack([places[:, 0] + a / 2, b / 2 - places[:, 1]]) * FINE - 0.5
        x, y = (part.reshape(height, width) for part in down.T.astype(np.float32))
        sharp = self.board.draw(FINE).astype(np.float32) / 255
        drawn: AnyArray = cv2.GaussianBlur(sharp, (0, 0), 2)
        seen = cv2.remap(drawn, x, y, cv2.INTER_LINEAR, borderValue=TABLE)
        return np.asarray(seen, dtype=np.float32)

    def _pose(self, about_x: float, about_y: float) -> F64:
        """From the board, with its origin in its middle and y up, to the plate."""
        x, y = np.radians(about_x), np.radians(about_y)
        turn_x = np.array([[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]])
        turn_y = np.array([[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]])
        aside = ASIDE * np.array([np.sin(y), np.sin(x), 0.0]) * np.array([*self.board.size, 0.0])
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = turn_x @ turn_y, aside
        lying = np.eye(4)
        lying[:3, 3] = self.middle
        if self.camera.face == "bottom":  # the print looks down: half a turn about y
            lying[[0, 2], [0, 2]] = -1.0
        return lying @ T


def held_before(camera: synthetic.AnyCamera, plate: tuple[float, float]) -> HeldBoard:
    """Return a board that is held before a camera, over the middle of the plate.

    Raises
    ------
    ValueError
        If the camera is none that has a lens to be found, or the plate is smaller than the board.
    """
    middle = np.array([plate[0] / 2, plate[1] / 2, 0.0])
    return HeldBoard(_board(plate), _pinhole(camera), middle)


def lying_on(camera: synthetic.AnyCamera, plate: tuple[float, float], height: float) -> HeldBoard:
    """Return a board that lies in the middle of the plate's seen face, at `height` mm."""
    middle = np.array([plate[0] / 2, plate[1] / 2, height])
    return HeldBoard(_board(plate), _pinhole(camera), middle, ((0.0, 0.0),))


def _board(plate: tuple[float, float]) -> CharucoBoard:
    board = CharucoBoard()
    if board.size[0] > plate[0] or board.size[1] > plate[1]:
        raise ValueError(
            f"board of {board.size[0]:g} × {board.size[1]:g} mm does not fit on the plate of"
            f" {plate[0]:g} × {plate[1]:g} mm; rehearse with a larger plate.size"
        )
    return board


def _pinhole(camera: synthetic.AnyCamera) -> synthetic.Camera:
    if not isinstance(camera, synthetic.Camera):
        raise ValueError('camera has no lens to be calibrated; set camera.kind to "pinhole"')
    return camera
