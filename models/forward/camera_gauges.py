"""Strain that DIC reads at gauges through a camera: what touches do to it, and its noise.

A gauge is one subset. What it reads of a touch is linear in the force, and neighbours that share
pixels share their noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solve_triangular

import fe
import synthetic
from models.arrays import F64
from models.forward.linear import LinearForward, modal
from models.forward.simulator import read_modes


@dataclass(frozen=True, eq=False)
class CameraGauges:
    """M gauges of a plate under a camera.

    Attributes
    ----------
    modes : fe.Modes
        K modes of the plate.
    gauges : synthetic.Gauges
        Where they lie in the image, px, and how they weigh it.
    of_modes : (M, 3, K) float64
        Strain along the axes of the image by a unit of each mode.
    """

    modes: fe.Modes
    gauges: synthetic.Gauges
    of_modes: F64

    def strain(self, xy: F64) -> F64:
        """Strain per newton of touches at places (N, 2) mm: (N, M, 3)."""
        return np.einsum("mck,nk->nmc", self.of_modes, self.modes.response(xy))

    def root(self, image: ArrayLike, noise: float) -> F64:
        """Lower root (3M, 3M) of the covariance of the strains.

        Parameters
        ----------
        image : (H, W), grey levels
            The plate at rest with little noise.
        noise : float, grey levels
            Standard deviation of a pixel, in each of the two images.
        """
        texture = synthetic.texture_at(image, self.gauges.xy, self.gauges.size)
        root = np.linalg.cholesky(self.gauges.covariance(texture, noise))
        return np.asarray(root, dtype=np.float64)

    def white(self, root: F64) -> WhiteGauges:
        """Return the strains as a measurement of touches, their noise given by its root."""
        shown = self.of_modes.reshape(len(root), -1)
        basis, factor = np.linalg.qr(solve_triangular(root, shown, lower=True))
        whitening = solve_triangular(root, basis, lower=True, trans=1).T
        return WhiteGauges(whitening, factor.T, modal(self.modes, factor.T))


@dataclass(frozen=True, eq=False)
class WhiteGauges:
    """Strains of gauges, reduced to m numbers with white noise that hold all they say of touches.

    Attributes
    ----------
    whitening : (m, 3M) float64
        From strains to numbers.
    factor : (K, m) float64
        Numbers by a unit of each mode.
    forward : LinearForward
        Of the numbers.
    """

    whitening: F64
    factor: F64
    forward: LinearForward


def prepare_camera_gauges(
    modes: fe.Modes, camera: synthetic.AnyCamera, xy: ArrayLike, subset: int
) -> CameraGauges:
    """See places of a plate as gauges.

    Parameters
    ----------
    modes : fe.Modes
    camera : synthetic.AnyCamera
        Before the face that is watched.
    xy : (M, 2), mm
        On the face; a gauge stands at the nearest pixel.
    subset : int, px
        Side of a gauge, odd.

    Raises
    ------
    ValueError
        The subset is even or too small, or a gauge leaves the image.
    """
    places = np.asarray(xy, dtype=np.float64)
    height = np.full(len(places), camera.face_height(modes.plate.thickness))
    gauges = synthetic.strain_gauges(
        camera.project(np.column_stack([places, height])), subset, window=1
    )
    beyond = np.minimum(gauges.xy, np.array(camera.size) - 1 - gauges.xy).min() < subset // 2
    if beyond:
        raise ValueError(
            f"gauges of {subset} px must lie in the image, and some leave it; give gauges.margin"
            " more, or gauges.subset less"
        )
    return CameraGauges(modes, gauges, read_modes(modes, camera, gauges))
