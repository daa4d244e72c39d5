"""Speckles that no printer draws: the remedy for a scene, which names them itself, works."""

import rig
from rig.design.limits import FINEST, cannot_work


def test_a_scene_with_too_fine_speckles_is_refused_and_its_remedy_works():
    why = cannot_work(rig.load("twin", {"pattern.diameter": 0.1}))
    assert "speckles 0.1 mm wide, and no printer draws them below 0.2 mm" in why
    assert f"in a scene set pattern.diameter to {FINEST:g} mm or more" in why
    assert "no printer" not in cannot_work(rig.load("twin", {"pattern.diameter": FINEST}))
