"""Several touches as a net reports them without an order: the poles of a rational function.

Touches have no order, and columns do: wherever two touches change places in the list, the target
jumps, and a net cannot. With places as complex numbers z = x + iy and u = z - c about their
centroid c, the function

    q(u) / p(u) = Σ m / (u - u_i),    p(u) = Π (u - u_i) = u^k + p_2 u^(k-2) + … + p_k,

does not change when touches change places, nor do its coefficients. They are the code of a sample:
c, p_2, …, p_k, and with magnitudes the k coefficients of q, the first of which, the sum of the
magnitudes, is real. The places are the roots of p, the magnitudes m = q / p' there.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from models.arrays import F64

if TYPE_CHECKING:
    from torch import Tensor

    from models.nets.loss import Loss

# Touches nearer than this are weighed as if they were so far apart, mm: to first order the error
# of a place is that of p over p', which has no end where two places meet; the true error has.
_NEAR = 2.0


def encode(targets: F64, touches: int) -> F64:
    """Return the codes of samples.

    Parameters
    ----------
    targets : (N, 2 k) or (N, 3 k) float64
        As from `models.data.dataset.flatten`: places, mm, then magnitudes if they are reported.
    touches : int
        k.

    Returns
    -------
    (N, 2 k) or (N, 4 k - 1) float64
        Real and imaginary parts, in powers of mm: of c, of p_2 to p_k, then the sum of the
        magnitudes and both parts of the other coefficients of q.
    """
    places = _complex(targets[:, : 2 * touches])
    centre = places.mean(axis=1, keepdims=True)
    about = places - centre
    code = _real(np.column_stack([centre, _product(about)[:, 2:]]))
    if targets.shape[1] == 2 * touches:
        return code
    others = [_product(np.delete(about, i, axis=1)) for i in range(touches)]
    total = np.einsum("ni,nij->nj", targets[:, 2 * touches :], np.stack(others, axis=1))
    return np.column_stack([code, total[:, 0].real, _real(total[:, 1:])])


def decode(codes: F64, touches: int) -> F64:
    """Return the touches of codes, sorted by x, then y; the inverse of `encode`.

    Touches at one place share the sum of the magnitudes.
    """
    centre, coefficients = np.split(_complex(codes[:, : 2 * touches]), [1], axis=1)
    companion = np.tile(np.eye(touches, k=-1, dtype=complex), (len(codes), 1, 1))
    companion[:, 0, 1:] = -coefficients
    about = np.asarray(np.linalg.eigvals(companion), dtype=np.complex128)
    places = about + centre
    order = np.lexsort((places.imag, places.real), axis=1)
    reported = _real(np.take_along_axis(places, order, axis=1))
    if codes.shape[1] == 2 * touches:
        return reported
    magnitudes = _residues(codes[:, 2 * touches :], about)
    return np.column_stack([reported, np.take_along_axis(magnitudes, order, axis=1)])


def permutation_invariant_loss(touches: int, k: float = 1.0) -> "Loss":
    """Return equations 2 and 3 of the paper for codes, to first order in their errors.

    The polynomial predicted is p(z) at a true place z, where it should be 0; its root is off by
    p / p'. Likewise q - m p' over p' is the error of a magnitude. No touch is paired with another.

    Parameters
    ----------
    touches
        Of a sample.
    k
        Weight of the relative error of magnitudes, mm; used where the targets have them.
    """

    def loss(predicted: "Tensor", true: "Tensor") -> "Tensor":
        import torch

        def numbers(columns: "Tensor") -> "Tensor":
            return torch.complex(columns[:, ::2], columns[:, 1::2])

        split = 2 * touches
        code, places = numbers(predicted[:, :split]), numbers(true[:, :split])
        about, itself = places - code[:, :1], torch.eye(touches, dtype=true.dtype)
        apart = places[:, :, None] - places[:, None, :] + itself
        weight = torch.where(itself > 0, itself, apart.abs().clamp(min=_NEAR)).prod(dim=2)
        error = (_horner(about, code[:, 1:], about).abs() / weight).mean()
        if true.shape[1] == split:
            return error
        magnitudes, total = true[:, split:], predicted[:, split : split + 1]
        value = _horner(total + 0j * about, numbers(predicted[:, split + 1 :]), about)
        wrong = (value - magnitudes * apart.prod(dim=2)).abs() / weight
        return error + k * (wrong / magnitudes.abs()).mean()

    return loss


def _horner(value: Any, rest: Any, about: Any) -> Any:
    """Go on with a polynomial from its first coefficients' `value` by the rest (N, j)."""
    for column in range(rest.shape[1]):
        value = value * about + rest[:, column : column + 1]
    return value


def _complex(columns: F64) -> NDArray[np.complex128]:
    return np.ascontiguousarray(columns, dtype=np.float64).view(np.complex128)


def _real(numbers: NDArray[np.complex128]) -> F64:
    return np.ascontiguousarray(numbers).view(np.float64)


def _product(roots: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Coefficients (N, k + 1) of Π (u - root), the highest first."""
    product = np.ones((len(roots), 1), dtype=complex)
    for root in roots.T:
        longer = np.pad(product, ((0, 0), (0, 1)))
        longer[:, 1:] -= root[:, None] * product
        product = longer
    return product


def _residues(code: F64, about: NDArray[np.complex128]) -> F64:
    """Magnitudes (N, k) of q at the roots."""
    touches = about.shape[1]
    value = _horner(code[:, :1] + 0j * about, _complex(code[:, 1:]), about)
    slope = (about[:, :, None] - about[:, None, :] + np.eye(touches)).prod(axis=2)
    shared = np.repeat(code[:, :1] / touches, touches, axis=1)
    reported = np.divide(value, slope, out=shared.astype(complex), where=slope != 0)
    return np.real(reported)
