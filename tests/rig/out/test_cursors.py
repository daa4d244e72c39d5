"""Sessions and velocities of touches, whose paths are known."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from rig.live.snapshot import Mark
from rig.out import Cursors, across_plate, across_screen
from rig.projector.markers import fit_plate

PLATE = (200.0, 100.0)


def at(x, y, force=1.0, identity=None):
    return Mark(x, y, force, identity=identity)


@pytest.fixture
def cursors():
    return Cursors(across_plate(PLATE))


def test_the_surface_starts_at_the_upper_left_of_the_plate(cursors):
    (cursor,) = cursors.update([at(50.0, 75.0)], 0.0)
    assert (cursor.x, cursor.y) == pytest.approx((0.25, 0.25))


def test_the_projectors_image_is_a_surface_from_border_to_border():
    screen = fit_plate((640, 400), PLATE, margin=0.0)
    (cursor,) = Cursors(across_screen(screen)).update([at(100.0, 50.0)], 0.0)
    assert (cursor.x, cursor.y) == pytest.approx((0.5, 0.5))


def test_a_place_outside_the_surface_is_moved_to_its_border(cursors):
    (cursor,) = cursors.update([at(-3.0, 104.0)], 0.0)
    assert (cursor.x, cursor.y) == (0.0, 0.0)


def test_velocity_and_acceleration_are_those_of_the_path(cursors):
    # 40 mm/s along x, -10 mm/s along y: 0.2 and 0.1 surfaces a second
    for time in (0.0, 0.1, 0.2):
        (cursor,) = cursors.update([at(50 + 40 * time, 50 - 10 * time)], time)
    assert (cursor.vx, cursor.vy) == pytest.approx((0.2, 0.1))
    assert cursor.acceleration == pytest.approx(0.0, abs=1e-9)
    (cursor,) = cursors.update([at(58.0, 48.0)], 0.3)
    assert cursor.speed == pytest.approx(0.0, abs=1e-9)
    assert cursor.acceleration == pytest.approx(-np.hypot(0.2, 0.1) / 0.1)


def test_a_new_cursor_rests_and_so_does_one_while_time_stands(cursors):
    assert cursors.update([at(10, 10)], 1.0)[0].speed == 0
    assert cursors.update([at(12, 10)], 1.0)[0].speed == 0


def test_a_tracked_touch_keeps_its_session_wherever_it_goes(cursors):
    first = cursors.update([at(10, 10, identity=7), at(150, 80, identity=9)], 0.0)
    second = cursors.update([at(12, 11, identity=9), at(190, 90, identity=7)], 0.1)
    assert [one.session for one in first] == [one.session for one in second] == [1, 2]
    assert second[0].x == pytest.approx(0.95)


def test_a_session_is_never_given_twice(cursors):
    (first,) = cursors.update([at(10, 10, identity=3)], 0.0)
    assert cursors.update([], 0.1) == ()
    (second,) = cursors.update([at(10, 10, identity=3)], 0.2)
    assert second.session > first.session


def test_an_untracked_touch_continues_the_nearest_within_reach(cursors):
    cursors.update([at(20, 20), at(160, 70)], 0.0)
    near, far = cursors.update([at(162, 71), at(21, 22)], 0.1)
    assert (near.session, far.session) == (1, 2)
    assert near.x == pytest.approx(21 / 200)
    (jumped,) = cursors.update([at(90, 50)], 0.2)
    assert jumped.session == 3


@given(
    st.lists(
        st.lists(
            st.tuples(
                st.floats(0, 200), st.floats(0, 100), st.one_of(st.none(), st.integers(0, 4))
            ),
            max_size=5,
            unique_by=lambda touch: touch[2] if touch[2] is not None else object(),
        ),
        max_size=8,
    )
)
def test_every_touch_has_one_session_of_its_own_in_every_frame(frames):
    cursors = Cursors(across_plate(PLATE))
    ended, before = set(), set()
    for number, touches in enumerate(frames):
        now = cursors.update([at(x, y, identity=name) for x, y, name in touches], number / 30)
        sessions = {one.session for one in now}
        assert len(sessions) == len(touches) == len(now)
        assert not sessions & ended
        ended |= before - sessions
        before = sessions
