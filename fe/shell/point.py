"""Mechanics of the Kirchhoff-Love shell at a point, for the kernels.

At a point the shell is known by five derivatives of its displacement U: U,x U,y U,xx U,yy U,xy,
here `g`, a tuple of five vectors. With tangents a_α = e_α + U,α, duals aᵅ and normal n, strain and
curvature are

    E_αβ = (A_α·U,β + U,α·A_β + U,α·U,β) / 2,    κ_αβ = n·X,αβ - N·X0,αβ

Here X = X0 + U, and X0 = (x, y, w0) is the surface at rest with tangents A_α and normal N; `rest`
holds the five derivatives of w0, all 0 for a flat plate. It is shallow, so that its metric stands
for that of the plane in the law and in areas. Nothing large cancels, for κ is
n·U,αβ + (n_z - N_z) w0,αβ. Variations follow from
δn = -(n·δa_α) aᵅ and δaᵅ = -(aᵅ·δa_β) aᵝ + aᵅᵝ (n·δa_β) n. Strains stand as (11, 22, 2·12), so that
stress times strain is work. See Kiendl et al. (2009), doi 10.1016/j.cma.2009.08.013. Matrices of
15 have the place 3 d + c for component c of derivative d.
"""

# pyright: basic
# Kernels alone, which Numba types.

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.compiled import njit

Vector = tuple[float, float, float]


class SurfaceBasis(NamedTuple):
    """Tangents a1, a2, their duals a¹, a², and the normal n of the bent surface."""

    a1: Vector
    a2: Vector
    dual1: Vector
    dual2: Vector
    n: Vector


# Second derivative behind each curvature, and how often it counts.
_CURVATURE = np.array([2, 3, 4])
_TIMES = np.array([1.0, 1.0, 2.0])


@njit(cache=True, nogil=True, inline="always")
def dot(a, b):
    """Inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, nogil=True, inline="always")
def cross(a, b):
    """Vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@njit(cache=True, nogil=True, inline="always")
def scaled(a, s):
    """Vector times a number."""
    return (a[0] * s, a[1] * s, a[2] * s)


@njit(cache=True, nogil=True)
def basis(g):
    """Vectors of the surface with the derivatives `placed` of its place."""
    a1 = (1.0 + g[0][0], g[0][1], g[0][2])
    a2 = (g[1][0], 1.0 + g[1][1], g[1][2])
    c = cross(a1, a2)
    area = np.sqrt(dot(c, c))
    n = scaled(c, 1.0 / area)
    dual1, dual2 = scaled(cross(a2, n), 1.0 / area), scaled(cross(n, a1), 1.0 / area)
    return SurfaceBasis(a1, a2, dual1, dual2, n)


@njit(cache=True, nogil=True, inline="always")
def raised(a, height):
    """Vector with a height added along z."""
    return (a[0], a[1], a[2] + height)


@njit(cache=True, nogil=True)
def placed(g, rest):
    """Five derivatives of the place less those of the plane, of a displacement from rest."""
    return (
        raised(g[0], rest[0]),
        raised(g[1], rest[1]),
        raised(g[2], rest[2]),
        raised(g[3], rest[3]),
        raised(g[4], rest[4]),
    )


@njit(cache=True, nogil=True)
def strains(g, rest, n):
    """Strains and changes of curvature (11, 22, 2·12) of a displacement from rest."""
    strain = (
        g[0][0] + rest[0] * g[0][2] + 0.5 * dot(g[0], g[0]),
        g[1][1] + rest[1] * g[1][2] + 0.5 * dot(g[1], g[1]),
        g[0][1] + g[1][0] + (rest[0] * g[1][2] + rest[1] * g[0][2]) + dot(g[0], g[1]),
    )
    tilt = n[2] - 1.0 / np.sqrt(1.0 + rest[0] * rest[0] + rest[1] * rest[1])
    curvature = (
        dot(n, g[2]) + tilt * rest[2],
        dot(n, g[3]) + tilt * rest[3],
        2.0 * (dot(n, g[4]) + tilt * rest[4]),
    )
    return strain, curvature


@njit(cache=True, nogil=True, inline="always")
def total(a, b):
    """Sum of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


@njit(cache=True, nogil=True, inline="always")
def law(stiffness, poisson, strain):
    """Plane stress: forces of strains."""
    return (
        stiffness * (strain[0] + poisson * strain[1]),
        stiffness * (strain[1] + poisson * strain[0]),
        stiffness * 0.5 * (1.0 - poisson) * strain[2],
    )


@njit(cache=True, nogil=True)
def variations(g, at, stretch_rows, bend_rows):
    """Set the derivatives (3, 15) of strains and of curvatures by the five derivatives of U.

    Here and in `geometric`, g are those of the place, see `placed`.
    """
    for c in range(3):
        stretch_rows[0, c] = at.a1[c]
        stretch_rows[1, 3 + c] = at.a2[c]
        stretch_rows[2, c] = at.a2[c]
        stretch_rows[2, 3 + c] = at.a1[c]
    for i in range(3):
        second = scaled(g[2 + i], _TIMES[i])
        along1, along2 = dot(second, at.dual1), dot(second, at.dual2)
        for c in range(3):
            bend_rows[i, c] = -along1 * at.n[c]
            bend_rows[i, 3 + c] = -along2 * at.n[c]
            bend_rows[i, 3 * _CURVATURE[i] + c] = _TIMES[i] * at.n[c]


@njit(cache=True, nogil=True, fastmath=True)
def material(stiffness, poisson, rows, point):
    """Add rowsᵀ C rows."""
    for k in range(15):
        first, second, third = law(stiffness, poisson, (rows[0, k], rows[1, k], rows[2, k]))
        for m in range(15):
            point[k, m] += first * rows[0, m] + second * rows[1, m] + third * rows[2, m]


@njit(cache=True, nogil=True)
def geometric(weight, g, at, stress, moment, point):
    """Add stress times the second derivatives of the strains, moment times those of curvature."""
    duals, n = (at.dual1, at.dual2), at.n
    for c in range(3):
        point[c, c] += weight * stress[0]
        point[3 + c, 3 + c] += weight * stress[1]
        point[c, 3 + c] += weight * stress[2]
        point[3 + c, c] += weight * stress[2]
    total = (0.0, 0.0, 0.0)
    for i in range(3):
        m = weight * _TIMES[i] * moment[i]
        total = (total[0] + m * g[2 + i][0], total[1] + m * g[2 + i][1], total[2] + m * g[2 + i][2])
    _by_tangents(total, duals, n, point)
    for i in range(3):
        m, first = weight * _TIMES[i] * moment[i], 3 * _CURVATURE[i]
        for b in range(2):
            for c in range(3):
                for e in range(3):
                    point[first + c, 3 * b + e] -= m * duals[b][c] * n[e]
                    point[3 * b + e, first + c] -= m * duals[b][c] * n[e]


@njit(cache=True, nogil=True)
def _by_tangents(total, duals, n, point):
    """Add the part by both tangents of curvature, for total = Σ moment times U,αβ."""
    along = (dot(total, duals[0]), dot(total, duals[1]))
    across = dot(total, n)
    for i in range(2):
        for j in range(2):
            metric = across * dot(duals[i], duals[j])
            for c in range(3):
                for e in range(3):
                    point[3 * i + c, 3 * j + e] += (
                        along[j] * n[c] * duals[i][e]
                        + along[i] * duals[j][c] * n[e]
                        - metric * n[c] * n[e]
                    )
