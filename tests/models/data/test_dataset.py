"""Data sets: what stands in which column, and that it is the plate's own strain."""

import numpy as np

import fe
from models.data import dataset, gauge_layout

PLATE = fe.Plate(size=(60.0, 40.0), thickness=1.0, young=3000.0, poisson=0.3, edges=fe.Clamped())
GAUGES = gauge_layout.gauges_on_edges(PLATE.size, spacing=10.0, margin=5.0)
PLACES = dataset.grid_places(PLATE.size, spacing=5.0, margin=10.0)


def small_influence():
    return fe.influence(PLATE, GAUGES, mesh=fe.Mesh(PLATE.size, (24, 16)))


def test_columns_run_exx_eyy_exy_of_the_first_gauge_then_of_the_next():
    influence = small_influence()
    data = dataset.simulate_dataset(influence, PLACES)
    strain = influence.strain(PLACES)
    assert data.strain.shape == (len(PLACES), 3 * len(GAUGES))
    np.testing.assert_array_equal(data.targets, PLACES)
    for gauge in (0, 3, len(GAUGES) - 1):
        np.testing.assert_array_equal(data.strain[:, 3 * gauge : 3 * gauge + 3], strain[:, gauge])


def test_on_clamped_edges_one_strain_of_three_is_live_and_stretches_the_touched_face():
    data = dataset.simulate_dataset(small_influence(), PLACES)
    live = np.abs(data.strain).max(axis=0) > 1e-9 * np.abs(data.strain).max()
    on_side_x = np.isin(GAUGES[:, 0], [0.0, 60.0])
    expected = np.column_stack([on_side_x, ~on_side_x, np.zeros(len(GAUGES), bool)])
    np.testing.assert_array_equal(live.reshape(-1, 3), expected)
    assert data.strain[:, live].min() > 0.0


def test_a_touch_mirrored_in_the_plate_gives_the_strains_mirrored():
    influence = small_influence()
    here = influence.strain(np.array([[17.0, 12.0]]))[0]
    there = influence.strain(np.array([[43.0, 28.0]]))[0]
    turned = np.argmin(
        np.linalg.norm(GAUGES[:, None] - (np.array(PLATE.size) - GAUGES), axis=2), axis=1
    )
    np.testing.assert_allclose(there[turned], here, rtol=1e-7, atol=1e-12)
