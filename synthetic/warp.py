"""Images of a moving plate at the rate of a camera, from one sharp image of it at rest or bent."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike
from scipy.ndimage import spline_filter

from synthetic.arrays import F32, F64, I64, AnyArray
from synthetic.inverse import Displacement, invert
from synthetic.pattern import Pattern
from synthetic.points import at_height
from synthetic.rendering import mean_light
from synthetic.rolling import row_fraction
from synthetic.sampling import BORDER_PX, CONTROL_PX, moved_back, sample
from synthetic.sensor import Sensor
from synthetic.telecentric import AnyCamera
from synthetic.view import image_motion

# Points a side of a pixel of the sharp image: off by 0.04 grey levels, less than the spline is.
SAMPLES = 3
# Diameter of a spot, px, below which three places a pixel are sampled, not two.
FINE = 4.0
# The control displacement D is turned backward, d(x) = D(x − d(x)), in this many steps. A step
# gains the slope of the displacement, 1e-2 at most for a plate that bends.
INVERSION_STEPS = 2


@dataclass(frozen=True, eq=False)
class Warper:
    """A plate at rest or bent, ready to be seen under any small displacement from there.

    Attributes
    ----------
    camera, z : the camera, and the height of the watched face, mm.
    plate : (a, b) of the plate, mm.
    sharp : float32, cubic spline coefficients of the image of the plate as it was prepared.
    grid : (rows, cols) of the control pixels.
    points : (G, 2) float64, mm, where the caller gives the displacement: the plate points seen at
        the control pixels, row by row. Control pixels that see past the edge of the plate have the
        edge instead, and the mirror images of what they see, inside the plate, come last.
    past : (E,) int64, the control pixels past the edge.
    light : (H, W) float32, the frame in work; a warper serves one thread.
    start : (G, 3) float64, mm, displacement of `points` in the sharp image; None at rest.
    spacing : px between control pixels.
    """

    camera: AnyCamera
    z: float
    plate: tuple[float, float]
    sharp: F32 = field(repr=False)
    grid: tuple[int, int]
    points: F64 = field(repr=False)
    past: I64 = field(repr=False)
    light: F32 = field(repr=False)
    start: F64 | None = field(default=None, repr=False)
    spacing: int = CONTROL_PX

    @classmethod
    def from_arrays(cls, camera: AnyCamera, z: float, arrays: Mapping[str, AnyArray]) -> "Warper":
        """Make the warper of the same camera and height from what `arrays` gave."""
        a, b = (float(length) for length in arrays["plate"])
        spacing = int(arrays["spacing"])
        columns, rows = (_controls(length, spacing) for length in camera.size)
        pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        seen = arrays["seen"] if "seen" in arrays else camera.on_plate(pixels, z)
        edge = np.clip(seen, 0, (a, b))
        past = np.flatnonzero((seen != edge).any(axis=1))
        mirrored = np.clip(2 * edge[past] - seen[past], 0, (a, b))
        return cls(
            camera=camera,
            z=z,
            plate=(a, b),
            sharp=arrays["sharp"],
            grid=(len(rows), len(columns)),
            points=np.vstack([edge, mirrored]),
            past=past,
            light=np.empty(camera.size[::-1], np.float32),
            start=arrays.get("start"),
            spacing=spacing,
        )

    def arrays(self) -> dict[str, AnyArray]:
        """Return what took time to make, to be kept by name."""
        kept = {
            "plate": np.array(self.plate),
            "sharp": self.sharp,
            "spacing": np.array(self.spacing),
        }
        if self.start is None:
            return kept
        controls, seen = self.grid[0] * self.grid[1], self.points[: self.grid[0] * self.grid[1]]
        beyond = seen.copy()
        beyond[self.past] = 2 * seen[self.past] - self.points[controls:]
        return kept | {"seen": beyond, "start": self.start}

    def render(
        self,
        displacement: ArrayLike,
        sensor: Sensor | None,
        rng: Generator | None,
        shift: tuple[float, float] = (0.0, 0.0),
        out: AnyArray | None = None,
    ) -> AnyArray:
        """Take an image of the displaced plate.

        Parameters
        ----------
        displacement : (G, 3) float64, mm, at `points`.
        sensor, rng : as in `render`.
        shift : (x, y) by which the whole image is moved, px.
        out : (H, W) of the sensor's type, reused when given.

        Returns
        -------
        (H, W) uint8, uint16 or (without a sensor) float64, grey levels.

        Raises
        ------
        ValueError
            A displacement of wrong shape, not finite or larger than the image.
        """
        forward = self.forward(displacement, shift).astype(np.float32)
        backward = forward
        for _ in range(INVERSION_STEPS):
            backward = moved_back(forward, backward, self.spacing)
        sample(self.sharp, backward, self.spacing, self.oversample, self.light)
        if sensor is None:
            return 255 * self.light.astype(np.float64)
        return sensor.capture(self.light, rng, out)

    @property
    def read_at(self) -> F64:
        """When each of `points` is read, at rest: see `row_fraction`, (G,)."""
        return row_fraction(
            self.camera.project(at_height(self.points, self.z)), self.camera.size[1]
        )

    @property
    def oversample(self) -> int:
        """Samples of the sharp image a pixel, in each direction."""
        return self.sharp.shape[1] // (self.camera.size[0] + 2 * BORDER_PX)

    def forward(self, displacement: ArrayLike, shift: tuple[float, float] = (0.0, 0.0)) -> F64:
        """Displacement in the image of what the sharp image shows at the control pixels.

        Parameters and errors as of `render`.

        Returns
        -------
        (rows, cols, 2) float64, px.
        """
        forward = image_motion(self.camera, self.points, displacement, self.z)
        if self.start is not None:
            forward = forward - image_motion(self.camera, self.points, self.start, self.z)
        count = self.grid[0] * self.grid[1]
        # Past the edge the field goes on as its point reflection, with equal value and slope.
        forward[self.past] = 2 * forward[self.past] - forward[count:]
        forward = forward[:count] + shift
        largest, allowed = np.abs(forward).max(), max(self.camera.size)
        if not largest <= allowed:
            raise ValueError(
                f"displacement and shift must be smaller than the image, {allowed} px, "
                f"got {largest:.6g} px"
            )
        return forward.reshape(*self.grid, 2)


def prepare_warp(
    pattern: Pattern,
    camera: AnyCamera,
    z: float = 0.0,
    oversample: int | None = None,
    displacement: Displacement | None = None,
    spacing: int = CONTROL_PX,
) -> Warper:
    """Render the plate once, sharply enough to be sampled anywhere.

    The image is the mean light over a pixel as a function of the place of the pixel, known at
    `oversample` places a pixel in each direction and a cubic spline in between. Against `render`
    it neglects that the square of a pixel is strained with what moves since.

    Parameters
    ----------
    z : height of the seen face over the plate's middle plane, mm: `camera.face_height(thickness)`.
    oversample : 2 where it is left out, or 3 where spots are smaller than `FINE` pixels: 2 makes
        motions of a quarter pixel 0.13 mpx too large there.
    displacement : of a plate that is bent to begin with, as in `render`; None at rest. Further
        displacement is then small against this one, and `Warper.render` takes both together.
    spacing : px between control pixels, 8 or less; a touch some millimetres from a clamped edge
        bends a plate more than a cubic over 8 px follows.

    Raises
    ------
    ValueError
        As `render`, for an `oversample` below 1 and a `spacing` out of range.
    """
    if not 1 <= spacing <= CONTROL_PX:
        raise ValueError(
            f"spacing of control pixels must lie in 1…{CONTROL_PX} px, got {spacing} px; take "
            f"{CONTROL_PX} px"
        )
    if oversample is None:
        oversample = 3 if _spot(pattern, camera, z) < FINE else 2
    if oversample < 1:
        raise ValueError(f"oversample must be at least 1 sample a pixel, got {oversample}")
    sharp = mean_light(pattern, camera, displacement, z, SAMPLES, oversample, BORDER_PX)
    arrays = {
        "plate": np.array(pattern.speckle.size),
        "sharp": spline_filter(sharp).astype(np.float32),
        "spacing": np.array(spacing),
    }
    if displacement is None:
        return Warper.from_arrays(camera, z, arrays)
    arrays["seen"] = _seen_bent(camera, displacement, pattern.speckle.size, z, spacing)
    warper = Warper.from_arrays(camera, z, arrays)
    return replace(warper, start=np.asarray(displacement(warper.points), dtype=np.float64))


def _spot(pattern: Pattern, camera: AnyCamera, z: float) -> float:
    """Diameter of a spot in the middle of the plate, px."""
    middle, wide = np.array(pattern.speckle.size) / 2, np.array([pattern.speckle.diameter / 2, 0.0])
    ends = camera.project(at_height(np.array([middle - wide, middle + wide]), z))
    return float(np.linalg.norm(ends[1] - ends[0]))


def _seen_bent(
    camera: AnyCamera,
    displacement: Displacement,
    size: tuple[float, float],
    z: float,
    spacing: int,
) -> F64:
    """Points of a bent plate (rows · cols, 2) mm that control pixels see.

    A pixel beside the plate has what the nearest one that sees the plate has.
    """
    from scipy.spatial import KDTree

    columns, rows = (_controls(length, spacing) for length in camera.size)
    pixels = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    inverse = invert(camera, displacement, size, z, border=3 * CONTROL_PX)
    covered = inverse.covers(pixels)
    found = next(inverse.follow(pixels[covered], np.zeros((1, 2))))
    _, nearest = KDTree(pixels[covered]).query(pixels)
    return np.asarray(found[nearest], dtype=np.float64)


def _controls(length: int, spacing: int) -> F64:
    """Control pixels along one side, one before the image and two at or past its end."""
    return spacing * np.arange(-1.0, (length - 1) // spacing + 3)
