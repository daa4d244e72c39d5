"""What the image net makes of a pair: passes, of which each starts where the last has ended."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter, uniform_filter

from models.arrays import F32, Mask
from models.image_net.features import WINDOWS, PairFeatures, pair_features
from models.image_net.network import mixed, run
from models.image_net.store import ImageNet
from models.image_net.warped_pair import ImagePair, Motion, on_pixels

PASSES = 2
_AROUND = 17  # cells, over which what is left of a motion is compared with noise
_MISFIT = 4.0  # times the mean square that noise leaves in a window
_ALIKE = 0.8  # ZNCC of both images around a cell, below which it is not the same pattern
_SLACK = 1.2  # by which the range of the inputs in training is widened
_RIM = 5  # cells around one that is unknown, which are not known either


@dataclass(frozen=True, eq=False)
class RefinedCells:
    """Motion of the cells of a pair.

    Attributes
    ----------
    motion : (2, R, C) float32, px
    sigma : (2, R, C) float32, px
    known : (R, C) bool
        Where the net has seen the like, and its motion leaves no more than noise.
    """

    motion: F32
    sigma: F32
    known: Mask


def refine(net: ImageNet, pair: ImagePair, motion: Motion) -> RefinedCells:
    """Refine a motion that is nearly right."""
    strange, cells = np.zeros((1, 1), bool), motion.cells
    for _ in range(PASSES):
        seen = pair_features(pair, motion)
        strange = _strange(net, seen)
        cells, sigma = _refined(net, seen, motion)
        motion = Motion(on_pixels(np.nan_to_num(cells), pair.first.shape), sigma)
    left = pair_features(pair, motion)
    wrong = strange | _misfits(left) | ~np.isfinite(cells + motion.sigma).all(axis=0)
    wrong |= left.zncc < _ALIKE
    return RefinedCells(cells, motion.sigma, ~np.asarray(maximum_filter(wrong, _RIM), bool))


def evaluate(net: ImageNet, inputs: F32) -> F32:
    """Run the net: (B, INPUTS, R, C) float32, (B, OUTPUTS, R, C)."""
    import torch

    weights = {name: torch.from_numpy(array) for name, array in net.weights.items()}
    with torch.inference_mode():
        return np.asarray(run(weights, torch.from_numpy(inputs)).numpy())


def _refined(net: ImageNet, seen: PairFeatures, motion: Motion) -> tuple[F32, F32]:
    rows, columns = seen.size.shape
    out = evaluate(net, seen.inputs[None])[..., :rows, :columns]
    moved, growth = mixed(out, seen.windows[None], seen.size[None])
    return motion.cells + moved[0], motion.sigma * np.exp(growth[0])


def _strange(net: ImageNet, seen: PairFeatures) -> Mask:
    """Cells of which an input lies outside of what training has seen."""
    middle, half = (net.high + net.low) / 2, _SLACK * (net.high - net.low) / 2
    rows, columns = seen.size.shape
    return ~np.all(np.abs(seen.inputs - middle) <= half, axis=0)[:rows, :columns]


def _misfits(left: PairFeatures) -> Mask:
    """Cells around which more is left than noise leaves."""
    chi = np.square(left.windows[:, _FIVE] / left.noise).mean(axis=0)
    return np.asarray(uniform_filter(chi, _AROUND, mode="nearest")) > _MISFIT


_FIVE = WINDOWS.index((5, 5))
