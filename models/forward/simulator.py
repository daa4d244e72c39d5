"""Simulated measurements of a plate: touches in, the strain of its gauges out.

Data sets are written from any function of this kind: by superposition where touches are small, of
the strain of the plate or of what a camera makes of it, and by a theory of large deflections where
they are not.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import fe
import synthetic
from models.arrays import F64

Simulator = Callable[[F64], F64]
"""From touches (n, k, 3), mm, mm, N, to strain (n, M, 3): exx, eyy, exy of M gauges."""


def superpose(
    unit: Callable[[F64], F64],
    before: F64 | float = 0.0,
) -> Simulator:
    """Return the simulator of linear theory: strains of single touches add, each times its force.

    Parameters
    ----------
    unit
        Strain per newton (K, M, 3) of touches at places (K, 2) mm: `strain` of an influence.
    before
        (M, 3) float64, strain of the plate before any touch, where its base is bent.
    """

    def strain(touches: F64) -> F64:
        single = unit(touches[..., :2].reshape(-1, 2))
        single = single.reshape(*touches.shape[:2], -1, 3)
        return before + np.einsum("nk,nkmc->nmc", touches[..., 2], single)

    return strain


def through_camera(
    modes: fe.Modes, camera: synthetic.AnyCamera, gauges: synthetic.Gauges
) -> Callable[[F64], F64]:
    """Return what DIC reads through a camera, without images, for `superpose`.

    Parameters
    ----------
    modes
        Of the plate, at rest and flat. The strain that a point bends near itself converges slowly:
        25 mm away 400 modes leave out 2 % of the largest.
    camera
        Before the face that is watched.
    gauges
        From `synthetic.strain_gauges`, M places in the image.

    Returns
    -------
    Function from places (K, 2) mm to strains (K, M, 3) per newton along the axes of the image, in
    which the motion of the plate towards the camera is one part.
    """
    read = read_modes(modes, camera, gauges)
    return lambda xy: np.einsum("mck,nk->nmc", read, modes.response(xy))


def read_modes(modes: fe.Modes, camera: synthetic.AnyCamera, gauges: synthetic.Gauges) -> F64:
    """Strains (M, 3, K) that DIC reads through a camera for a unit of each mode."""
    height = camera.face_height(modes.plate.thickness)
    points = camera.on_plate(gauges.px, height)
    shown = synthetic.image_motion_basis(
        camera, gauges.px, modes.value(points), modes.slope(points), height
    )
    return gauges.read(shown)


def large_deflection(gauges: fe.ReducedReadings, radius: float = 0.0) -> Simulator:
    """Return the simulator of a reduced plate: large touches do not add, each sample is solved for.

    Parameters
    ----------
    gauges
        Of the plate, from `fe.Reduced.gauges`.
    radius
        Of the discs of the touches, mm; 0 for points.

    Raises
    ------
    ValueError
        By the simulator, for touches under which the reduced plate cannot be trusted.
    """

    def strain(touches: F64) -> F64:
        return np.stack([_read(gauges, sample, radius) for sample in touches])

    return strain


def _read(gauges: fe.ReducedReadings, sample: F64, radius: float) -> F64:
    reading = gauges.read(sample[:, :2], sample[:, 2], radius)
    if reading.result is not fe.Trust.TRAINED:
        named = ", ".join(f"{force:g} N at ({x:g}, {y:g}) mm" for x, y, force in sample)
        raise ValueError(f"strain under {named} is not sure: {reading.result.value}")
    return reading.values
