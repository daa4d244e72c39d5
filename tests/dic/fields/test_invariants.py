"""Invariants of a strain, against eigenvalues, turned axes and drawn noise."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

import dic


def field(exx, eyy, exy, sigma=1e-5):
    values = [np.atleast_1d(np.asarray(v, dtype=float)) for v in (exx, eyy, exy)]
    count = len(values[0])
    return dic.StrainField(
        xy=np.zeros((count, 2)),
        exx=values[0],
        eyy=values[1],
        exy=values[2],
        sigma=np.full((count, 3), sigma),
        valid=np.ones(count, dtype=bool),
        kind="small",
        window=5,
        vsg=41,
        grid=None,
    )


strains = st.floats(-0.2, 0.2).map(lambda x: round(x, 6))


@given(strains, strains, strains)
def test_principal_strains_are_eigenvalues_and_the_angle_their_axis(exx, eyy, exy):
    found = dic.strain_invariants(field(exx, eyy, exy))
    tensor = np.array([[exx, exy], [exy, eyy]])
    low, high = np.linalg.eigvalsh(tensor)
    assert found.first[0] == pytest.approx(high, abs=1e-12)
    assert found.second[0] == pytest.approx(low, abs=1e-12)
    axis = np.array([np.cos(found.angle[0]), np.sin(found.angle[0])])
    assert axis @ tensor @ axis == pytest.approx(high, abs=1e-12)
    assert found.max_shear[0] == pytest.approx(high - low, abs=1e-12)


def test_uniaxial_tension_at_constant_volume_has_its_own_strain_for_von_mises():
    found = dic.strain_invariants(field(0.01, -0.005, 0.0))
    # The third strain is -0.005 as well: √(2/3 e:e) = 0.01.
    assert found.von_mises[0] == pytest.approx(0.01)


def test_sigma_is_what_noise_makes_of_each():
    rng, count = np.random.default_rng(2), 20000
    true = np.array([3e-3, -1e-3, 1.5e-3])
    drawn = true + rng.normal(0, 1e-4, (count, 3))
    found = dic.strain_invariants(field(*drawn.T, sigma=1e-4))
    values = (found.first, found.second, found.angle, found.max_shear, found.von_mises)
    for k, value in enumerate(values):
        assert np.median(found.sigma[:, k]) == pytest.approx(value.std(), rel=0.05)


def test_where_nothing_strains_the_angle_may_be_anything():
    found = dic.strain_invariants(field(0.0, 0.0, 0.0))
    assert found.sigma[0, 2] == pytest.approx(np.pi / np.sqrt(12))
    assert np.isfinite(found.sigma).all()
