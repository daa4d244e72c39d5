"""The whole setup in the twin, by clicks and keys, as the report measures it."""

import pytest

pytestmark = pytest.mark.browser


@pytest.mark.slow
def test_the_whole_setup_in_the_twin_finds_plate_projector_and_force():
    from rig.studies.start.setup_wizard import wizard

    verdicts = [figure for figure in wizard((1,)) if figure.bar]
    assert len(verdicts) == 5
    assert [f"{one.case}: {one.text}" for one in verdicts if one.verdict != "met"] == []
