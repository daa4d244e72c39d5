"""Products of the functions along an edge, weighed by springs that are not alike along it."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe.elements.gauss import dense
from fe.elements.hermite import hermite_gram
from fe.elements.line import Line

# Points an element: products of two cubics are exact, and the weight, which is no polynomial,
# leaves 1e-9 on ten elements up to a taper of 0.9.
_POINTS = 8


def edge_gram(line: Line, taper: float) -> sp.csr_array:
    """Integrals of f g / (1 + taper s) along a side, with s from -1 to 1.

    Parameters
    ----------
    line : Line
    taper : float
        Between -1 and 1, see `fe.Elastic`.

    Returns
    -------
    (unknowns, unknowns) float64, mm
    """
    if taper == 0:
        return hermite_gram(line, 0, 0)
    t, weight = np.polynomial.legendre.leggauss(_POINTS)
    half = 0.5 * np.diff(line.nodes)[:, None]
    places = (line.nodes[:-1, None] + half * (t + 1)).ravel()
    softer = 1.0 + taper * (2.0 * places / line.nodes[-1] - 1.0)
    values = sp.csr_array(dense(places, line, 0))
    return sp.csr_array(values.T @ sp.diags_array((half * weight).ravel() / softer) @ values)
