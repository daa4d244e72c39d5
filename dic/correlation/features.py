"""Large rotation and stretch: an affine motion of the whole picture, from features."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

_MOST = 2000  # features looked for in each picture
_BESIDE = 3.0  # px, a pair farther than this from the affine motion is false
_LEAST = 12  # pairs that must agree: by chance no more than six do
_SPAN = (1, 99)  # percentiles of the grey levels that are stretched to 8 bit


def affine(
    reference: NDArray[np.float32], deformed: NDArray[np.float32]
) -> NDArray[np.float64] | None:
    """Find the affine motion x → A (x, 1) that most features of two pictures agree on.

    Parameters
    ----------
    reference, deformed : (H, W) float32, grey levels

    Returns
    -------
    (2, 3) float64, px, or None
        None where too few features agree.

    References
    ----------
    Rublee, Rabaud, Konolige, Bradski 2011, ORB: an efficient alternative to SIFT or SURF, ICCV,
    2564; pairs are mutual nearest neighbours, thinned by RANSAC.
    """
    detector = cv2.ORB.create(_MOST)
    (here, of_here), (there, of_there) = (
        detector.detectAndCompute(_eight_bit(image), None) for image in (reference, deformed)
    )
    if min(len(here), len(there)) < _LEAST:
        return None
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(of_here, of_there)
    if len(pairs) < _LEAST:
        return None
    first = np.array([here[pair.queryIdx].pt for pair in pairs])
    second = np.array([there[pair.trainIdx].pt for pair in pairs])
    found, agree = cv2.estimateAffine2D(first, second, ransacReprojThreshold=_BESIDE)
    if found is None or np.count_nonzero(agree) < _LEAST:
        return None
    return np.asarray(found, dtype=np.float64)


def straighten(deformed: NDArray[np.float32], motion: NDArray[np.float64]) -> NDArray[np.float32]:
    """Undo an affine motion (2, 3) of a picture: the pixel x shows what lies at A (x, 1)."""
    size = deformed.shape[1], deformed.shape[0]
    turned = cv2.warpAffine(deformed, motion, size, flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
    return np.asarray(turned, dtype=np.float32)


def follow(
    xy: NDArray[np.float64], motion: NDArray[np.float64], rest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Compose what is found in the straightened picture with the affine motion.

    Parameters
    ----------
    xy : (S, 2), px
    motion : (2, 3)
        Affine motion.
    rest : (S, 2, 3)
        u, ∂u/∂x, ∂u/∂y and those of v, found in the straightened picture.

    Returns
    -------
    (S, 2, 3)
    """
    turn, whole = motion[:, :2], np.empty_like(rest)
    whole[:, :, 0] = (xy + rest[:, :, 0]) @ turn.T + motion[:, 2] - xy
    whole[:, :, 1:] = turn @ (np.eye(2) + rest[:, :, 1:]) - np.eye(2)
    return whole


def _eight_bit(image: NDArray[np.float32]) -> NDArray[np.uint8]:
    low, high = np.percentile(image, _SPAN)
    scaled = (image - low) * (255 / max(high - low, 1e-6))
    return np.clip(np.rint(scaled), 0, 255).astype(np.uint8)
