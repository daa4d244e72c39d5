"""Strain: exact for exact fields, with the σ that sampling finds."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import dic
from dic.fields.strain_field import strain_measure

KINDS = ("small", "green-lagrange", "logarithmic")


def field(gradient, shape=(7, 9), step=5, subset=21, lost=()):
    """Make a DisplacementField that is exactly linear."""
    grid = dic.Grid(20 + step * np.arange(shape[1]), 15 + step * np.arange(shape[0]), subset, step)
    n = len(grid.xy)
    status = np.zeros(n, dtype=np.int8)
    status[list(lost)] = dic.Status.LOW_CORRELATION
    u, v = np.where(status == 0, np.asarray(gradient) @ grid.xy.T + 0.4, np.nan)
    sigma = np.where(status == 0, 0.01, np.nan)
    return dic.DisplacementField(
        xy=grid.xy, u=u, v=v, sigma_u=sigma, sigma_v=2 * sigma,
        gradient=np.tile(gradient, (n, 1, 1)), sigma_gradient=np.full((n, 2, 2), 1e-4),
        zncc=np.ones(n), iterations=np.ones(n, dtype=np.int16), valid_fraction=np.ones(n),
        status=status, subset=subset, order=1, grid=grid,
    )  # fmt: skip


def by_hand(gradient, kind):
    stretch = np.eye(2) + gradient
    square = stretch.T @ stretch
    if kind == "small":
        tensor = (gradient + gradient.T) / 2
    elif kind == "green-lagrange":
        tensor = (square - np.eye(2)) / 2
    else:
        values, vectors = np.linalg.eigh(square)
        tensor = vectors @ np.diag(np.log(values) / 2) @ vectors.T
    return tensor[0, 0], tensor[1, 1], tensor[0, 1]


@pytest.mark.parametrize("kind", KINDS)
def test_linear_field_gives_its_strain_exactly(kind):
    gradient = np.array([[0.03, 0.02], [-0.01, -0.015]])
    eps = dic.strain(field(gradient), kind=kind)
    for found, true in zip((eps.exx, eps.eyy, eps.exy), by_hand(gradient, kind), strict=True):
        np.testing.assert_allclose(found[eps.valid], true, atol=1e-12)
    assert eps.kind == kind


@given(st.floats(-3.1, 3.1), st.floats(0.7, 1.4), st.floats(0.7, 1.4), st.floats(-0.3, 0.3))
def test_finite_strains_do_not_see_rotation(angle, stretch_x, stretch_y, shear):
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    deformation = np.array([[stretch_x, shear], [0, stretch_y]])
    for kind in KINDS[1:]:
        turned = strain_measure(turn @ deformation - np.eye(2), kind)
        np.testing.assert_allclose(
            turned, strain_measure(deformation - np.eye(2), kind), atol=1e-10
        )
        np.testing.assert_allclose(turned, by_hand(deformation - np.eye(2), kind), atol=1e-9)


def test_kinds_agree_to_second_order():
    gradient = 1e-5 * np.array([[3.0, 2.0], [1.0, -4.0]])
    small = strain_measure(gradient, "small")
    for kind in KINDS[1:]:
        assert np.abs(strain_measure(gradient, kind) - small).max() <= 1e-8


def test_exy_is_the_tensor_component():
    eps = dic.strain(field([[0, 2e-3], [0, 0]]))
    np.testing.assert_allclose(eps.exy[eps.valid], 1e-3, rtol=1e-9)


def test_gauge_length_is_what_one_strain_depends_on():
    assert dic.strain(field(np.zeros((2, 2))), window=5).vsg == 4 * 5 + 21
    assert dic.strain(field(np.zeros((2, 2))), window=3).vsg == 2 * 5 + 21


def test_lost_points_are_left_out_and_thin_windows_are_invalid():
    gradient, columns = np.array([[0.01, 0], [0, -0.02]]), 9
    lost = [3 * columns + 4, *range(columns * 2)]  # one in the middle, and the two upper rows
    eps = dic.strain(field(gradient, lost=lost))
    valid = eps.valid.reshape(7, 9)
    assert not valid[:2].any()
    assert not valid[3, 4]
    assert valid[4, 4]
    np.testing.assert_allclose(eps.exx[eps.valid], 0.01, atol=1e-12)
    assert np.isnan(eps.exx[~eps.valid]).all()
    assert np.isnan(eps.sigma[~eps.valid]).all()


def test_far_apart_subsets_add_noise_independently():
    eps = dic.strain(field(np.zeros((2, 2)), step=21), window=3)
    middle = 3 * 9 + 4
    # A plane through 3x3 points: σ(∂u/∂x) = σ_u/√Σx² = 0.01/√(6·21²).
    assert eps.sigma[middle, 0] == pytest.approx(0.01 / np.sqrt(6 * 21**2))
    assert eps.sigma[middle, 1] == pytest.approx(0.02 / np.sqrt(6 * 21**2))
    assert eps.sigma[middle, 2] == pytest.approx(np.hypot(0.01, 0.02) / np.sqrt(6 * 21**2) / 2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("step", "kind"), [(5, "small"), (9, "green-lagrange"), (13, "logarithmic")]
)
def test_sigma_is_what_sampling_finds(pattern, reference, step, kind):
    rng, frame = np.random.default_rng(7), pattern.draw((0.3, 0.6), ((0.01, 0), (0.004, 0)))
    samples = []
    for _ in range(24):
        ref = dic.prepare(reference + rng.normal(0, 2, reference.shape), step=step)
        disp = dic.correlate(ref, frame + rng.normal(0, 2, frame.shape))
        samples.append(dic.strain(disp, kind=kind))
    known = np.all([s.valid for s in samples], axis=0)
    for k, name in enumerate(("exx", "eyy", "exy")):
        values = np.array([getattr(s, name)[known] for s in samples])
        scatter = np.sqrt(values.var(axis=0, ddof=1).mean())
        predicted = np.sqrt(np.mean([s.sigma[known, k] ** 2 for s in samples]))
        assert predicted == pytest.approx(scatter, rel=0.15)  # measured within 0.05


def test_scattered_gauges_give_the_strain_of_their_subset(pattern, reference):
    gradient = ((0.01, 0.004), (0.0, -0.005))
    ref = dic.prepare(reference, subset=31, points=[[60.0, 50.0], [120.5, 90.2]])
    eps = dic.strain(dic.correlate(ref, pattern.draw((0.3, 0.1), gradient)))
    np.testing.assert_allclose(eps.exx, 0.01, atol=3e-4)
    np.testing.assert_allclose(eps.exy, 0.002, atol=3e-4)
    assert eps.vsg == 31
    assert (eps.sigma > 0).all()


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"window": 4}, "window must be odd"),
        ({"window": 1}, "at least 3"),
        ({"window": 9}, "larger than the grid"),
        ({"kind": "almansi"}, "one of small"),
    ],
)
def test_bad_options_are_refused_in_one_sentence(options, sentence):
    with pytest.raises(ValueError, match=sentence) as refusal:
        dic.strain(field(np.zeros((2, 2))), **options)
    assert "\n" not in str(refusal.value)


def test_scattered_points_without_gradients_have_no_strain(reference):
    ref = dic.prepare(reference, points=[[60.0, 50.0]], order=0)
    with pytest.raises(ValueError, match="order=1"):
        dic.strain(dic.correlate(ref, reference))
