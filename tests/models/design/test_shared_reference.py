"""Frames with one reference: the same numbers as generalised least squares written out."""

import numpy as np
import pytest

from models.design.shared_reference import SharedReference

FRAMES, TILES, SHARED, OWN = 3, 5, 2, 4


@pytest.fixture
def drawn():
    rng = np.random.default_rng(5)
    root = rng.normal(size=(TILES, 2, 2))
    hessian = root @ root.transpose(0, 2, 1) + np.eye(2)
    visible = np.ones((FRAMES, TILES), dtype=bool)
    visible[1, 2] = visible[0, 4] = False
    bases = rng.normal(size=(FRAMES, TILES, 2, SHARED + OWN))
    return SharedReference(bases, SHARED, visible, (0.7, 0.4)), hessian, rng


def written_out(system, hessian, shown):
    """One equation a tile, frame and direction, with the covariance of all."""
    a, b = np.square(system.noise)
    size = SHARED + FRAMES * OWN
    normal, right = np.zeros((size, size)), np.zeros(size)
    for tile in range(TILES):
        frames = np.flatnonzero(system.visible[:, tile])
        design = np.zeros((2 * len(frames), size))
        for row, frame in enumerate(frames):
            own = SHARED + frame * OWN
            moved = hessian[tile] @ system.bases[frame, tile]
            design[2 * row : 2 * row + 2, :SHARED] = moved[:, :SHARED]
            design[2 * row : 2 * row + 2, own : own + OWN] = moved[:, SHARED:]
        among = a * np.eye(len(frames)) + b
        weight = np.linalg.inv(np.kron(among, hessian[tile]))
        normal += design.T @ weight @ design
        right += design.T @ weight @ shown[frames, tile].ravel()
    return normal, right


def test_the_equations_are_those_of_generalised_regression(drawn):
    system, hessian, rng = drawn
    shown = rng.normal(size=(FRAMES, TILES, 2))
    normal, right = written_out(system, hessian, shown)
    np.testing.assert_allclose(system.normal(hessian), normal, atol=1e-12)
    np.testing.assert_allclose(system.right(shown), right, atol=1e-12)


def test_what_frames_have_in_common_says_nothing_where_only_the_reference_errs(drawn):
    system, _, _ = drawn
    sure = SharedReference(system.bases, SHARED, np.ones((FRAMES, TILES), bool), (1e-3, 10.0))
    same = np.ones((FRAMES, TILES, 2))
    differ = same * np.array([1.0, 0.0, -1.0])[:, None, None]
    assert np.abs(sure.right(same)).max() < 1e-3 * np.abs(sure.right(differ)).max()
