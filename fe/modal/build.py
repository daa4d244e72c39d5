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
from fe.linear.membrane import Membrane, stretch
from fe.modal.parameters import DEGREES
from fe.modal.plate import Corrections, ModalPlate
from fe.modal.readings import Readings
from fe.modal.shapes import shapes
from fe.modal.stresses import Stresses, grading, stresses, stretching_read
from fe.modal.training import BENCHES, drawn, light
from fe.modal.transverse import WAVES, Transverse, bending_read, transverse
from fe.plate.checks import whole
from fe.plate.plate import Plate
from fe.reduced.parallel import in_parallel

_ELEMENTS = 40  # along the longer side
_MODES = 160
_FINE_WAVES = 8  # of an edge that turns under gauges
_STRESSES, _DRIFTS = 110, 160
_COARSE = 60, 1  # stresses and drifts of the plate whose states are learned from


class _Long(NamedTuple):
    """How long each part of the way is, in those of a bench that is drawn."""

    functions: int = 4
    light: int = 8
    near: int = 17
    drawn: int = BENCHES
    stresses: int = 7
    products: int = 23


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
    bent = _bending(functions)
    near = _assembled(plate, functions, forms, bent, coarse)
    step(_LONG.near)
    learned = stresses(functions, drawn(functions, forms, near, step), _STRESSES, _DRIFTS)
    step(_LONG.stresses)
    if readings is None:
        found = _assembled(plate, functions, forms, bent, learned)
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
    found = _assembled(plate, functions, forms, _bending(functions), plane)
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


class _Bending(NamedTuple):
    """Products of the functions of a plate with one another that ask for no stress in its plane.

    Attributes
    ----------
    graded : (27, n, n) float64, N/mm
    tense : (3, n, n) float64
    """

    graded: F64
    tense: F64


def _bending(functions: Transverse) -> _Bending:
    gauss = Membrane(functions.held, functions.mesh).gauss
    slopes = gauss.slopes(functions.values)
    return _Bending(_graded(functions, gauss), _products(gauss, _uniform(gauss), slopes, slopes))


def _assembled(
    plate: Plate, functions: Transverse, forms: F64, bent: _Bending, plane: Stresses
) -> ModalPlate:
    """Multiply all functions of a plate with one another."""
    rigid = Membrane(functions.held, functions.mesh)
    slopes = rigid.gauss.slopes(functions.values)
    all_stresses = np.concatenate([plane.stress, -plane.reading], axis=3)
    return ModalPlate(
        plate=plate,
        mesh=functions.mesh,
        count=functions.count,
        values=functions.values,
        drifts=plane.drifts,
        stiffness=functions.stiffness,
        graded=bent.graded,
        turning=functions.giving,
        tense=bent.tense,
        stretching=_triangles(rigid, all_stresses, slopes),
        shaped=_over_shapes(rigid.gauss, all_stresses, slopes, forms),
        easing=_easing(rigid, plane.stress),
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


def _graded(functions: Transverse, gauss: Gauss) -> F64:
    """Bending energy, times 3, of thicknesses that rise: (27, n, n)."""
    (xx, yy, xy), nu = _curvatures(functions, gauss), functions.held.poisson
    rigidity = rigidities(functions.held, functions.mesh)
    points = len(gauss.x.places) // functions.mesh.counts[0]
    rigidity = rigidity.repeat(points, axis=0).repeat(points, axis=1)

    def energy(rise: F64) -> F64:
        weight = (3.0 * rise * rigidity * gauss.weights).reshape(-1, 1)
        mixed = xx.T @ (weight * (xx + nu * yy)) + yy.T @ (weight * (yy + nu * xx))
        return mixed + 2.0 * (1.0 - nu) * xy.T @ (weight * xy)

    return np.stack(list(in_parallel(energy, _rising(gauss))))


def _easing(rigid: Membrane, stress: F64) -> F64:
    """Complementary energy of stresses in thicknesses that rise: (27, M, M)."""
    return np.stack(
        list(in_parallel(lambda rise: grading(rigid, stress, rise), _rising(rigid.gauss)))
    )


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
        found[m] = (area * (xx * lx + xy * ly)).T @ rx + (area * (xy * lx + yy * ly)).T @ ry
    return found


def _triangles(rigid: Membrane, stress: F64, slopes: tuple[F64, F64]) -> F32:
    """Lower triangles of `_products` of stresses with functions and these: (M, n (n + 1) / 2).

    A row of all triangles is the work of all stresses on the strain of its pairs, one product of
    matrices in single precision: what is kept of them is no more.
    """
    work = rigid.weigh(stress)
    along, across = (part.reshape(-1, part.shape[2]).astype(np.float32) for part in slopes)
    count = along.shape[1]
    found = np.empty((len(work), count * (count + 1) // 2), dtype=np.float32)

    def fill(row: int) -> None:
        one, upto = slice(row, row + 1), slice(row + 1)
        pairs = stretch((along[:, one], across[:, one]), (along[:, upto], across[:, upto]))
        first = row * (row + 1) // 2
        # The strain of a pair is half of its product.
        found[:, first : first + row + 1] = 2.0 * (work @ pairs.reshape(work.shape[1], -1))

    for _ in in_parallel(fill, range(count)):
        pass
    return found


def _over_shapes(gauss: Gauss, stress: F64, slopes: tuple[F64, F64], forms: F64) -> F64:
    """Products of stresses with shapes and functions, (S, M, n)."""
    found = _products(gauss, stress, gauss.slopes(forms), slopes)
    return np.ascontiguousarray(found.swapaxes(0, 1))
