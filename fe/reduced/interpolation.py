"""Smooth fields between the points of a grid."""

from __future__ import annotations

import numpy as np

from fe.arrays import F64


def between(places: F64, x: F64) -> F64:
    """Matrix (K, P) from values at P ascending places to their cubic spline at x (K,).

    Beyond the outer places, which Gauss points leave before an edge, the last cubics go on.
    """
    from scipy.interpolate import make_interp_spline  # slow to import, and wanted late

    return make_interp_spline(places, np.eye(len(places)), k=3)(x)
