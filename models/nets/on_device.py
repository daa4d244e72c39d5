"""Where torch runs a net that was read from a file: on a CPU or on a GPU."""

# Torch states its types in part.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from models.arrays import F32
from models.checks import shown

if TYPE_CHECKING:
    from torch import Tensor

Run = Callable[["dict[str, Tensor]", "Tensor"], "Tensor"]
"""A net of the weights by their names and its inputs (B, C, R, C)."""


def read_device(device: str | None, usual: str | None) -> str:
    """Return the device that is asked for, or the usual one, or torch's CPU.

    Parameters
    ----------
    device : str or None
        Such as "cuda"; None for the usual one.
    usual : str or None
        Such as that of a reference; None for "cpu".

    Raises
    ------
    ValueError
        It is no name, or torch cannot use it here.
    """
    import torch

    chosen = usual or "cpu" if device is None else device
    try:
        torch.zeros(1, device=chosen).cpu()
    except TypeError:
        raise ValueError(
            f"device must be its name, got {shown(chosen)}; give one such as 'cuda' or 'cpu'"
        ) from None
    except (RuntimeError, AssertionError, NotImplementedError):
        raise ValueError(
            f"device {chosen!r} cannot be used by torch here; use 'cpu' or leave device out"
        ) from None
    return chosen


def run_on(device: str, run: Run, weights: Mapping[str, F32], inputs: F32) -> F32:
    """Run a net on arrays.

    Parameters
    ----------
    device : str
        As of `read_device`.
    run : callable
    weights : mapping of float32 arrays
    inputs : (B, C, R, C) float32

    Notes
    -----
    A GPU rounds the factors of convolutions to 10 bits unless it is forbidden: motion in hundredths
    of a px needs all of single precision.
    """
    import torch

    def read(array: F32) -> Tensor:
        return torch.from_numpy(array).to(device)

    exact = torch.backends.cudnn.flags(enabled=True, allow_tf32=False)
    with torch.inference_mode(), exact:
        out = run({name: read(array) for name, array in weights.items()}, read(inputs))
        return np.asarray(out.contiguous().cpu().numpy())
