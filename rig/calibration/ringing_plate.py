"""How a plate rings, as a calibration keeps it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Ringing:
    """How the modes of a plate ring.

    Attributes
    ----------
    density : float, kg/m³
        With which the modes have the frequencies that were seen.
    damping : float
        Ratio to critical damping.
    sigma_damping : float
        Its standard deviation.
    """

    density: float
    damping: float
    sigma_damping: float
