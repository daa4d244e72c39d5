"""Frames made of the reference, to go every way through the chain before the first one is shown.

Kernels are compiled, or read from their cache, when they are first called. What a run may meet is
made up here, so that this happens while nobody waits: the first touch after an install would freeze
the loop for half a minute.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from dic import TileReference
from rig.live.chain import Chain
from rig.system.arrays import F32, F64, AnyArray, Grey
from rig.system.frame import Frame

Report = Callable[[int, int, str], object]
"""Called as ``report(done, total, what)`` before each of these frames."""

RATE = 30.0  # frames a second, of the times that they bear
ROUND = 0.27  # of the plate's sides, from its middle to the touches
JUMP = (-4, 6)  # px down and to the right, about a speckle: enough to look strange everywhere
SKIN = 90.0  # grey levels
SHADE = 0.6  # of the light


def quiet(done: int, total: int, what: str) -> None:
    """Report to nobody."""


def rehearsal(chain: Chain, force: float, report: Report = quiet) -> Iterator[Frame]:
    """Give frames of all that a run may meet, one after the other.

    Parameters
    ----------
    chain : Chain
        With the reference that they are made of.
    force : float, N
        Of each touch: the largest that is expected.
    report : callable
    """
    scenes = _scenes(chain, force)
    for number, (what, light) in enumerate(scenes.items()):
        report(number, len(scenes), what)
        yield Frame(number, number / RATE, _exposed(light, chain.pixel_noise, number))
    report(len(scenes), len(scenes), "ready")


def _scenes(chain: Chain, force: float) -> dict[str, AnyArray]:
    """Images (H, W) in grey levels, without noise, by what they show."""
    calm, one = chain.reference.image, _pressed(chain, 1, force)
    counts = 2, max(chain.estimator.max_touches, 1) + 2
    several = {f"{count} touches": _pressed(chain, count, force) for count in counts}
    return {
        "no touch": calm,
        "one touch": one,
        **several,
        "a hand": _behind_a_hand(one),
        "a shadow": _in_shade(one),
        "a bump of the camera": np.roll(calm, JUMP, axis=(0, 1)),
    }


def _exposed(light: AnyArray, noise: float, number: int) -> Grey:
    """Take an image, with noise and in whole grey levels."""
    grain = np.random.default_rng(number).standard_normal(light.shape, np.float32)
    return np.rint(light + noise * grain).clip(0, 255).astype(np.uint8)


def _pressed(chain: Chain, count: int, force: float) -> F32:
    """Press the plate at places round its middle, by no more than its thickness.

    Where it bends linearly, the largest force would move a thin plate farther than is followed.
    """
    pattern, motions = chain.pattern, chain.pattern.motions
    turn = 2 * np.pi * (np.arange(count) + 0.3) / count
    fractions = 0.5 + ROUND * np.column_stack([np.cos(turn), np.sin(turn)])
    at = fractions * np.asarray(motions.modes.plate.size)
    bent = motions.modal_amplitudes(at, np.full(count, force))
    deepest = np.abs(motions.modes.value(at) @ bent[: motions.modes.count]).max()
    amplitudes = pattern.still()
    amplitudes[: pattern.count] = bent * min(1.0, motions.modes.plate.thickness / deepest)
    return _moved(chain.reference, motions.flow(amplitudes))


def _moved(reference: TileReference, flow: F64) -> F32:
    """Move what each tile shows by a flow (T, 2) px, to first order: touches move little."""
    tiles, moved = reference.tiles, reference.image.copy()
    (left, top), (rows, columns), size = tiles.origin, tiles.shape, tiles.size
    covered = slice(top, top + size * rows), slice(left, left + size * columns)
    for slope, part in zip(reference.gradient, flow.T.astype(np.float32), strict=True):
        wide = part.reshape(tiles.shape).repeat(size, axis=0).repeat(size, axis=1)
        moved[covered] -= slope[covered] * wide
    return moved


def _behind_a_hand(light: AnyArray) -> F32:
    """Lay a hand over the right half."""
    hidden = light.copy()
    hidden[:, light.shape[1] // 2 :] = SKIN
    return hidden


def _in_shade(light: AnyArray) -> F32:
    """Let the light fall off to the right."""
    return light * np.linspace(1.0, SHADE, light.shape[1], dtype=np.float32)
