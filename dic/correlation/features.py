"""Large rotation and stretch: an affine motion of the whole image, from features."""

from __future__ import annotations

from typing import cast

import cv2
import numpy as np

from dic.arrays import F32, F64, U8, AnyArray

_FEATURES = 1200  # sought in each image
_BESIDE = 3.0  # px, a pair farther than this from the affine motion is false
_PAIRS = 12  # that must agree: by chance no more than six do
_SPAN = (1, 99)  # percentiles of the grey levels that are stretched to 8 bit


def affine(reference: F32, deformed: F32) -> F64 | None:
    """Find the affine motion x → A (x, 1) that most features of two images agree on.

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
    detector = cv2.ORB.create(_FEATURES)
    (here, of_here), (there, of_there) = (
        detector.detectAndCompute(_eight_bit(image), None) for image in (reference, deformed)
    )
    if min(len(here), len(there)) < _PAIRS:
        return None
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(of_here, of_there)
    if len(pairs) < _PAIRS:
        return None
    first = np.array([here[pair.queryIdx].pt for pair in pairs])
    second = np.array([there[pair.trainIdx].pt for pair in pairs])
    found, agree = cast(
        "tuple[AnyArray | None, AnyArray]",
        cv2.estimateAffine2D(first, second, ransacReprojThreshold=_BESIDE),
    )
    if found is None or np.count_nonzero(agree) < _PAIRS:
        return None
    return np.asarray(found, dtype=np.float64)


def straighten(deformed: F32, motion: F64) -> F32:
    """Undo an affine motion (2, 3) of an image: the pixel x shows what lies at A (x, 1)."""
    size = deformed.shape[1], deformed.shape[0]
    turned = cv2.warpAffine(deformed, motion, size, flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP)
    return np.asarray(turned, dtype=np.float32)


def follow(xy: F64, motion: F64, rest: F64) -> F64:
    """Compose what is found in the straightened image with the affine motion.

    Parameters
    ----------
    xy : (S, 2), px
    motion : (2, 3)
        Affine motion.
    rest : (S, 2, 3)
        u, ∂u/∂x, ∂u/∂y and those of v, found in the straightened image.

    Returns
    -------
    (S, 2, 3)
    """
    turn, whole = motion[:, :2], np.empty_like(rest)
    whole[:, :, 0] = (xy + rest[:, :, 0]) @ turn.T + motion[:, 2] - xy
    whole[:, :, 1:] = turn @ (np.eye(2) + rest[:, :, 1:]) - np.eye(2)
    return whole


def _eight_bit(image: F32) -> U8:
    low, high = np.percentile(image, _SPAN)
    scaled = (image - low) * (255 / max(high - low, 1e-6))
    return np.clip(np.rint(scaled), 0, 255).astype(np.uint8)
