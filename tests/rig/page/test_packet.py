"""The wire form of a snapshot: every part under its own name, axis and colour."""

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from models import Tap
from rig.live.snapshot import BaseReading, Mark, StableShape
from rig.page.packet import BRIGHTENED, Packet
from rig.projector.markers import draw_marks, fit_plate
from tests.rig.page.conftest import draw_snapshot

SCREEN = fit_plate((320, 200), (254.0, 200.0))


@pytest.fixture
def shot():
    return replace(draw_snapshot(3), from_strain=(Mark(11.0, 22.0, 0.5),))


def test_the_header_has_each_kind_of_mark_by_its_name(shot):
    said = json.loads(Packet(shot, SCREEN).header({}, controls=False))
    for name in ("touches", "from_strain", "truth"):
        places = [(mark["x"], mark["y"], mark["force"]) for mark in said[name]]
        assert places == [(mark.x, mark.y, mark.force) for mark in getattr(shot, name)], name
    assert said["T_px_plate"] == shot.T_px_plate.tolist()
    assert (said["captured"], said["dropped"]) == (shot.captured, shot.dropped)
    assert said["controls"] is False


def test_a_base_goes_out_with_its_shapes(shot):
    shapes = (
        StableShape("up", 12.5, "STABLE", shown=True),
        StableShape("down", 12.5, "NEAR_LIMIT", shown=False),
    )
    numbers = 6.0, -8.0, 1e-4, float("nan"), 0.4, "STABLE", "FOUND"
    base = BaseReading(*numbers, shapes, all_sought=True)
    said = json.loads(Packet(replace(shot, base=base), None).header({}, controls=True))["base"]
    assert (said["bend"], said["twist"], said["sigma_twist"]) == (6.0, -8.0, None)
    assert [shape["shown"] for shape in said["shapes"]] == [True, False]
    assert [shape["verdict"] for shape in said["shapes"]] == ["STABLE", "NEAR_LIMIT"]
    assert json.loads(Packet(shot, None).header({}, controls=True))["base"] is None


def test_taps_and_bounds_of_forces_go_out_with_null_for_what_is_not_known(shot):
    tap = Tap(10.0, 20.0, float("nan"), 1.5, 99.5, (0.5, 0.25, 0.125))
    mark = Mark(5.0, 2.0, 3.0, force_interval=(2.0, float("inf")))
    seen = replace(shot, touches=(mark,), recent_taps=(tap,))
    said = json.loads(Packet(seen, None).header({}, controls=True))
    assert said["touches"][0]["force_interval"] == [2.0, None]
    assert (said["taps"][0]["force"], said["taps"][0]["at_least"]) == (None, 1.5)


def test_the_map_spans_its_own_columns_and_rows(shot):
    grid = json.loads(Packet(shot, None).header({}, controls=True))["strain"]
    assert grid["x"] == [shot.strain.xs[0], shot.strain.xs[-1]]
    assert grid["y"] == [shot.strain.ys[0], shot.strain.ys[-1]]
    assert grid["shape"] == [len(shot.strain.ys), len(shot.strain.xs)]


def test_the_projector_view_has_the_colours_of_the_projector(shot):
    sent = Packet(shot, SCREEN).parts("projector")["projector"]
    shown = cv2.imdecode(np.frombuffer(sent, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    expected = BRIGHTENED * draw_marks(shot.touches, SCREEN).astype(float)
    red, green, blue = shown.reshape(-1, 3).mean(axis=0)
    assert red < 0.9 * blue < 0.9 * green
    assert (red, green, blue) == pytest.approx(expected.reshape(-1, 3).mean(axis=0), rel=0.1)
