"""Which theory a plate needs: how far linear theory is off under the forces that are expected.

A plate that deflects also stretches, by ½ w,a w,b, and is held back by it. To leading order that
needs no nonlinear solution: keep the linear shape w, let the displacement in the plane relax, and
scale the shape by the factor t of least energy, U (t²/2 - t) + S t⁴/2 with U the work of the force
and S = ∫ N_ab ½ w,a w,b dA. S. Timoshenko and S. Woinowsky-Krieger, Theory of Plates and Shells,
§ 99 does so for a circle by hand; here any edges and patches are solved for.
"""

from __future__ import annotations

import numpy as np

from fe.arrays import F64
from fe.elements.functional import derivative
from fe.elements.mesh import Mesh, grid
from fe.linear.linear import Linear, LinearState
from fe.linear.membrane import Membrane, Stretched, stretch
from fe.linear.validity import LINEAR_TOLERANCE, LinearRange
from fe.plate.checks import positive
from fe.plate.plate import Plate

# Deflection is right to 1 % on this many elements along the longer side.
_LONG_SIDE = 16
# Places along each side at which the touch is tried, ends included: every second node.
_PLACES = np.linspace(0.0, 1.0, 9)
# Places along each side at which strain is compared; away from edges and from the touch.
_SEEN = np.linspace(0.05, 0.95, 10)


def linear_range(plate: Plate, force: float) -> LinearRange:
    """Say which theory holds for touches up to a force, anywhere on a plate.

    Parameters
    ----------
    plate : Plate
    force : float
        The largest expected, N.

    Returns
    -------
    LinearRange
        Its error is an estimate. Against the shell, over seven ways of holding a plate, it is
        within 2 % of itself up to w/h = 0.35, 11 % at 1 and 27 % at 2 (study `plates.regime`).

    Raises
    ------
    ValueError
        The force is not positive.
    """
    force = positive(force, "expected force", "N")
    mesh = grid(plate, _LONG_SIDE)
    place, linear = _worst(Linear(plate, mesh), force)
    depth = -float(linear.deflection(place)[0])
    membrane = Membrane(plate, mesh)
    slopes = membrane.gauss.slopes(linear.values)
    stretching = stretch(slopes, slopes)
    plane = membrane.relax(stretching)
    fraction = _fraction(force * depth, _work(membrane, plane, stretching))
    error = max(1.0 / fraction - 1.0, _strain_error(linear, plane, fraction))
    ratio = fraction * depth / float(plate.material(place)[0][0])
    return LinearRange(
        theory="linear" if error <= LINEAR_TOLERANCE else "large",
        force=force,
        place=(float(place[0, 0]), float(place[0, 1])),
        deflection=fraction * depth,
        ratio=ratio,
        error=error,
    )


def _worst(linear: Linear, force: float) -> tuple[F64, LinearState]:
    """Place (1, 2) mm of the largest w/h, and the plate under the touch there."""
    xy = _over(linear.plate, _PLACES)
    touch = derivative(linear.mesh, xy)
    loads = np.zeros((*linear.mesh.shape, len(xy)))
    touch.add_to(loads, np.full(len(xy), -force), np.arange(len(xy)))
    values = linear.solve(loads)
    depth = -np.diagonal(touch.of(values))
    ratio = depth / linear.plate.material(xy)[0]
    # The first of places that are alike by symmetry, whatever rounding does to them.
    worst = int(np.argmax(ratio > (1.0 - 1e-6) * ratio.max()))
    here = slice(worst, worst + 1)
    return xy[here], LinearState(linear.plate, linear.mesh, values[:, :, here])


def _fraction(bending: float, stretching: float) -> float:
    """Part of the linear deflection that least energy leaves: U (t - 1) + 2 S t³ = 0."""
    roots = np.roots([2.0 * stretching, 0.0, bending, -bending])
    return float(roots[np.abs(roots.imag).argmin()].real)


def _work(membrane: Membrane, plane: Stretched, strain: F64) -> float:
    """Integrate the stress in the plane times ½ w,a w,b, N mm."""
    xx, yy, xy = plane.stress[..., 0] * strain[..., 0]
    return float(np.sum((xx + yy + 2.0 * xy) * membrane.gauss.weights))


def _strain_error(linear: LinearState, plane: Stretched, fraction: float) -> float:
    """Error of the linear strain of the touched face, relative."""
    xy = _over(linear.plate, _SEEN)
    bending = linear.strain(xy)
    true = fraction * bending + fraction**2 * _middle_strain(linear, plane, xy)
    return float(np.linalg.norm(bending - true) / np.linalg.norm(true))


def _middle_strain(linear: LinearState, plane: Stretched, xy: F64) -> F64:
    """Strain of the middle surface, u_(a,b) + ½ w,a w,b, (K, 3) float64."""
    (ux, uy), (vx, vy) = (_gradient(linear.mesh, np.ascontiguousarray(u), xy) for u in plane.values)
    wx, wy = linear.slope(xy).T
    return np.stack([ux + wx**2 / 2, vy + wy**2 / 2, (uy + vx + wx * wy) / 2], axis=1)


def _gradient(mesh: Mesh, values: F64, xy: F64) -> tuple[F64, F64]:
    along, across = (derivative(mesh, xy, p, 1 - p).of(values)[:, 0] for p in (1, 0))
    return along, across


def _over(plate: Plate, fractions: F64) -> F64:
    """Grid of places at these fractions of both sides, (K, 2) float64, mm."""
    x, y = np.meshgrid(*(fractions * side for side in plate.size))
    return np.column_stack([x.ravel(), y.ravel()])
