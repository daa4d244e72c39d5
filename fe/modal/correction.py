"""Static correction: what the forces of the plane do to details, which no mode carries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fe.arrays import F64
from fe.modal.parameters import NAMES, SHAPE, TENSION
from fe.modal.plate import Corrections


class Correction(NamedTuple):
    """Details as the plane bends them, and their derivatives, of one state.

    Attributes
    ----------
    value : (D,) float64
    by_functions : (D, n) float64
    by_stresses : (D, M) float64
    by_parameters : (D, 54) float64
        By the tension and the shape at rest of a bench, while functions and stresses stay.
    """

    value: F64
    by_functions: F64
    by_stresses: F64
    by_parameters: F64


def corrected(
    products: Corrections, whole: F64, firm: F64, functions: F64, stress: F64
) -> Correction:
    """Bend details by the forces of the plane, N : ∇(w + w₀)∇d, of which none is in the modes.

    Parameters
    ----------
    products : Corrections
    whole : (54,) float64
        Parameters of the bench, what its description gives included.
    firm : (D,) float64
        Bending energy of the details.
    functions : (n,) float64
        Amplitudes of the functions.
    stress : (M,) float64
    """
    tense = np.tensordot(whole[TENSION], products.tense, 1)
    by_functions = np.tensordot(stress, products.stretching, 1) + tense
    by_stresses = products.stretching @ functions
    by_stresses += np.tensordot(whole[SHAPE], products.shaped, 1)
    by_parameters = np.zeros((len(firm), len(NAMES)))
    by_parameters[:, TENSION] = (products.tense @ functions).T
    by_parameters[:, SHAPE] = np.tensordot(products.shaped, stress, (1, 0)).T
    value = tense @ functions + stress @ by_stresses
    soft = -1.0 / firm
    return Correction(
        soft * value,
        soft[:, None] * by_functions,
        soft[:, None] * by_stresses.T,
        soft[:, None] * by_parameters,
    )
