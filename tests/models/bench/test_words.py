"""Numbers of a bench in the words of the bench."""

import pytest

import fe
from models.bench.words import in_words

PLATE = fe.Plate((150.0, 110.0), 1.0, 3000.0, 0.38)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("membrane_west", 0.016, "the clamp at x = 0 gives in the plane, more by what 48 mm of"),
        ("membrane_east", -0.01, "at x = 150 mm gives in the plane, less by what 30 mm of plate"),
        ("rotation_north", 1e-4, "at y = 110 mm gives in rotation, more by what 0.029 mm of"),
        ("rotation_south_slope", 1e-4, "at y = 0 gives in rotation, more at one end than at"),
        ("tension_xx", -0.17, "-0.17 N/mm along x, as if 0.5 K warmer than its frame in PVC"),
        ("tension_yy", 0.17, "along y, as if 0.5 K colder"),
        ("tension_xy", 0.02, "+0.02 N/mm of shear"),
        ("sag", 0.1, "+0.1 mm of sag"),
        ("sag_xy", -0.1, "-0.1 mm of sag by the polynomial xy"),
        ("thickness", -0.0619, "-6.00% of thickness"),
        ("thickness_x", 0.01, "of thickness by the polynomial x"),
        ("turn_x", 0.01745, "turned by +1.00° about x"),
        ("shift_z", 9.9, "+9.9 mm along z"),
        ("focal", 0.0198, "+2.00%"),
        ("k1", -0.08, "k1 -0.08"),
    ],
)
def test_a_number_says_what_it_is_on_the_bench(name, value, words):
    assert words in in_words(name, value, PLATE)
