"""What the image net makes of a pair: passes, of which each starts where the last has ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from models.arrays import F32, Mask
from models.image_net.features import PairFeatures, pair_features
from models.image_net.network import mixed, run
from models.image_net.store import ImageNet
from models.image_net.warped_pair import ImagePair, PairMotion, on_pixels
from models.nets.on_device import run_on

if TYPE_CHECKING:
    from torch import Tensor

PASSES = 2
_AROUND = 17  # cells, over which what is left of a motion is compared with noise
_MISFIT = 4.0  # times the mean square that noise leaves in a window
_FARTHEST = 1.5  # px of a pass, of which training held no more
_ALIKE = 0.8  # ZNCC of both images around a cell, below which it is not the same pattern
_IDLE = 0.6  # of the noise of a window of 5 x 5 cells: a change that the net makes of noise alone
_SLACK = 1.2  # by which the range of the inputs in training is widened
_LOUD = 2.5  # times the residual of all, from which something else than noise is in it
_NEAR = 5  # cells, over which what no motion explains is compared with that of all
_FEW = 0.005  # part of the cells with more left than noise, at least, for another pass
_WORSE = 0.02  # part by which a motion may leave more of the images than the one before the net
_RIM = 15  # cells around one that is unknown, which are not known either


@dataclass(frozen=True, eq=False)
class RefinedCells:
    """Motion of the cells of a pair.

    Attributes
    ----------
    motion : (2, R, C) float32, px
    sigma : (2, R, C) float32, px
    known : (R, C) bool
        Where the net has seen the like, and its motion leaves no more than noise, and no more than
        the motion that it began with.
    changed : (R, C) bool
        Where it differs from that motion, because the net says more than it makes of noise.
    """

    motion: F32
    sigma: F32
    known: Mask
    changed: Mask


def refine(net: ImageNet, pair: ImagePair, motion: PairMotion, device: str = "cpu") -> RefinedCells:
    """Refine a motion that is nearly right, until it leaves no more than noise.

    Parameters
    ----------
    net : ImageNet
    pair : ImagePair
    motion : PairMotion
        To start from.
    device : str
        Where torch runs the net.
    """
    first = seen = pair_features(pair, motion)
    strange, changed = np.zeros((2, *seen.noise.shape), bool)
    for _ in range(PASSES):
        cells, sigma, wild = _refined(net, seen, motion, device)
        strange |= wild | _strange(net, seen)
        changed |= np.any(cells != motion.cells, axis=0)
        motion = PairMotion(on_pixels(cells, pair.first.shape), sigma)
        seen = pair_features(pair, motion)
        if np.mean((_left(seen, seen.five) > _MISFIT)[seen.looked_at]) < _FEW:
            break
    wrong = strange | _misfits(seen) | _worse(first, seen) | (seen.zncc < _ALIKE)
    known = ~np.asarray(maximum_filter(wrong, _RIM), bool)
    return RefinedCells(motion.cells, motion.sigma, known, changed)


def evaluate(net: ImageNet, inputs: F32, device: str = "cpu") -> F32:
    """Run the net: (B, INPUTS, R, C) float32, (B, OUTPUTS, R, C)."""
    return run_on(device, _side_by_side, net.weights, inputs)


def _side_by_side(weights: dict[str, Tensor], inputs: Tensor) -> Tensor:
    """Run the net with the channels of a cell side by side: its convolutions are faster so."""
    import torch

    def laid(array: Tensor) -> Tensor:
        return array.contiguous(memory_format=torch.channels_last) if array.ndim == 4 else array

    return run({name: laid(array) for name, array in weights.items()}, laid(inputs))


def _refined(
    net: ImageNet, seen: PairFeatures, motion: PairMotion, device: str
) -> tuple[F32, F32, Mask]:
    """Motion and σ of the cells after a pass, (2, R, C) each, and where it went wild, (R, C)."""
    rows, columns = seen.noise.shape
    out = evaluate(net, seen.inputs[None], device)[..., :rows, :columns]
    moved, growth = (part[0] for part in mixed(out, seen.windows[None], seen.size[None]))
    wild = ~np.all(np.abs(moved) <= _FARTHEST, axis=0) | ~np.isfinite(growth).all(axis=0)
    moved, growth = np.where(wild, 0, moved), np.where(wild, 0, growth)
    weight = _shrinkage(moved, seen.noise)
    sigma = motion.sigma * (1 + weight * (np.exp(growth) - 1))
    return motion.cells + weight * moved, sigma, wild


def _shrinkage(moved: F32, noise: F32) -> F32:
    """Part of a change that is taken, (2, R, C): none where it is no larger than noise makes it.

    The positive part of James and Stein (1961), over the cells around each.
    """
    power = np.stack([uniform_filter(np.square(part), _AROUND, mode="nearest") for part in moved])
    return np.maximum(1 - np.square(_IDLE * noise) / np.maximum(power, 1e-12), 0)


def _strange(net: ImageNet, seen: PairFeatures) -> Mask:
    """Cells of which an input lies outside of what training has seen."""
    middle, half = (net.high + net.low) / 2, _SLACK * (net.high - net.low) / 2
    rows, columns = seen.noise.shape
    return ~np.all(np.abs(seen.inputs - middle) <= half, axis=0)[:rows, :columns]


def _misfits(left: PairFeatures) -> Mask:
    """Cells around which a motion is left, or more of the images, than noise leaves."""
    near = np.asarray(uniform_filter(left.left, _NEAR, mode="nearest"))
    usual = np.median(left.left[left.looked_at])
    return (_left(left, left.five) > _MISFIT) | (near > _LOUD * usual)


def _worse(before: PairFeatures, after: PairFeatures) -> Mask:
    """Cells around which the net leaves more motion in the images than it has found there."""
    worse = np.zeros(after.noise.shape, bool)
    for now, then in ((after.five, before.five), (after.nine, before.nine)):
        worse |= _left(after, now) > (1 + _WORSE) * _left(before, then)
    return worse


def _left(seen: PairFeatures, motion: F32) -> F32:
    """Mean square of the motion in windows (R, C, 2), over the variance of those of 5 x 5 cells."""
    chi = np.square(motion / seen.noise[..., None]).mean(axis=-1)
    around: F32 = np.empty_like(chi)
    uniform_filter(chi, _AROUND, output=around, mode="nearest")
    return around
