"""The camera's lens from views of a board: focal length, middle and distortion, by OpenCV."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

import synthetic
from rig.calibration.board import BoardView
from rig.system.arrays import F64, AnyArray

FEWEST = 4  # views
_NUMBERS = 8  # of a lens
FAR = 3.0  # times the median: a view whose residual is larger was blurred or bent


@dataclass(frozen=True, eq=False)
class Lens:
    """What a camera does to rays, wherever it stands.

    Attributes
    ----------
    size : (width, height), px
    focal : float, px
    centre : (x, y), px
    distortion : synthetic.Distortion
    sigma_focal : float, px
        Standard deviation.
    residual : float, px
        RMS distance of the corners from where the model has them.
    error : float, mm
        The same on the board, seen straight at the views' median distance.
    left_out : tuple of int
        Views that do not fit the others.
    covariance : (8, 8) float64, optional
        Of the ln of the focal length, the middle, px, and k1, k2, p1, p2, k3; None where it is not
        known.
    """

    size: tuple[int, int]
    focal: float
    centre: tuple[float, float]
    distortion: synthetic.Distortion
    sigma_focal: float
    residual: float
    error: float
    left_out: tuple[int, ...]
    covariance: F64 | None = None

    @property
    def matrix(self) -> F64:
        """Camera matrix (3, 3), px."""
        return np.array(
            [[self.focal, 0, self.centre[0]], [0, self.focal, self.centre[1]], [0, 0, 1.0]]
        )

    @property
    def coefficients(self) -> F64:
        """k1, k2, p1, p2, k3."""
        d = self.distortion
        return np.array([d.k1, d.k2, d.p1, d.p2, d.k3])

    def camera(self, T_cam_plate: F64) -> synthetic.Camera:
        """Return the camera with this lens at a pose."""
        return synthetic.Camera(self.size, self.focal, self.centre, T_cam_plate, self.distortion)


def calibrate_lens(
    views: list[BoardView], size: tuple[int, int], left_out: tuple[int, ...] = ()
) -> Lens:
    """Fit a lens to views of a board, from several sides and distances.

    Parameters
    ----------
    views : list of BoardView
    size : (width, height), px
    left_out : tuple of int
        Views that are not to be used.

    Raises
    ------
    ValueError
        If fewer than four views are left, or they cannot be fitted.
    """
    while True:
        used = [index for index in range(len(views)) if index not in left_out]
        if len(used) < FEWEST:
            raise ValueError(
                f"a lens needs {FEWEST} good views of the board or more, got {len(used)}; take"
                " some with the board tilted"
            )
        lens, by_view = _fit([views[index] for index in used], size, left_out)
        far = FAR * float(np.median(by_view))
        bad = tuple(index for index, rms in zip(used, by_view, strict=True) if rms > far)
        if not bad:
            return lens
        left_out = tuple(sorted((*left_out, *bad)))


def _fit(
    views: list[BoardView], size: tuple[int, int], left_out: tuple[int, ...]
) -> tuple[Lens, F64]:
    boards = [np.column_stack([v.mm, np.zeros(len(v.mm))]).astype(np.float32) for v in views]
    start = np.array([[size[0], 0, size[0] / 2], [0, size[0], size[1] / 2], [0, 0, 1.0]])
    flags = cv2.CALIB_FIX_ASPECT_RATIO | cv2.CALIB_USE_INTRINSIC_GUESS
    try:
        rms, matrix, bent, turns, places, _, _, by_view = cv2.calibrateCameraExtended(
            boards, [v.px.astype(np.float32) for v in views], size, start, np.zeros(5), flags=flags
        )
    except cv2.error as error:
        raise ValueError(
            "the views of the board determine no lens; take some with the board tilted"
        ) from error
    focal = float(matrix[0, 0])
    distance = float(np.median([abs(float(np.ravel(place)[2])) for place in places]))
    # OpenCV's own σ of fx is 0 where fy alone is fitted.
    covariance = _covariance(boards, turns, places, matrix, bent, float(rms))
    k1, k2, p1, p2, k3 = np.ravel(bent)[:5].tolist()
    lens = Lens(
        size=size,
        focal=focal,
        centre=(float(matrix[0, 2]), float(matrix[1, 2])),
        distortion=synthetic.Distortion(k1, k2, p1, p2, k3),
        sigma_focal=focal * float(np.sqrt(covariance[0, 0])),
        residual=float(rms),
        error=float(rms) * distance / focal,
        left_out=left_out,
        covariance=covariance,
    )
    return lens, np.asarray(by_view, dtype=np.float64).ravel()


def _covariance(
    boards: Sequence[AnyArray],
    turns: Sequence[AnyArray],
    places: Sequence[AnyArray],
    matrix: AnyArray,
    bent: AnyArray,
    rms: float,
) -> F64:
    """Covariance (8, 8) of a lens whose views may each lie anywhere, see `Lens.covariance`."""
    lens, focal, points = slice(6, None), float(matrix[0, 0]), sum(len(board) for board in boards)
    normal = np.zeros((_NUMBERS, _NUMBERS))
    for board, turn, place in zip(boards, turns, places, strict=True):
        by = cv2.projectPoints(board, turn, place, matrix, bent)[1]
        by = np.asarray(by, dtype=np.float64)[:, : 10 + 5]
        by = np.column_stack([by[:, :6], focal * (by[:, 6] + by[:, 7]), by[:, 8:]])
        basis = np.linalg.qr(by[:, :6])[0]
        free = by[:, lens] - basis @ (basis.T @ by[:, lens])
        normal += free.T @ free
    freedom = max(2 * points - _NUMBERS - 6 * len(boards), 1)
    unit = 1.0 / np.sqrt(np.diag(normal))
    even = np.linalg.pinv(normal * np.outer(unit, unit), hermitian=True)
    variance = rms**2 * points / freedom
    return np.asarray(variance * np.outer(unit, unit) * even, dtype=np.float64)
