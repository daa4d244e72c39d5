"""Geometry of the bent shell at points: normal, face, strain, and how they vary.

Arrays `g` (K, 5, 3) hold the derivatives U,x U,y U,xx U,yy U,xy of the displacement from the plane
at K points: from rest on, and of the plate at rest itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.elements.functional import Functional
from fe.elements.mesh import Mesh
from fe.plate.plate import Plate

ORDERS = ((1, 0), (0, 1), (2, 0), (0, 2), (1, 1))

# Derivative behind each second derivative U,αβ.
_SECOND = ((2, 4), (4, 3))

Reading = Callable[[Mesh, F64, int, int], Functional]


class BentSurface(NamedTuple):
    """The bent middle surface at K points.

    Attributes
    ----------
    tangents : (K, 2, 3) float64
        a_α.
    duals : (K, 2, 3) float64
        aᵅ, with aᵅ·a_β = δ.
    normal : (K, 3) float64
    strain : (K, 2, 2) float64
        Green-Lagrange strain of the middle surface.
    curvature : (K, 2, 2) float64, 1/mm
        n·U,αβ.
    """

    tangents: F64
    duals: F64
    normal: F64
    strain: F64
    curvature: F64


def derivatives(mesh: Mesh, values: F64, xy: F64, reading: Reading) -> F64:
    """Five derivatives (K, 5, 3) of the displacement at points, read exactly or recovered."""
    return np.stack([reading(mesh, xy, p, q).of(values) for p, q in ORDERS], axis=1)


def rest(plate: Plate, xy: F64) -> F64:
    """Five derivatives (K, 5, 3) of the shape at rest at points (K, 2) mm."""
    g = np.zeros((len(xy), len(ORDERS), 3))
    if plate.shape is not None:
        for d, (p, q) in enumerate(ORDERS):
            g[:, d, 2] = plate.shape.at(plate.size, xy, p, q)
    return g


def surface(g: F64) -> BentSurface:
    """Surface of the derivatives (K, 5, 3) at points."""
    flat = np.eye(2, 3)
    tangents = flat + g[:, :2]
    cross = np.cross(tangents[:, 0], tangents[:, 1])
    area = np.linalg.norm(cross, axis=1, keepdims=True)
    normal = cross / area
    dual = np.cross(tangents[:, 1], normal), np.cross(normal, tangents[:, 0])
    duals = np.stack(dual, axis=1) / area[:, None]
    linear = g[:, :2] @ flat.T
    strain = 0.5 * (linear + linear.swapaxes(1, 2) + g[:, :2] @ g[:, :2].swapaxes(1, 2))
    curvature = np.einsum("kc,kabc->kab", normal, g[:, _SECOND])
    return BentSurface(tangents, duals, normal, strain, curvature)


def strain(g: F64, z: F64) -> F64:
    """Green-Lagrange strain at height z over the middle surface.

    The place x + z n has the strain E - z κ + z² n,α·n,β / 2, with n,α = -κ_αγ aᵞ.

    Parameters
    ----------
    g : (K, 5, 3) float64
    z : (K,) float64, mm

    Returns
    -------
    (K, 3) float64
        exx, eyy and the tensor component exy.
    """
    bent, z = surface(g), z[:, None, None]
    turned = bent.curvature @ bent.duals
    full = bent.strain - z * bent.curvature + 0.5 * z**2 * (turned @ turned.swapaxes(1, 2))
    return _components(full)


def strain_variation(g: F64, z: F64) -> F64:
    """Differentiate `strain` by the five derivatives of the displacement: (K, 3, 5, 3)."""
    bent = surface(g)
    z = z[:, None, None, None, None]
    stretch = np.zeros((len(g), 2, 2, 5, 3))
    bend = np.zeros_like(stretch)
    along = np.einsum("kabc,kgc->kabg", g[:, _SECOND], bent.duals)
    for a in (0, 1):
        for b in (0, 1):
            stretch[:, a, b, a] += 0.5 * bent.tangents[:, b]
            stretch[:, a, b, b] += 0.5 * bent.tangents[:, a]
            bend[:, a, b, _SECOND[a][b]] += bent.normal
            bend[:, a, b, :2] -= along[:, a, b, :, None] * bent.normal[:, None]
    metric = bent.duals @ bent.duals.swapaxes(1, 2)
    mixed = bent.curvature @ metric
    half = np.einsum("kag,kgbdc->kabdc", mixed, bend)
    inner = np.einsum("kag,kghdc,kbh->kabdc", mixed, stretch, mixed)
    third = half + half.swapaxes(1, 2) - 2.0 * inner
    return _components(stretch - z * bend + 0.5 * z**2 * third)


def turning(g: F64) -> F64:
    """Return n,x and n,y of the normal n: (K, 2, 3) float64, 1/mm."""
    bent = surface(g)
    return -bent.curvature @ bent.duals


def _components(tensor: F64) -> F64:
    return np.stack([tensor[:, 0, 0], tensor[:, 1, 1], tensor[:, 0, 1]], axis=1)
