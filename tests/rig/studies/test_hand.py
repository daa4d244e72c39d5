"""What is counted for a person in studies whose clicks a script does."""

import pytest

from rig.studies.start.hand import with_hands


def test_each_action_takes_five_seconds():
    assert with_hands(0.0, 12) == pytest.approx(1)
    assert with_hands(150.0, 18) == pytest.approx(4)
