"""Strain at gauges as a measurement of touches, with any noise that can be stated."""

from __future__ import annotations

from typing import cast

import numpy as np
from numpy.typing import ArrayLike

import fe
from models.arrays import F64, AnyArray, Mask
from models.forward.linear import LinearForward, linear


def gauge_forward(
    influence: fe.Influence,
    sigma: ArrayLike | None = None,
    missing: ArrayLike | None = None,
    covariance: ArrayLike | None = None,
) -> LinearForward:
    """Forward model of strain gauges, or of strain that DIC measures on a plate seen flat.

    Parameters
    ----------
    influence : fe.Influence
        For M gauges.
    sigma : float, (M,) or (M, 3) array, strain
        Standard deviation of each channel, where channels are independent; infinite for one that is
        missing.
    missing : (M, 3) bool, optional
        Channels that are missing.
    covariance : (M, 3, 3) or (3M, 3M) array, strain²
        Instead of `sigma`: of the three channels of each gauge, or of all channels.

    Returns
    -------
    LinearForward
        Measurements of shape (M, 3); m = 3M.

    Raises
    ------
    ValueError
        If not one of sigma and covariance is given, one has the wrong shape or is not positive
        (definite), or no channel is left.
    """
    if (sigma is None) == (covariance is None):
        raise ValueError("noise of strain must be given as sigma or as covariance; give one")
    count = len(influence.gauges)
    lost = np.zeros((count, 3), dtype=np.bool_)
    if missing is not None:
        lost |= _read_missing(missing, count)
    if covariance is not None:
        whitening = _correlated(_read_noise("covariance", covariance), lost)
    else:
        whitening = _independent(_read_noise("sigma", sigma), lost)
    if not whitening.any():
        raise ValueError("every strain channel is missing; give one that was measured")
    values = influence.adjoint.values
    return linear(influence.plate, influence.mesh, values, whitening, (count, 3))


def _read_missing(missing: object, count: int) -> Mask:
    """Read which channels (M, 3) are missing."""
    given: AnyArray = np.array(missing, dtype=getattr(missing, "dtype", object))
    if given.shape != (count, 3) or not all(
        isinstance(lost, bool | np.bool_) for lost in given.flat
    ):
        raise ValueError(
            f"missing channels must be ({count}, 3) bool, got {_named(missing)}; "
            "set True what was not measured"
        )
    return given.astype(np.bool_)


def _read_noise(name: str, values: object) -> F64:
    """Read sigma or covariance of strain, of any shape."""
    try:
        given: AnyArray = np.asarray(values)
    except (TypeError, ValueError):
        raise ValueError(f"{name} of strain must be one array; give equal rows") from None
    if given.dtype.kind not in "fiu":
        raise ValueError(
            f"{name} of strain must be real numbers, got {given.dtype}; convert it to float"
        )
    return np.asarray(given, dtype=np.float64)


def _named(values: object) -> str:
    if isinstance(values, np.ndarray):
        array = cast(AnyArray, values)
        return f"{array.shape} {array.dtype}"
    return f"a {type(values).__name__}"


def _independent(sigma: F64, lost: Mask) -> F64:
    """1/σ of each channel, (3M, 1, 1)."""
    given = sigma[:, None] if sigma.ndim == 1 else sigma
    try:
        spread = np.broadcast_to(given, lost.shape)
    except ValueError:
        raise ValueError(
            f"sigma has shape {sigma.shape} for {len(lost)} gauges; "
            f"give one number, ({len(lost)},) or ({len(lost)}, 3)"
        ) from None
    if not (spread > 0).all():
        worst = spread.min(initial=np.inf)
        raise ValueError(f"sigma of strain must be positive, got {worst:g}; give its noise")
    return np.where(lost, 0.0, 1.0 / spread).reshape(-1, 1, 1)


def _correlated(covariance: F64, lost: Mask) -> F64:
    """Whiten each gauge, (M, 3, 3), or all at once, (1, 3M, 3M)."""
    count = len(lost)
    if covariance.shape not in ((count, 3, 3), (3 * count, 3 * count)):
        raise ValueError(
            f"covariance has shape {covariance.shape} for {count} gauges; "
            f"give ({count}, 3, 3) or ({3 * count}, {3 * count})"
        )
    size = covariance.shape[-1]
    groups, there = covariance.reshape(-1, size, size), ~lost.reshape(-1, size)
    both = there[:, :, None] & there[:, None, :]
    kept = np.where(both, groups, np.eye(size))
    if not np.isfinite(kept).all():
        raise ValueError(
            "covariance of strain holds NaN or infinite values; mark such channels as missing"
        )
    try:
        # Missing channels stand as a diagonal of 1 beside the others and are taken out again.
        whitening = np.linalg.inv(np.linalg.cholesky(kept))
    except np.linalg.LinAlgError:
        raise ValueError(
            "covariance of strain must be positive definite, got one that is not; "
            "state its noise in full or mark the channels as missing"
        ) from None
    return np.where(both, whitening, 0.0)
