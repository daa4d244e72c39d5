"""Many images at once on torch, for training: one sharp image, warped by smooth fields."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from synthetic.sampling import BORDER_PX, CONTROL_PX
from synthetic.warp import Warper

if TYPE_CHECKING:
    from torch import Tensor

# Steps from forward to backward displacement; each gains the slope of the field.
_INVERSION_STEPS = 8
# Spline coefficients beyond the controls on each side: there the field goes on as a straight line.
_RIM = 2


@dataclass(frozen=True, eq=False)
class BatchWarper:
    """A plate at rest on a torch device, ready to be seen under many displacements at once.

    Displacements are given at control pixels, every `spacing` px from one before the image to past
    it, and are bicubic splines through those values in between.

    Attributes
    ----------
    size : (width, height) of the image, px.
    controls : (rows, cols, 2) float64, px, the control pixels (x, y).
    oversample : samples of the sharp image a pixel.
    sharp : (1, 1, H', W') float32 tensor, cubic spline coefficients of the image at rest.
    down, along : float32 tensors (rows + 4, rows) and (cols + 4, cols) that turn values at the
        controls into spline coefficients there and beyond.
    spacing : px between control pixels.
    """

    size: tuple[int, int]
    controls: np.ndarray = field(repr=False)
    oversample: int
    sharp: Tensor = field(repr=False)
    down: Tensor = field(repr=False)
    along: Tensor = field(repr=False)
    spacing: int = CONTROL_PX

    def part(self, corner: tuple[int, int], size: tuple[int, int]) -> BatchWarper:
        """Look at a part of the image, which shares the sharp image.

        Parameters
        ----------
        corner : (x, y) of its first pixel.
        size : (width, height) px.

        Raises
        ------
        ValueError
            The part reaches beyond the image.
        """
        if (
            min(corner) < 0
            or min(size) < 1
            or any(
                first + count > whole
                for first, count, whole in zip(corner, size, self.size, strict=True)
            )
        ):
            raise ValueError(
                f"part must lie in the image of {self.size} px, got {size} px from {corner}; take "
                "a smaller one"
            )
        columns, rows = (
            slice(first * self.oversample, (first + count + 2 * BORDER_PX) * self.oversample)
            for first, count in zip(corner, size, strict=True)
        )
        return _laid(self.sharp[..., rows, columns], size, self.oversample, self.spacing)

    def render(self, forward: ArrayLike | Tensor) -> Tensor:
        """Take one image for each displacement, without noise.

        Parameters
        ----------
        forward : (B, rows, cols, 2), px, displacement of what is seen at rest at the controls;
            `Warper.forward` gives it for a displacement of the plate.

        Returns
        -------
        (B, 1, H, W) float32 tensor on the device, 255 × light. Gradients flow to `forward`.

        Raises
        ------
        ValueError
            A field of wrong shape, not finite or larger than the image.
        """
        spline = self._spline(forward)
        x, y = self._places(self.controls)
        backward = _bicubic(spline, x, y)
        for _ in range(_INVERSION_STEPS):
            u, v = backward.unbind(1)
            backward = _bicubic(spline, x - u / self.spacing, y - v / self.spacing)
        u, v = _bicubic(self._filter(backward), *self._places(self._pixels())).unbind(1)
        px = self.sharp.new_tensor(self._pixels() + BORDER_PX)
        light = _bicubic(
            self.sharp, (px[..., 0] - u) * self.oversample, (px[..., 1] - v) * self.oversample
        )
        return 255 * light

    def displacement(self, forward: ArrayLike | Tensor, pixels: np.ndarray | None = None) -> Tensor:
        """Displacement of what each pixel sees at rest: the truth of a correlation.

        Parameters
        ----------
        forward : as of `render`, with its errors.
        pixels : (h, w, 2) float64, places (x, y) in px; those of the image if left out.

        Returns
        -------
        (B, 2, h, w) float32 tensor, px, u along columns and v along rows.
        """
        places = self._pixels() if pixels is None else pixels
        return _bicubic(self._spline(forward), *self._places(places))

    def _spline(self, forward: ArrayLike | Tensor) -> Tensor:
        """Coefficients (B, 2, rows + 4, cols + 4) of checked fields."""
        import torch

        values = torch.as_tensor(forward, dtype=torch.float32, device=self.sharp.device)
        if values.ndim != 4 or values.shape[1:] != self.controls.shape:
            rows, columns, _ = self.controls.shape
            raise ValueError(
                f"displacements must have shape (B, {rows}, {columns}, 2) in px, "
                f"got {tuple(values.shape)}"
            )
        largest, allowed = (
            float(values.detach().abs().max()) if len(values) else 0.0,
            max(self.size),
        )
        if not largest <= allowed:
            raise ValueError(
                f"displacements must be smaller than the image, {allowed} px, got {largest:.6g} px"
            )
        return self._filter(values.permute(0, 3, 1, 2))

    def _filter(self, values: Tensor) -> Tensor:
        return self.down @ values @ self.along.T

    def _pixels(self) -> np.ndarray:
        return np.stack(np.meshgrid(*(np.arange(float(n)) for n in self.size)), axis=-1)

    def _places(self, pixels: np.ndarray) -> tuple[Tensor, Tensor]:
        """Column and row, each (1, h, w), of pixels (h, w, 2) among the coefficients."""
        x, y = self.sharp.new_tensor(pixels / self.spacing + 1 + _RIM).unbind(-1)
        return x[None], y[None]


def prepare_batch(warper: Warper, device: str = "cpu", spacing: int = CONTROL_PX) -> BatchWarper:
    """Bring the sharp image of a warper to a torch device.

    Parameters
    ----------
    warper : as from `prepare_warp`; its oversampling decides the error.
    device : "cpu", "cuda", ...
    spacing : px between control pixels, 8 or less; waves need two and a half of them a period.

    Raises
    ------
    ValueError
        The spacing is out of range, torch or kornia is not installed, or the device is not there.
    """
    if not 1 <= spacing <= CONTROL_PX:
        raise ValueError(
            f"spacing of control pixels must lie in 1…{CONTROL_PX} px, got {spacing} px; take "
            f"{CONTROL_PX} px"
        )
    missing = [name for name in ("torch", "kornia") if find_spec(name) is None]
    if missing:
        raise ValueError(
            f"a batch of images needs {' and '.join(missing)}, not installed here; run "
            "'make torch' or render one by one with `Warper`"
        )
    import torch

    try:
        sharp = torch.as_tensor(warper.sharp, device=device)[None, None]
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise ValueError(f"device {device!r} cannot be used ({reason}); use 'cpu'") from None
    return _laid(sharp, warper.camera.size, warper.oversample, spacing)


def _laid(sharp: Tensor, size: tuple[int, int], oversample: int, spacing: int) -> BatchWarper:
    """Lay control pixels over an image of which the sharp one is known."""
    columns, rows = ((length - 1) // spacing + 4 for length in size)
    lines = (spacing * np.arange(-1.0, count - 1) for count in (columns, rows))
    return BatchWarper(
        size=size,
        controls=np.stack(np.meshgrid(*lines), axis=-1),
        oversample=oversample,
        sharp=sharp,
        down=sharp.new_tensor(_prefilter(rows)),
        along=sharp.new_tensor(_prefilter(columns)),
        spacing=spacing,
    )


def _prefilter(count: int) -> np.ndarray:
    """Matrix from values to the coefficients of a cubic spline without curvature at its ends."""
    spline = (np.diag(np.full(count, 4.0)) + np.eye(count, k=1) + np.eye(count, k=-1)) / 6
    spline[0], spline[-1] = np.eye(count)[0], np.eye(count)[-1]
    inner, beyond = np.linalg.inv(spline), np.arange(1, _RIM + 1)[:, None]
    before = inner[0] + beyond[::-1] * (inner[0] - inner[1])
    after = inner[-1] + beyond * (inner[-1] - inner[-2])
    return np.vstack([before, inner, after])


def _bicubic(coefficients: Tensor, x: Tensor, y: Tensor) -> Tensor:
    """Bicubic splines at places, by four bilinear lookups between pairs of coefficients.

    A sum w0 c0 + w1 c1 is (w0 + w1) times the value at w1/(w0 + w1) on the line from c0 to c1, and
    bilinear lookup is what devices do fastest (Sigg and Hadwiger 2005, GPU Gems 2, chapter 20).

    Parameters
    ----------
    coefficients : (B or 1, C, h, w)
    x, y : (B or 1, H, W), columns and rows; those outside are moved to the rim.

    Returns
    -------
    (B, C, H, W)
    """
    from kornia.geometry.transform import remap

    batch = max(len(coefficients), len(x))
    coefficients = coefficients.expand(batch, -1, -1, -1)
    (x0, x1, gx), (y0, y1, gy) = _pairs(x, coefficients.shape[3]), _pairs(y, coefficients.shape[2])

    def lookup(column: Tensor, row: Tensor) -> Tensor:
        places = column.expand(batch, -1, -1), row.expand(batch, -1, -1)
        return remap(coefficients, *places, padding_mode="border", align_corners=True)

    gx, gy = gx[:, None], gy[:, None]
    above = (1 - gx) * lookup(x0, y0) + gx * lookup(x1, y0)
    below = (1 - gx) * lookup(x0, y1) + gx * lookup(x1, y1)
    return (1 - gy) * above + gy * below


def _pairs(x: Tensor, count: int) -> tuple[Tensor, Tensor, Tensor]:
    """Places between the first and between the last two of the four coefficients around x.

    The third tensor is the weight of the last two.
    """
    x = x.clamp(1, count - 2)
    left = x.detach().floor()
    t = x - left
    s = 1 - t
    w1, w3 = 2 / 3 - t * t * (1 - t / 2), t * t * t / 6
    w2 = 2 / 3 - s * s * (1 - s / 2)
    last = w2 + w3
    return left - 1 + w1 / (1 - last), left + 1 + w3 / last, last
