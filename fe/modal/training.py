"""States in the plane of a plate on benches of many kinds, to learn its stresses from.

The first ones are those of light touches, whose deflections are linear. What follows from them is
good enough to bend the plate on benches drawn at random, by touches of any size: those are the
states that are met in use.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.linear.membrane import Membrane, Stretched, stretch
from fe.modal.bench import BenchPlate
from fe.modal.parameters import MEMBRANE, NAMES, ROTATION, SHAPE, TENSION
from fe.modal.plate import ModalPlate
from fe.modal.stresses import SOFT, softened
from fe.modal.transverse import Transverse
from fe.reduced.parallel import in_parallel
from fe.reduced.training import evenly

_PRESSED = (6, 4)  # places of light touches, along the longer side and the other
BENCHES, _TOUCHES = 28, 16
"""Drawn, and on each of them."""
_MARGIN = 0.06  # of a side, nearer to an edge than which none presses
_SMALLEST = 0.2  # force, of the largest
_FARTHEST = 5.0  # thicknesses by which the largest would bend the plate if it were linear
# Of a bench: shape at rest in thicknesses, strain by tension, and how far edges give, in parts of
# what the whole plate does.
_SHAPE, _STRAIN, _ROTATION = 0.15, 3.5e-5, 0.02


class _Bent(NamedTuple):
    """Deflections of a bench (2 nx + 2, 2 ny + 2, C), its shape (…, 1) and edges (4,) mm²/N."""

    values: F64
    shape: F64
    giving: F64


def light(functions: Transverse, shapes: F64) -> Stretched:
    """States of light touches, of turned edges, and of both with a shape at rest."""
    rigid = Membrane(functions.held, functions.mesh)
    touched, turned = (rigid.gauss.slopes(part) for part in _light(functions))
    following = np.roll(touched[0], 1, axis=2), np.roll(touched[1], 1, axis=2)
    parts = [stretch(touched, touched), stretch(touched, following), stretch(turned, turned)]
    mixture = np.random.default_rng(0).standard_normal((shapes.shape[2], len(touched[0].T)))
    parts.append(stretch(rigid.gauss.slopes(shapes @ mixture), touched))
    strain = np.concatenate(parts, axis=3)
    side = np.sqrt(functions.held.area) / (functions.held.young * functions.held.thickness)
    kinds = np.zeros(4), np.full(4, SOFT * side)
    return _joined([softened(rigid, giving).relax(strain) for giving in kinds])


def _light(functions: Transverse) -> tuple[F64, F64]:
    """Deflections of light touches over the plate, and of all turns: (2 nx + 2, 2 ny + 2, C)."""
    a, b = functions.mesh.size
    counts = _PRESSED if a >= b else _PRESSED[::-1]
    x, y = (side * (np.arange(n) + 0.5) / n for side, n in zip((a, b), counts, strict=True))
    modes = slice(functions.count)
    amplitudes = functions.at(np.array(list(product(x, y))))[:, modes]
    amplitudes = amplitudes / np.diag(functions.stiffness)[modes]
    touched = functions.values[..., modes] @ amplitudes.T
    turned = functions.values[..., functions.count :]
    largest = [np.abs(part[::2, ::2]).max(initial=1e-9) for part in (touched, turned)]
    return touched / largest[0], turned / largest[1]


def drawn(
    functions: Transverse, shapes: F64, modal: ModalPlate, step: Callable[[], object]
) -> Stretched:
    """States of touches on benches drawn at random, bent as `modal` bends; a `step` after each."""
    rigid = Membrane(functions.held, functions.mesh)
    rng = np.random.default_rng(0)
    pressed = evenly(BENCHES * _TOUCHES, 6).reshape(BENCHES, _TOUCHES, 2, 3)
    benches = [_bench(modal, number, rng) for number in range(BENCHES)]

    def relaxed(number: int) -> Stretched:
        bent = _bent(modal, shapes, benches[number], pressed[number])
        slopes, rest = rigid.gauss.slopes(bent.values), rigid.gauss.slopes(bent.shape)
        steeper = slopes[0] + 2.0 * rest[0], slopes[1] + 2.0 * rest[1]
        return softened(rigid, bent.giving).relax(stretch(slopes, steeper))

    states: list[Stretched] = []
    for state in in_parallel(relaxed, range(BENCHES)):
        states.append(state)
        step()
    return _joined(states)


def _bench(modal: ModalPlate, number: int, rng: np.random.Generator) -> F64:
    """Draw a bench (54,); of four one has rigid clamps, and one a single soft clamp."""
    plate, values = modal.plate, np.zeros(len(NAMES))
    side, stiff = np.sqrt(plate.area), plate.young * plate.thickness
    values[SHAPE] = rng.normal(0.0, _SHAPE * plate.thickness, len(values[SHAPE]))
    tension = rng.normal(0.0, _STRAIN * stiff / (1.0 - plate.poisson), 3)
    values[TENSION] = tension * [1.0, 1.0, 0.3]
    kinds = [np.zeros(4), np.eye(4)[number // 4 % 4], rng.uniform(size=4), rng.uniform(size=4)]
    giving = kinds[number % 4]
    values[MEMBRANE][::2] = giving * SOFT * side / stiff
    values[ROTATION][::2] = giving * _ROTATION * side / plate.rigidity
    return values


def _bent(modal: ModalPlate, shapes: F64, values: F64, fractions: F64) -> _Bent:
    """Press a bench, every fourth time at two places; `fractions` (T, 2, 3) of sides and force."""
    bench, largest, found = BenchPlate(modal, values), _largest(modal), list[F64]()
    places = (_MARGIN + (1.0 - 2.0 * _MARGIN) * fractions[..., :2]) * modal.mesh.size
    forces = (_SMALLEST + (1.0 - _SMALLEST) * fractions[..., 2:]) * largest
    pressed: F64 = np.concatenate([places, forces], axis=2)
    for number in range(len(pressed)):
        state = bench.press(pressed[number, : 2 if number % 4 == 3 else 1])
        if state.converged:
            found.append(state.amplitudes)
    shape = shapes @ (values + modal.described)[SHAPE]
    giving = (values + modal.described)[MEMBRANE][::2]
    return _Bent(modal.values @ np.array(found).T, shape[..., None], giving)


def _largest(modal: ModalPlate) -> float:
    """Force, N, of the largest touch to learn from."""
    x, y = (side * (np.arange(9) + 0.5) / 9.0 for side in modal.mesh.size)
    at = modal.value(np.array(list(product(x, y))))[:, : modal.count]
    softest = float(np.max(at**2 @ (1.0 / np.diag(modal.stiffness)[: modal.count])))
    return _FARTHEST * modal.plate.thickness / softest


def _joined(states: list[Stretched]) -> Stretched:
    return Stretched(
        np.concatenate([state.stress for state in states], axis=3),
        np.concatenate([state.values for state in states], axis=3),
    )
