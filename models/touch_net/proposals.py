"""From the net's numbers to touches, and how far proposals are from the truth."""

from __future__ import annotations

from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np

from models.arrays import F32, F64
from models.touch_net.network import SLOTS
from models.touch_net.prior import MAX_TOUCHES, TouchRange

if TYPE_CHECKING:
    from torch import Tensor

_NEAR = 0.03  # of half the range: beyond it errors count in proportion, below it squared


def slots(number: int) -> slice:
    """Which of the ten proposed touches are those for `number` of them."""
    first = number * (number - 1) // 2
    return slice(first, first + number)


def proposed_touches(out: F32, touches: TouchRange) -> F64:
    """Touches (…, 10, 3) that a net proposes, within their range."""
    scaled = np.tanh(out[..., : 3 * SLOTS].astype(np.float64))
    return touches.unscaled(scaled.reshape(*out.shape[:-1], SLOTS, 3))


def proposal_loss(out: Tensor, true: Tensor, number: Tensor) -> Tensor:
    """Distance of proposals to the truth, whatever their order, and log loss of the number.

    Parameters
    ----------
    out : (N, 35) tensor
    true : (N, 4, 3) tensor
        Scaled touches, the first `number` of each row.
    number : (N,) int tensor
    """
    from torch.nn.functional import cross_entropy

    scaled = out[:, : 3 * SLOTS].tanh().reshape(-1, SLOTS, 3)
    total = 0.3 * cross_entropy(out[:, 3 * SLOTS :], number, reduction="sum")
    for n in range(1, MAX_TOUCHES + 1):
        chosen = number == n
        if chosen.any():
            total = total + _set_loss(scaled[chosen, slots(n)], true[chosen, :n])
    return total / len(out)


def _set_loss(found: Tensor, true: Tensor) -> Tensor:
    """Sum over touches of the best order, (N, n, 3) each."""
    import torch

    apart = found[:, :, None] - true[:, None]
    each = ((apart.square() + _NEAR**2).sqrt() - _NEAR).sum(dim=3)
    n = true.shape[1]
    orders = torch.tensor(list(permutations(range(n))), device=true.device)
    return each[:, torch.arange(n, device=true.device), orders].sum(dim=2).amin(dim=1).sum()
