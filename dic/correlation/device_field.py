"""The whole of a correlation on a device: `dic.correlate` of a reference that names one.

Points that do not settle together, and breaks of the material, are few or none; where there are
any, the compiled loops of the host go on from what the device has found.
"""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from threading import Lock
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from dic.arrays import AnyArray
from dic.correlation import clipping, device_points, device_status, point_status
from dic.correlation.deformed_image import DeformedImage
from dic.correlation.device_points import DevicePoints
from dic.correlation.device_reference import put_reference
from dic.correlation.device_status import DeviceImage
from dic.correlation.device_sums import sums_on_device
from dic.correlation.device_work import DeviceWork
from dic.correlation.iteration import (
    HOPE,
    MAX_PASSES,
    PATIENCE,
    begin_again,
    iterate_points,
    may_grow,
    unsettled,
)
from dic.correlation.newton import Points
from dic.correlation.reference import Reference
from dic.correlation.start import Start, nowhere, start
from dic.fields.displacement import DisplacementField, Status
from dic.fields.grid import Grid

if TYPE_CHECKING:
    from torch import Tensor


class DeviceField:
    """A reference on its device, which measures one frame at a time.

    Parameters
    ----------
    ref : Reference
    grid : Grid
        That of the reference.
    device : str
        As `torch.device` takes it.
    """

    def __init__(self, ref: Reference, grid: Grid, device: str) -> None:
        self._ref, self._grid = ref, grid
        self._known = put_reference(ref, grid, device)
        self._pass, self._measure = DeviceWork(self._one_pass), DeviceWork(self._numbers)
        self._one_by_one = Lock()

    def correlate(
        self, image: AnyArray, guess: DisplacementField | ArrayLike | None
    ) -> DisplacementField:
        """Measure a frame; see `dic.correlate`."""
        ref = self._ref
        with self._one_by_one:
            begun = self._start(image, guess)
            if isinstance(begun, Start) and not begun.anywhere:
                return point_status.displacement_field(ref, *nowhere(ref, image, begun))
            frame = self._read(image)
            points, alone = self._iterate(frame, begun)
            if alone is not None:
                points = device_points.put_points(self._known, alone)
            numbers = np.asarray(self._measure(*frame, *points)[0].cpu().numpy())
            if not numbers[-1]:
                return device_status.unpacked(ref, numbers)
            points = alone or points.on_host()
            return point_status.displacement_field(ref, points, _on_host(image, frame))

    def iterate(
        self, image: AnyArray, guess: DisplacementField | ArrayLike | None
    ) -> tuple[Points, DeformedImage]:
        """Iterate the points on a frame, and bring them back."""
        with self._one_by_one:
            begun = self._start(image, guess)
            if isinstance(begun, Start) and not begun.anywhere:
                return nowhere(self._ref, image, begun)
            frame = self._read(image)
            points, alone = self._iterate(frame, begun)
            return alone or points.on_host(), _on_host(image, frame)

    def _start(
        self, image: AnyArray, guess: DisplacementField | ArrayLike | None
    ) -> DevicePoints | Start:
        """Return the points of a guess that lie on the device already, or where they start."""
        if isinstance(guess, DisplacementField) and guess.u.shape == self._ref.xy.shape[:1]:
            points = device_points.put_field(self._known, guess, self._ref.order)
            if points is not None:
                return points
        return start(self._ref, image, guess, self._ref.status == Status.OK)

    def _read(self, image: AnyArray) -> DeviceImage:
        import torch

        known, levels = self._known, [float(level) for level, _ in clipping.levels(image)]
        plain = image if image.dtype == np.uint8 else image.astype(np.float32)
        grey = torch.as_tensor(np.ascontiguousarray(plain), device=known.xy.device).float()
        spline = known.down.filtering @ (grey - grey.mean()) @ known.across.filtering.T
        clipping_at = torch.tensor(levels or [np.nan] * 2, device=grey.device)
        return DeviceImage(grey, spline, clipping_at)

    def _iterate(
        self, frame: DeviceImage, begun: DevicePoints | Start
    ) -> tuple[DevicePoints, Points | None]:
        """Iterate the field; and bring it back if some of its points had to go on alone."""
        known = self._known
        points = device_points.put_start(known, begun) if isinstance(begun, Start) else begun
        points, moving = self._together(frame, points)
        parted = isinstance(begun, Start) and begun.alone is not None
        if not moving and not parted:
            return points, None
        alone, there = points.on_host(), _on_host(None, frame)
        iterate_points(self._ref, there, alone, unsettled(self._ref, alone))
        if isinstance(begun, Start):
            iterate_points(self._ref, there, alone, begin_again(self._ref, alone, begun))
        return points, alone

    def _together(self, frame: DeviceImage, points: DevicePoints) -> tuple[DevicePoints, int]:
        """Iterate the field until hardly a point moves; and how many still do."""
        moving, held = 0, -1
        for passes in range(MAX_PASSES):
            # What a pass costs hardly depends on how many points still move.
            *state, counts, good = self._pass(frame.spline, *points)
            points = DevicePoints(*state)
            moving, flat, count, lost = map(int, counts.cpu().numpy())
            if moving == 0 and not may_grow(count, held, lost):
                break
            if passes >= PATIENCE and flat > HOPE * count:
                break
            held = count
            if count < len(good):
                filled = device_points.fill(self._known, points.motion, good)
                points = points._replace(motion=filled)
        return points, moving

    def _one_pass(self, spline: Tensor, *state: Tensor) -> tuple[Tensor, ...]:
        """Step all points; count those found that move, are flat, are all, and those lost."""
        import torch

        known, before = self._known, DevicePoints(*state)
        points = device_points.step(known, before, *sums_on_device(known, spline, before.motion))
        inside = known.usable & ~device_points.leaves_image(known, points.motion)
        good = inside & (points.zncc >= point_status.FOUND)
        flat = device_status.is_flat(self._ref, known, points)
        counted = (good & ~points.still, good & flat, good, inside & ~good)
        counts = torch.stack([some.sum() for some in counted])
        return *points, counts, good

    def _numbers(self, grey: Tensor, spline: Tensor, levels: Tensor, *state: Tensor):
        frame, points = DeviceImage(grey, spline, levels), DevicePoints(*state)
        return (device_status.measure(self._ref, self._grid, self._known, points, frame),)


def _on_host(image: AnyArray | None, frame: DeviceImage) -> DeformedImage:
    pixels = np.asarray(frame.spline.cpu().numpy())
    return DeformedImage(pixels if image is None else image, pixels, True)
