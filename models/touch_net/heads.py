"""Training of what looks at fits: how many touches there are, and how they scatter."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from models.arrays import F32, F64, I64
from models.scores.matching import pair
from models.touch_net.features import touch_features
from models.touch_net.network import COUNT, EACH, PARTS, TOUCH, Weights, run_torch
from models.touch_net.posterior import FIRST, WIDTHS
from models.touch_net.prior import MAX_TOUCHES, TouchRange
from models.touch_net.touch_net import KnownForward, reader_of

if TYPE_CHECKING:
    from torch import Tensor


class DrawnFits(NamedTuple):
    """How proposals fitted some drawn touches.

    Attributes
    ----------
    counts : (N, 32) float32
        Features of the number.
    evidence : (N, 5) float32
        What each number begins with.
    number : (N,) int
    touches : (M, 27) float32
        Features of touches whose number was right.
    off : (M, 3) float32
        Truth less fit, in units of the factor of its covariance.
    """

    counts: F32
    evidence: F32
    number: I64
    touches: F32
    off: F32


def draw_fits(
    weights: Weights,
    bench: KnownForward,
    touches: TouchRange,
    size: int,
    rng: np.random.Generator,
) -> DrawnFits:
    """Draw touches, each number as often as any other, and fit what proposals make of them."""
    reader = reader_of(weights, touches, bench)
    forward = bench.forward
    counts, evidence = list[F64](), list[F64]()
    features, off = list[F64](), list[F64]()
    numbers = rng.integers(0, MAX_TOUCHES + 1, size)
    for number in numbers.tolist():
        truth = touches.draw(rng, number)
        measured = truth[:, 2] @ forward.response(truth[:, :2])
        measured = np.asarray(measured + rng.standard_normal(forward.shape[0]), np.float64)
        seen = reader.look(measured)
        counts.append(seen.features)
        evidence.append(seen.logits)
        found = int(seen.probability.argmax())
        if found != number or not number:
            continue
        certainty = float(np.log(seen.probability[found]))
        strange = reader.strangeness(seen.fits.residual[found - 1])
        each, factors = touch_features(seen.fits, found, certainty, strange, touches.bounds)
        here, true = pair(seen.fits.touches[found - 1, :found, :2], truth[:, :2])
        apart = truth[true] - seen.fits.touches[found - 1, here]
        features.append(each[here])
        white = np.linalg.solve(factors[here], apart[..., None])
        off.append(np.asarray(white[..., 0], np.float64))
    return DrawnFits(
        np.array(counts, np.float32),
        np.array(evidence, np.float32),
        numbers,
        np.concatenate(features).astype(np.float32),
        np.clip(np.concatenate(off), -1e4, 1e4).astype(np.float32),
    )


def head_loss(weights: dict[str, Tensor], fits: DrawnFits, device: str) -> Tensor:
    """Log loss of the number, and of the truth about each fit."""
    import torch
    from torch.nn.functional import cross_entropy

    counts, evidence, touches, off = (
        torch.tensor(array, device=device)
        for array in (fits.counts, fits.evidence, fits.touches, fits.off)
    )
    out = run_torch(weights, COUNT, "count", counts) + evidence
    number = torch.tensor(fits.number, device=device)
    total = cross_entropy(out, number)
    return total + 0.3 * scatter_loss(run_torch(weights, TOUCH, "touch", touches), off)


def scatter_loss(out: Tensor, off: Tensor) -> Tensor:
    """Negative log density of what fits are off, (M, 3), under mixtures (M, 40), a touch."""
    import torch

    raw = out.reshape(-1, PARTS, EACH)
    widths = torch.tensor(WIDTHS, dtype=raw.dtype, device=raw.device)
    first = torch.tensor(FIRST, dtype=raw.dtype, device=raw.device)
    weight = torch.log_softmax(raw[..., 0] + first, dim=1)
    left = off[:, None] - raw[..., 1:4]
    size = (raw[..., 4:7] + widths[:, None]).clamp(-6.0, 6.0)
    one = left[..., 0] * torch.exp(-size[..., 0])
    two = (left[..., 1] - raw[..., 7] * one) * torch.exp(-size[..., 1])
    three = (left[..., 2] - raw[..., 8] * one - raw[..., 9] * two) * torch.exp(-size[..., 2])
    square = one.square() + two.square() + three.square()
    each = weight - 0.5 * square - size.sum(dim=2)
    return -torch.logsumexp(each, dim=1).mean()
