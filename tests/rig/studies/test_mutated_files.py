"""Some of the mutated files of the study: none ends in a traceback or is taken in silence."""

import pytest

from rig.studies.files.kinds import KINDS
from rig.studies.files.limits import out_of_range
from rig.studies.files.mutated import OUTCOMES, outcomes

COUNTS = dict.fromkeys(KINDS, 120) | {"kernel": 6}


@pytest.mark.parametrize("kind", KINDS)
def test_a_mutated_file_is_refused_in_one_sentence_or_does_no_harm(kind):
    found = outcomes(kind, range(COUNTS[kind]))
    assert [said for said in found if said[0] in OUTCOMES[2:]] == []
    if kind in ("scene", "calibration", "model", "recording"):
        assert sum(end == "refused" for end, _ in found) > 0.3 * COUNTS[kind]


def test_the_limits_see_what_no_bench_has():
    plate = {"thickness": -1.0, "size": (254.0, 0.0), "edges": {"deflection": float("inf")}}
    assert list(out_of_range({"plate": plate})) == ["thickness = -1.0", "size = 0.0"]
    assert list(out_of_range({"values": [1.0, float("nan"), 1e300]})) == [
        "values = nan",
        "values = 1e+300",
    ]
