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
from fe.elements.graded import Grading, graded
from fe.elements.mesh import Mesh, even_grid
from fe.linear.demand import equivalent
from fe.linear.energy_minimum import min_energy_fraction
from fe.linear.linear import Linear, LinearState
from fe.linear.membrane import Membrane, stretch
from fe.linear.validity import LINEAR_TOLERANCE, LinearRange
from fe.plate.aspect import check_aspect
from fe.plate.checks import positive
from fe.plate.plate import Plate
from fe.plate.thin import check_thin, shear_fraction

# Deflection is right to 1 % on this many elements along the side of a square.
_SIDE = 16
# Places along each side at which the touch is tried, ends included: every second node.
_PLACES = np.linspace(0.0, 1.0, 9)
# A plate that is longer than so many times its width is fine where it is touched.
_LONG = 3.0
_ALONG = Grading(finest=_SIDE, growth=1.0, elements=36000, across=8.0)
# Longer ones are strips to which an element is a needle.
_LONGEST = 1000.0
# Places along the shorter side at which strain is compared, as close along the longer one; away
# from edges and from the touch. Farther than so many widths a touch does nothing to a strip.
_SEEN = 10
_FAR = 1.5


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
        A plate with a shape needs the large theory whatever the error, which is then that of the
        flat one.

    Raises
    ------
    ValueError
        The force is not positive, or the plate is thick or more than 1000 times as long as wide.
    """
    force = positive(force, "expected force", "N")
    check_thin(plate)
    mesh = _mesh(plate)
    place, linear = _worst(Linear(plate.flat, mesh), force)
    depth = -float(linear.deflection(place)[0])
    membrane = Membrane(plate, mesh)
    slopes = membrane.gauss.slopes(linear.values)
    # What is linear in the deflection, of a shape at rest, and what is square in it.
    strains = np.concatenate([membrane.bowing(linear.values), stretch(slopes, slopes)], axis=-1)
    plane = membrane.relax(strains)
    (bowed, mixed), (_, stretching) = membrane.work(plane.stress, strains).tolist()
    fraction = min_energy_fraction(force * depth, bowed, mixed, stretching)
    drift = plane.values @ np.array([[fraction], [fraction**2]])
    bending, true = _strains(plate, linear, drift, fraction, place[0])
    strain_error = float(np.linalg.norm(bending - true) / np.linalg.norm(true))
    error = max(abs(1.0 / fraction - 1.0), strain_error)
    ratio = fraction * depth / float(plate.material(place)[0][0])
    exact = error <= LINEAR_TOLERANCE and plate.shape is None
    return LinearRange(
        theory="linear" if exact else "large",
        force=force,
        place=(float(place[0, 0]), float(place[0, 1])),
        deflection=fraction * depth,
        ratio=ratio,
        error=error,
        shear=shear_fraction(plate, force, depth),
        demand=float(equivalent(true, plate.poisson).max()) / plate.strain_limit,
    )


def _mesh(plate: Plate) -> Mesh:
    """Return an even mesh; for a long plate one that is coarse between the places of touches."""
    check_aspect(plate, _LONGEST)
    if max(plate.size) / min(plate.size) <= _LONG:
        return even_grid(plate, _SIDE)
    xy = _over(plate, _PLACES)
    return graded(plate, xy, np.zeros(len(xy)), _ALONG)


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


def _strains(
    plate: Plate, linear: LinearState, drift: F64, fraction: float, touch: F64
) -> tuple[F64, F64]:
    """Strain (K, 3) of the touched face about a touch, by linear theory and as it is."""
    xy = _about(plate, touch)
    bending = linear.strain(xy)
    return bending, fraction * bending + _middle_strain(plate, linear, drift, fraction, xy)


def _middle_strain(plate: Plate, linear: LinearState, drift: F64, fraction: float, xy: F64) -> F64:
    """Strain of the middle surface under a part of the deflection, (K, 3) float64.

    Parameters
    ----------
    plate : Plate
    linear : LinearState
    drift : (2, 2 nx + 2, 2 ny + 2, 1) float64, mm
        Unknowns of the displacement in the plane.
    fraction : float
        Of the linear deflection.
    xy : (K, 2) float64, mm
    """
    (ux, uy), (vx, vy) = (_gradient(linear.mesh, np.ascontiguousarray(u), xy) for u in drift)
    wx, wy = fraction * linear.slope(xy).T
    steeper = wx, wy
    if plate.shape is not None:
        rx, ry = (plate.shape.at(plate.size, xy, p, 1 - p) for p in (1, 0))
        steeper = wx + 2.0 * rx, wy + 2.0 * ry
    return (np.stack([ux, vy, (uy + vx) / 2]) + stretch((wx, wy), steeper)).T


def _gradient(mesh: Mesh, values: F64, xy: F64) -> tuple[F64, F64]:
    along, across = (derivative(mesh, xy, p, 1 - p).of(values)[:, 0] for p in (1, 0))
    return along, across


def _over(plate: Plate, fractions: F64) -> F64:
    """Grid of places at these fractions of both sides, (K, 2) float64, mm."""
    return _grid(*(fractions * side for side in plate.size))


def _about(plate: Plate, touch: F64) -> F64:
    """Grid of places where a touch (2,) mm strains the plate, (K, 2) float64, mm."""
    width = min(plate.size)
    along: list[F64] = []
    for middle, side in zip(touch.tolist(), plate.size, strict=True):
        low, high = max(0.0, middle - _FAR * width), min(side, middle + _FAR * width)
        count = 2 * round(0.5 * _SEEN * (high - low) / width)
        along.append(low + (high - low) * (np.arange(count) + 0.5) / count)
    return _grid(*along)


def _grid(along_x: F64, along_y: F64) -> F64:
    x, y = np.meshgrid(along_x, along_y)
    return np.column_stack([x.ravel(), y.ravel()])
