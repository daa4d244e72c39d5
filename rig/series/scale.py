"""From pixels to millimetres: by two points, a board that lies there, or a camera over a plate."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

import dic
from rig.system.arrays import F64, AnyArray

if TYPE_CHECKING:
    import synthetic

SCALED = ("u_mm", "v_mm", "sigma_u_mm", "sigma_v_mm")
"""Fields of a frame that a test with a scale has too."""

_NUMBER = r"\s*([-+]?\d*\.?\d+)\s*"
_TWO_POINTS = re.compile(",".join([_NUMBER] * 4) + "=" + _NUMBER + r"mm\s*")
_FLAT = 1.0  # px, root mean square: what distortion leaves of a board that fills the image
_HALF = 0.5  # px, to either side for a slope


class Scale(Protocol):
    """Where what a pixel sees lies on the object."""

    @property
    def described(self) -> str:
        """What the scale was taken from, for the file."""
        ...

    def places(self, px: F64) -> F64:
        """Places (N, 2) mm of finite pixels (N, 2); ValueError where there is none."""
        ...


@dataclass(frozen=True)
class FlatImage:
    """An image that sees a plane straight on, through a lens or none.

    Attributes
    ----------
    mm_per_px : float
        In the middle of the lens.
    lens : synthetic.Camera or None
        Its distortion is taken out; its pose is not used.
    described : str
    """

    mm_per_px: float
    lens: synthetic.Camera | None
    described: str

    def places(self, px: F64) -> F64:
        """Places (N, 2) mm, x to the right and y downwards."""
        return straightened(px, self.lens) * self.mm_per_px


@dataclass(frozen=True)
class PlatePlane:
    """The plane z = 0 of a plate under a calibrated camera: lens and pose are taken out."""

    camera: synthetic.Camera
    described: str

    def places(self, px: F64) -> F64:
        """Places (N, 2) mm along the axes of the plate."""
        return self.camera.on_plate(px)


@dataclass(frozen=True, eq=False)
class BoardPlane:
    """The plane that a board lies on: perspective is taken out, and the lens where it is known.

    Attributes
    ----------
    to_mm : (3, 3) float64
        Homography from pixels of a lens without distortion, positive where the plane is seen.
    lens : synthetic.Camera or None
        Its distortion is taken out; its pose is not used.
    described : str
    """

    to_mm: F64
    lens: synthetic.Camera | None
    described: str

    def places(self, px: F64) -> F64:
        """Places (N, 2) mm along the sides of the board, x as its rows run, y from row to row."""
        mapped = _homogeneous(straightened(px, self.lens)) @ self.to_mm.T
        beyond = mapped[:, 2] <= 0
        if beyond.any():
            x, y = px[beyond][0]
            raise ValueError(
                f"({x:g}, {y:g}) px lies beyond the horizon of the board's plane; look at it less"
                " slantwise"
            )
        return mapped[:, :2] / mapped[:, 2:]


def board_plane(mm: F64, px: F64, lens: synthetic.Camera | None, name: str) -> BoardPlane:
    """Find the plane of a board from its corners (N, 2) mm and px; `name` is that of the image.

    Raises
    ------
    ValueError
        The corners stand in a line, or not in a plane.
    """
    import cv2

    if np.ptp(mm, axis=0).min() == 0:
        raise ValueError(f"'{name}' shows one row of the board's corners; show more of the board")
    seen = straightened(px, lens)
    to_px = np.asarray(cv2.findHomography(mm, seen)[0], dtype=np.float64)
    back = _homogeneous(mm) @ to_px.T
    off = float(np.sqrt(np.square(back[:, :2] / back[:, 2:] - seen).sum(axis=1).mean()))
    if off > _FLAT:
        raise ValueError(
            f"corners of the board in '{name}' lie {off:.2g} px from a plane, {_FLAT:g} px may be;"
            " lay it flat, or give the lens by --camera"
        )
    to_mm = np.linalg.inv(to_px)
    to_mm /= to_mm[2] @ _homogeneous(seen).mean(axis=0)
    through = "" if lens is None else ", distortion of the lens taken out"
    return BoardPlane(to_mm, lens, f"{len(mm)} corners of the board in {name}{through}")


def _homogeneous(places: F64) -> F64:
    return np.column_stack([places, np.ones(len(places))])


def straightened(px: F64, lens: synthetic.Camera | None) -> F64:
    """Pixels (N, 2) as a lens without distortion would see them."""
    if lens is None or lens.distortion is None:
        return px
    return lens.distortion.straighten((px - lens.centre) / lens.focal) * lens.focal + lens.centre


def two_points(text: str, lens: synthetic.Camera | None) -> FlatImage:
    """Read a scale such as ``120,80,920,80=100 mm``: two points, px, and their distance.

    Raises
    ------
    ValueError
        It is not of that form, the points are one, or the distance is not positive.
    """
    found = _TWO_POINTS.fullmatch(text)
    if found is None:
        raise ValueError(
            f"scale must be two points in px and their distance, such as '120,80,920,80=100 mm',"
            f" got '{text}'; write it so"
        )
    x1, y1, x2, y2, length = map(float, found.groups())
    start, end = straightened(np.array([[x1, y1], [x2, y2]]), lens)
    apart = float(np.linalg.norm(end - start))
    if apart < 1 or length <= 0:
        raise ValueError(
            f"scale '{text}' has points {apart:g} px apart and a distance of {length:g} mm; give"
            " two points at least 1 px apart and a positive distance"
        )
    through = "" if lens is None else ", distortion of the lens taken out"
    return FlatImage(length / apart, lens, f"two points, {text.strip()}{through}")


@dataclass(frozen=True, eq=False)
class ScaledPoints:
    """The points of a reference on the object.

    Attributes
    ----------
    scale : Scale
    places : (N, 2) float64, mm
    slopes : (N, 2, 2) float64, mm/px
        [[∂X/∂x, ∂X/∂y], [∂Y/∂x, ∂Y/∂y]] of the place in the pixel.
    """

    scale: Scale
    places: F64
    slopes: F64

    @property
    def mm_per_px(self) -> float:
        """Median over the points, the root of the area that a pixel covers."""
        return float(np.sqrt(np.median(np.abs(np.linalg.det(self.slopes)))))

    @property
    def settings(self) -> dict[str, object]:
        """What files say of the scale."""
        digest = hashlib.sha256(self.places.tobytes()).hexdigest()
        return {"scale": self.scale.described, "mm_per_px": self.mm_per_px, "places": digest}


def scaled_points(scale: Scale, xy: F64) -> ScaledPoints:
    """Lay the points (N, 2) px of a reference on the object.

    Raises
    ------
    ValueError
        A point is seen of no place.
    """
    return ScaledPoints(scale, scale.places(xy), _slopes(scale, xy))


def in_mm(points: ScaledPoints, disp: dic.DisplacementField) -> dic.DisplacementField:
    """Displacement on the object: u, v, their σ in mm, and gradients in mm/px, NaN where lost.

    Raises
    ------
    ValueError
        A point has moved to where the camera sees no place.
    """
    u, v, gradient = (np.full_like(a, np.nan) for a in (disp.u, disp.v, disp.gradient))
    known = disp.valid
    moved = disp.xy[known] + np.column_stack([disp.u[known], disp.v[known]])
    u[known], v[known] = (points.scale.places(moved) - points.places[known]).T
    if disp.gauge is not None:  # the strain is that of these gradients: d(X(x + u) - X(x))/dx
        stretch = _slopes(points.scale, moved) @ (np.eye(2) + disp.gradient[known])
        gradient[known] = stretch - points.slopes[known]
    spread = np.column_stack([disp.sigma_u, disp.sigma_v])
    spread = np.sqrt(np.einsum("nab,nb->na", points.slopes**2, spread**2))
    by_gradient = np.einsum("nab,nbc->nac", points.slopes**2, disp.sigma_gradient**2)
    return replace(
        disp,
        u=u,
        v=v,
        sigma_u=spread[:, 0],
        sigma_v=spread[:, 1],
        gradient=gradient,
        sigma_gradient=np.sqrt(by_gradient),
    )


def scaled_columns(field: dic.DisplacementField) -> dict[str, AnyArray]:
    """Displacement in mm and its σ, (N,) by name."""
    return dict(zip(SCALED, (field.u, field.v, field.sigma_u, field.sigma_v), strict=True))


def _slopes(scale: Scale, xy: F64) -> F64:
    """Slopes (N, 2, 2) mm/px of the places in the pixels, by central differences."""
    steps = np.eye(2) * _HALF
    columns = [scale.places(xy + step) - scale.places(xy - step) for step in steps]
    return np.stack(columns, axis=-1) / (2 * _HALF)
