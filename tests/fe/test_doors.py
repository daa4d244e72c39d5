"""What no plate can be made of is refused in one sentence, whatever it is."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as arrays

import fe

PLATE = fe.Plate((90.0, 60.0), 1.5, 3000.0, 0.38)
MESH = fe.Mesh(PLATE.size, (8, 6))
STATE = fe.deflect(PLATE, [fe.Touch(40.0, 20.0, 1.0)], MESH)
INFLUENCE = fe.influence(PLATE, [[20.0, 30.0]], MESH)
MODES = fe.modes(PLATE, 3, MESH)

strange = st.one_of(
    st.none(),
    st.booleans(),
    st.text(max_size=3),
    st.complex_numbers(),
    st.floats(),
    st.integers(),
    st.just(10**400),
    st.lists(st.floats(), max_size=3),
    st.lists(st.lists(st.floats(), max_size=3), max_size=3),
    st.just({}),
    arrays.arrays(
        st.sampled_from([np.float64, np.float32, np.int32, np.bool_, np.complex128, "U2"]),
        arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=3),
    ),
)

DOORS = {
    "touch": lambda v: fe.Touch(v, 1.0, 1.0),
    "force": lambda v: fe.Touch(1.0, 1.0, v),
    "radius": lambda v: fe.Touch(1.0, 1.0, 1.0, v),
    "patch": lambda v: fe.Patch(v, (0.0, 1.0), 1.0, 1.0),
    "patch of a thickness": lambda v: fe.Patch((0.0, 1.0), (0.0, 1.0), v, 1.0),
    "size": lambda v: fe.Plate(v, 1.0, 3000.0, 0.3).rigidity,
    "thickness": lambda v: fe.Plate((90.0, 60.0), v, 3000.0, 0.3).rigidity,
    "young": lambda v: fe.Plate((90.0, 60.0), 1.0, v, 0.3).rigidity,
    "poisson": lambda v: fe.Plate((90.0, 60.0), 1.0, 3000.0, v).rigidity,
    "edge": lambda v: fe.Plate((90.0, 60.0), 1.0, 3000.0, 0.3, v),
    "spring": lambda v: fe.Elastic(v, 1.0),
    "mesh": lambda v: fe.Mesh(v, (8, 6)),
    "elements": lambda v: fe.Mesh((90.0, 60.0), v),
    "bend": lambda v: fe.Base(v),
    "twist": lambda v: fe.Base(0.0, v),
    "material": PLATE.material,
    "points": PLATE.points,
    "strain": STATE.strain,
    "displacement": STATE.displacement,
    "influence": INFLUENCE.strain,
    "influence of a disc": lambda v: INFLUENCE.strain([[40.0, 20.0]], v),
    "gauges": lambda v: fe.influence(PLATE, v, MESH),
    "length": lambda v: fe.influence(PLATE, [[20.0, 30.0]], MESH, length=v),
    "modes": MODES.response,
    "modes of a disc": lambda v: MODES.response([[40.0, 20.0]], v),
    "compliance": lambda v: fe.compliance(fe.Linear(PLATE, MESH), v),
    "linear range": lambda v: fe.LinearRange.from_arrays({"force": np.asarray(1.0)}),
}


@pytest.mark.parametrize("door", DOORS.values(), ids=DOORS)
@given(value=strange)
@settings(max_examples=40)
def test_every_door_takes_it_or_says_in_one_sentence_why_not(door, value):
    sentence = None
    try:
        door(value)
    except ValueError as error:
        sentence = str(error)
    if sentence is not None:
        assert len(sentence) > 20
        assert "\n" not in sentence


@pytest.mark.parametrize("count", [0, -1, 1.5, True, "3", None, np.nan])
def test_numbers_of_modes_and_elements_are_whole(count):
    for call in (lambda: fe.modes(PLATE, count, MESH), lambda: fe.grid(PLATE, count)):
        with pytest.raises(ValueError, match=r"^(number of modes|elements along)"):
            call()


@pytest.mark.parametrize("value", ["1", 1j, None, True, [1.0, 2.0], np.nan, -1.0, 0.0, 1e200])
def test_a_force_and_a_thickness_are_positive_numbers(value):
    with pytest.raises(ValueError, match=r"^plate thickness must"):
        fe.Plate((90.0, 60.0), value, 3000.0, 0.3)
    with pytest.raises(ValueError, match=r"^expected force must"):
        fe.linear_range(PLATE, value)
    with pytest.raises(ValueError, match=r"^largest force must"):
        fe.reduced_plate(PLATE, force=value)
