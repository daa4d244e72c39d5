"""Forward models: what a unit touch does to a measurement whose noise is white with variance 1.

A solver asks a forward model for the response and its gradient in the touch's place and does not
know what was measured or which theory of plates answers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

import fe


class Forward(Protocol):
    """Whitened linear response of m measurements to touches of 1 N."""

    @property
    def plate(self) -> fe.Plate:
        """The plate that is touched."""
        ...

    def response(self, xy: NDArray) -> NDArray[np.float64]:
        """Whitened response to a touch of 1 N at each place, (n, 2) mm → (n, m) per N."""
        ...

    def gradient(self, xy: NDArray) -> NDArray[np.float64]:
        """Exact derivative of `response` in x and y, (n, 2) mm → (n, m, 2) per N per mm."""
        ...


@dataclass(frozen=True, eq=False)
class Gauges:
    """Strain at gauges, each channel with its own noise.

    Attributes
    ----------
    influence : fe.Influence
        Strain at M gauges for a unit touch anywhere.
    weight : (M, 3) float64
        1/σ of exx, eyy, exy; zero for a channel that is missing. The m channels that are there
        are the measurements.
    """

    influence: fe.Influence
    weight: NDArray[np.float64]

    @property
    def plate(self) -> fe.Plate:
        """The plate that is touched."""
        return self.influence.plate

    def response(self, xy: NDArray) -> NDArray[np.float64]:
        """See `Forward.response`."""
        return self._there(self.influence.strain(xy) * self.weight)

    def gradient(self, xy: NDArray) -> NDArray[np.float64]:
        """See `Forward.gradient`."""
        return self._there(self.influence.gradient(xy) * self.weight[:, :, None])

    def whiten(self, strain: NDArray) -> NDArray[np.float64]:
        """Strain (M, 3) in units of its noise, (m,)."""
        return self._there(strain[None])[0] * self.weight[self.weight > 0]

    def _there(self, channels: NDArray) -> NDArray[np.float64]:
        """Channels that are not missing, (n, M, 3, ...) → (n, m, ...)."""
        return channels[:, self.weight > 0]


def gauges(influence: fe.Influence, sigma: ArrayLike, missing: ArrayLike | None = None) -> Gauges:
    """Forward model of strain gauges, or of strain that DIC measures on a plate seen flat.

    Parameters
    ----------
    influence : fe.Influence
        For M gauges.
    sigma : float, (M,) or (M, 3) array, strain
        Standard deviation of each channel; infinite for one that is missing.
    missing : (M, 3) bool, optional
        Further channels that are missing.

    Raises
    ------
    ValueError
        If a sigma is zero, negative or NaN, has the wrong shape, or no channel is left.
    """
    gauges_count = len(influence.gauges)
    given = np.asarray(sigma, dtype=np.float64)
    if given.ndim == 1:
        given = given[:, None]
    try:
        spread = np.broadcast_to(given, (gauges_count, 3))
    except ValueError:
        raise ValueError(
            f"sigma has shape {np.shape(sigma)} for {gauges_count} gauges; "
            f"give one number, ({gauges_count},) or ({gauges_count}, 3)"
        ) from None
    if not (spread > 0).all():
        raise ValueError(f"sigma of strain must be positive, got {spread.min():g}; give its noise")
    weight = np.where(False if missing is None else missing, 0.0, 1.0 / spread)
    if not weight.any():
        raise ValueError("every strain channel is missing; give one that was measured")
    return Gauges(influence, weight)


@dataclass(frozen=True, eq=False)
class Modal:
    """A measurement reduced to one number a plate mode, whitened by a factor.

    Attributes
    ----------
    modes : fe.Modes
        K modes of the plate.
    factor : (K, K) float64
        F with response(xy) = modes.response(xy) @ F.
    """

    modes: fe.Modes
    factor: NDArray[np.float64]

    @property
    def plate(self) -> fe.Plate:
        """The plate that is touched."""
        return self.modes.plate

    def response(self, xy: NDArray) -> NDArray[np.float64]:
        """See `Forward.response`; m = K."""
        return self.modes.response(xy) @ self.factor

    def gradient(self, xy: NDArray) -> NDArray[np.float64]:
        """See `Forward.gradient`; m = K."""
        return np.moveaxis(np.moveaxis(self.modes.gradient(xy), 2, 1) @ self.factor, 1, 2)
