"""Build a modal plate: its functions, what they learn from, and their products."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander

from fe.arrays import F32, F64
from fe.elements.gauss import Gauss, dense
from fe.elements.mesh import Mesh, even_grid
from fe.linear.energy import rigidities
from fe.linear.membrane import Membrane
from fe.modal.parameters import DEGREES
from fe.modal.plate import Corrections, ModalPlate
from fe.modal.readings import Readings
from fe.modal.shapes import shapes
from fe.modal.stresses import Stresses, grading, stresses, stretching_read
from fe.modal.training import BENCHES, drawn, light
from fe.modal.transverse import WAVES, Transverse, bending_read, transverse
from fe.plate.checks import whole
from fe.plate.plate import Plate

_ELEMENTS = 40  # along the longer side
_MODES = 160
_FINE_WAVES = 8  # of an edge that turns under gauges
_STRESSES, _DRIFTS = 110, 160
_COARSE = 60, 1  # stresses and drifts of the plate whose states are learned from


class _Long(NamedTuple):
    """How long each part of the way is, in those of a bench that is drawn."""

    functions: int = 3
    light: int = 8
    near: int = 10
    drawn: int = BENCHES
    stresses: int = 6
    products: int = 20


_LONG = _Long()


def modal_plate(
    plate: Plate,
    count: int = _MODES,
    mesh: Mesh | None = None,
    progress: Callable[[int, int], object] = lambda done, total: None,
    readings: Readings | None = None,
) -> ModalPlate:
    """Compute the products for a plate; half a minute.

    Parameters
    ----------
    plate : Plate
    count : int
        Number of modes.
    mesh : Mesh, optional
        `even_grid(plate, 40)` if left out.
    progress : callable
        Called with how many of how many steps of like length are done.
    readings : Readings, optional
        What is read, exactly as a mesh has it: modes and drifts converge slowly to a strain at an
        edge. One detail, by 1 N, is what the modes leave of each, and one drift its stretching.

    Raises
    ------
    ValueError
        The mesh cannot carry that many modes.
    """
    total, done = sum(_LONG), 0

    def step(long: int = 1) -> None:
        nonlocal done
        done += long
        progress(done, total)

    step(0)
    mesh = even_grid(plate, _ELEMENTS) if mesh is None else mesh
    waves = WAVES if readings is None else _FINE_WAVES
    functions = transverse(plate, mesh, whole(count, "number of modes"), waves)
    forms = shapes(plate, mesh)
    step(_LONG.functions)
    coarse = stresses(functions, light(functions, forms), *_COARSE)
    step(_LONG.light)
    near = _assembled(plate, functions, forms, coarse)
    step(_LONG.near)
    learned = stresses(functions, drawn(functions, forms, near, step), _STRESSES, _DRIFTS)
    step(_LONG.stresses)
    if readings is None:
        found = _assembled(plate, functions, forms, learned)
    else:
        found = _read(plate, functions, forms, learned, readings)
    step(_LONG.products)
    return found


def _read(
    plate: Plate, functions: Transverse, forms: F64, plane: Stresses, readings: Readings
) -> ModalPlate:
    """Multiply all functions, and those that bend and stretch as a reading shows it."""
    plane = stretching_read(functions, plane, readings.stretched)
    functions = bending_read(functions, readings.bent)
    found = _assembled(plate, functions, forms, plane)
    return replace(found, corrections=_corrections(functions, forms, plane))


def _corrections(functions: Transverse, forms: F64, plane: Stresses) -> Corrections:
    """Multiply the details of a plate with all its functions and shapes."""
    gauss = Membrane(functions.held, functions.mesh).gauss
    slopes, own = gauss.slopes(functions.values), gauss.slopes(functions.details)
    uniform = _uniform(gauss)
    return Corrections(
        tense=_products(gauss, uniform, own, slopes),
        stretching=_products(gauss, plane.stress, own, slopes),
        shaped=_over_shapes(gauss, plane.stress, own, forms),
    )


def _uniform(gauss: Gauss) -> F64:
    """Stresses xx, yy and xy of 1 N/mm at the Gauss points, (3, gx, gy, 3)."""
    return np.eye(3)[:, None, None, :] * np.ones((1, *gauss.weights.shape, 1))


def _assembled(plate: Plate, functions: Transverse, forms: F64, plane: Stresses) -> ModalPlate:
    """Multiply all functions of a plate with one another."""
    rigid = Membrane(functions.held, functions.mesh)
    slopes, rising = rigid.gauss.slopes(functions.values), _rising(rigid.gauss)
    all_stresses = np.concatenate([plane.stress, -plane.reading], axis=3)
    return ModalPlate(
        plate=plate,
        mesh=functions.mesh,
        count=functions.count,
        values=functions.values,
        drifts=plane.drifts,
        stiffness=functions.stiffness,
        graded=_graded(functions, rigid.gauss, rising),
        turning=functions.giving,
        tense=_products(rigid.gauss, _uniform(rigid.gauss), slopes, slopes),
        stretching=_triangles(_products(rigid.gauss, all_stresses, slopes, slopes)),
        shaped=_over_shapes(rigid.gauss, all_stresses, slopes, forms),
        easing=np.stack([grading(rigid, plane.stress, weight) for weight in rising]),
        giving=plane.giving,
        slipping=plane.slipping,
        details=functions.details,
        firmness=functions.firmness,
    )


def _legendre(places: F64, highest: int) -> F64:
    """Legendre polynomials from one side of the plate to the other, (g, highest + 1)."""
    along = 2.0 * places / (places[0] + places[-1]) - 1.0
    return np.asarray(legvander(along, highest), dtype=np.float64)


def _rising(gauss: Gauss) -> F64:
    """Products of Legendre polynomials over the plate at its Gauss points, (27, gx, gy)."""
    highest = max(max(pair) for pair in DEGREES)
    x, y = (_legendre(axis.places, highest) for axis in (gauss.x, gauss.y))
    return np.stack([np.multiply.outer(x[:, i], y[:, j]) for i, j in DEGREES])


def _graded(functions: Transverse, gauss: Gauss, rising: F64) -> F64:
    """Bending energy, times 3, of thicknesses that rise: (27, n, n)."""
    (xx, yy, xy), nu = _curvatures(functions, gauss), functions.held.poisson
    rigidity = rigidities(functions.held, functions.mesh)
    points = len(gauss.x.places) // functions.mesh.counts[0]
    rigidity = rigidity.repeat(points, axis=0).repeat(points, axis=1)
    found: list[F64] = []
    for rise in rising:
        weight = (3.0 * rise * rigidity * gauss.weights).reshape(-1, 1)
        mixed = xx.T @ (weight * (xx + nu * yy)) + yy.T @ (weight * (yy + nu * xx))
        found.append(mixed + 2.0 * (1.0 - nu) * xy.T @ (weight * xy))
    return np.stack(found)


def _curvatures(functions: Transverse, gauss: Gauss) -> tuple[F64, F64, F64]:
    """Second derivatives xx, yy, xy at all Gauss points, three (gx gy, n)."""
    (x, y), values = functions.mesh.lines, functions.values
    n = values.shape[2]

    def derived(along: F64, across: F64) -> F64:
        return (across @ np.tensordot(along, values, 1)).reshape(-1, n)

    bent_x, bent_y = dense(gauss.x.places, x, 2), dense(gauss.y.places, y, 2)
    return (
        derived(bent_x, gauss.y.value),
        derived(gauss.x.value, bent_y),
        derived(gauss.x.slope, gauss.y.slope),
    )


def _products(gauss: Gauss, stress: F64, left: tuple[F64, F64], right: tuple[F64, F64]) -> F64:
    """Integrals ∫ N_ab f,a g,b dA of stresses (3, gx, gy, M) with pairs of functions: (M, L, R)."""
    lx, ly, rx, ry = (part.reshape(-1, part.shape[2]) for part in (*left, *right))
    area = gauss.weights.reshape(-1, 1)
    found = np.empty((stress.shape[3], lx.shape[1], rx.shape[1]))
    for m, (xx, yy, xy) in enumerate(np.moveaxis(stress, 3, 0).reshape(stress.shape[3], 3, -1, 1)):
        found[m] = lx.T @ (area * (xx * rx + xy * ry)) + ly.T @ (area * (xy * rx + yy * ry))
    return found


def _triangles(products: F64) -> F32:
    """Lower triangles of symmetric matrices (R, n, n), (R, n (n + 1) / 2)."""
    rows, columns = np.tril_indices(products.shape[1])
    return np.ascontiguousarray(products[:, rows, columns], dtype=np.float32)


def _over_shapes(gauss: Gauss, stress: F64, slopes: tuple[F64, F64], forms: F64) -> F64:
    """Products of stresses with shapes and functions, (S, M, n)."""
    found = _products(gauss, stress, gauss.slopes(forms), slopes)
    return np.ascontiguousarray(found.swapaxes(0, 1))
