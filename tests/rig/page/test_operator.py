"""What the operator asks for is done, and what he should know is on the page."""

import asyncio
import csv
import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import cv2
import numpy as np
import pytest

import models
from rig.calibration.store import Calibration, LatencyEntry
from rig.live.notice import SHOWN
from rig.live.snapshot import Alarm, Mark
from rig.page.files import open_files
from rig.page.operator import Operator
from rig.page.server import Publisher
from rig.projector.display_log import DisplayLog
from rig.projector.markers import fit_plate
from rig.projector.show import Show
from rig.recording.control import Switch
from rig.scene.loop import Page
from rig.web.access import Access
from tests.rig.page.conftest import draw_snapshot

PLATE = (254.0, 200.0)
SCREEN = fit_plate((640, 400), PLATE)
PAGE = Page(port=0)


class Window:
    alive, status = True, "projector window on :0, 640 x 400 px"

    def __init__(self):
        self.shown = DisplayLog()

    def __call__(self, content):
        self.content = content


class Nothing:
    """A recorder of nothing."""

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def begin(self, *given):
        pass

    def summary(self):
        return {"status": "recording to 'a.h5'", "path": "a.h5", "frames": 3, "dropped": 1}


@pytest.fixture
def bench():
    """Give publisher, operator, show and window."""
    publisher, window = Publisher(0, SCREEN, Access()), Window()
    show = Show(window, SCREEN, "beside", PLATE, 0.02, lambda: 100.05)
    switch = Switch(lambda file: Nothing(), None)
    two_days = datetime.now(UTC) - timedelta(days=2, hours=1)
    known = Calibration(latency=LatencyEntry(date=two_days, error=0.002, median=0.05, p95=0.06))
    operator = Operator(publisher, switch, known, ("it is old",), show)
    return publisher, operator, show, window


def page_controls(publisher):
    return publisher.packets._newest.page_controls


def test_notes_recording_settings_and_calibration_are_among_the_controls(bench):
    publisher, operator, _, _ = bench
    operator(draw_snapshot(1))
    shown = page_controls(publisher)
    assert shown.notes == ("it is old",)
    assert not shown.recording.running
    (setting,) = shown.settings
    assert (setting.value, setting.choices) == ("beside", ("on", "beside", "outside"))
    (part,) = shown.calibration
    assert (part.name, part.days, part.error, part.unit) == ("latency", 2, 0.002, "s")


def test_the_button_starts_and_ends_a_recording(bench):
    publisher, operator, _, _ = bench
    publisher.ask({"do": "record"})
    operator(draw_snapshot(1))
    assert page_controls(publisher).recording.running
    assert page_controls(publisher).recording.frames == 3
    publisher.ask({"do": "record"})
    operator(draw_snapshot(2))
    assert not page_controls(publisher).recording.running


def test_a_tare_is_asked_for_and_its_notice_is_the_first_note():
    publisher, asked = Publisher(0, SCREEN, Access()), []
    switch = Switch(lambda file: Nothing(), None)
    operator = Operator(
        publisher, switch, Calibration(), ("it is old",), tare=lambda: asked.append("tare")
    )
    publisher.ask({"do": "tare"})
    operator(replace(draw_snapshot(1), notice="tare: done"))
    assert asked == ["tare"]
    assert page_controls(publisher).notes == ("tare: done", "it is old")


def test_the_mode_of_the_marks_changes_while_the_loop_runs(bench):
    publisher, operator, show, window = bench
    snapshot = draw_snapshot(1)
    show(snapshot)
    assert window.content[0].x != snapshot.touches[0].x
    publisher.ask({"do": "set", "key": "projector.mode", "value": "on"})
    operator(snapshot)
    show(snapshot)
    assert window.content == snapshot.touches
    assert publisher.packets._newest.shown == snapshot.touches


@pytest.mark.parametrize(
    "wish",
    [
        {"do": "set", "key": "projector.mode", "value": "dark"},  # the window does not blink
        {"do": "set", "key": "plate.size", "value": "on"},
        {"do": "set", "value": []},
        {"do": "format the disk"},
    ],
)
def test_what_may_not_be_changed_stays(bench, wish):
    publisher, operator, show, _ = bench
    publisher.ask(wish)
    operator(draw_snapshot(1))
    assert show.mode == "beside"
    assert not page_controls(publisher).recording.running


def test_touches_of_a_frame_that_is_too_old_are_not_shown(bench):
    _, _, show, window = bench
    show(draw_snapshot(1, captured=99.9))
    assert window.content == ()
    show(draw_snapshot(1, captured=99.96))
    assert len(window.content) == 2


def test_a_projector_that_has_gone_is_noted(bench):
    publisher, operator, _, window = bench
    window.alive, window.status = False, "projector window on :0 has gone; it is opened again"
    operator(draw_snapshot(1))
    assert window.status in page_controls(publisher).notes


def test_a_mark_is_shown_where_the_mode_puts_it(bench):
    _, _, show, window = bench
    show(draw_snapshot(1, touches=(Mark(60.0, 100.0, 1.0),)))
    assert window.content[0].x == pytest.approx(90.0)


def test_a_known_weight_is_awaited_and_what_is_none_is_refused_in_a_note(bench):
    publisher, _, _, _ = bench
    awaited = []

    def weigh(force):
        if force < 0.5:
            raise ValueError("known weight must be 0.5 N or more")
        awaited.append(force)

    switch = Switch(lambda file: Nothing(), None)
    operator = Operator(publisher, switch, Calibration(), (), weigh=weigh)
    for force, notes in ((2, []), (0.1, ["0.5 N or more"]), ("x", ["a number in N"]), (3.5, [])):
        publisher.ask({"do": "weigh", "force": force})
        operator(draw_snapshot(1))
        shown = asyncio.run(publisher.packets.newer(None)).page_controls.notes
        assert len(shown) == len(notes)
        assert all(part in note for part, note in zip(notes, shown, strict=True))
    assert awaited == [2.0, 3.5]
    publisher.ask({"do": "weigh", "force": "x"})
    for captured, count in ((200.0, 1), (200.0 + SHOWN, 0)):
        operator(draw_snapshot(1, captured=captured))
        assert len(page_controls(publisher).notes) == count


def estimated(sequence, force):
    """Draw a snapshot of one touch, with the estimate behind it."""
    place, spread = np.array([[20.0, 30.0]]), np.diag([0.04, 0.09, 0.01])
    found = models.Estimate(place, np.array([force]), spread, 150.0, 100, 0.25, models.Result.FOUND)
    touches = (Mark(20.0, 30.0, force, identity=3),)
    return draw_snapshot(sequence, estimate=found, touches=touches)


def test_a_snapshot_keeps_image_and_state_of_the_frame_that_is_seen(tmp_path):
    publisher, said = Publisher(0, SCREEN, Access()), []
    switch = Switch(lambda file: Nothing(), None)
    with open_files(tmp_path, PAGE, said.append) as files:
        operator = Operator(publisher, switch, Calibration(), (), files=files)
        publisher.ask({"do": "snapshot"})
        operator(estimated(9, 1.75))
    (image,), (state,) = tmp_path.glob("*.png"), tmp_path.glob("*.json")
    seen = draw_snapshot(9)
    np.testing.assert_array_equal(cv2.imread(str(image), cv2.IMREAD_GRAYSCALE), seen.image)
    known = json.loads(state.read_text())
    assert (known["sequence"], known["touches"][0]["force"], known["fps"]) == (9, 1.75, 29.7)
    assert said == [f"snapshot kept in '{image}'"]
    operator(estimated(10, 1.0))
    assert page_controls(publisher).notes == tuple(said)


def test_touches_are_written_from_the_wish_on_to_the_next(tmp_path):
    publisher, said = Publisher(0, SCREEN, Access()), []
    switch = Switch(lambda file: Nothing(), None)
    with open_files(tmp_path, PAGE, said.append) as files:
        operator = Operator(publisher, switch, Calibration(), (), files=files)
        operator(estimated(1, 1.0))
        assert page_controls(publisher).table == ""
        publisher.ask({"do": "csv"})
        operator(estimated(2, 2.0))
        operator(estimated(3, 3.0))
        (path,) = tmp_path.iterdir()
        assert page_controls(publisher).table == str(path)
        publisher.ask({"do": "csv"})
        operator(estimated(4, 4.0))
        assert page_controls(publisher).table == ""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["frame"], float(row["force_n"])) for row in rows] == [("2", 2.0), ("3", 3.0)]
    assert said == [f"touches are written to '{path}'", f"touches are in '{path}'"]


def test_a_table_that_cannot_be_written_is_a_note_and_the_page_goes_on(tmp_path):
    publisher, said = Publisher(0, SCREEN, Access()), []
    switch = Switch(lambda file: Nothing(), None)
    folder = tmp_path / "file"
    folder.write_text("no folder")
    with open_files(folder, PAGE, said.append) as files:
        operator = Operator(publisher, switch, Calibration(), (), files=files)
        publisher.ask({"do": "csv"})
        operator(estimated(2, 2.0))
    (sentence,) = page_controls(publisher).notes
    assert sentence.startswith(f"touches are not written to '{folder}")
    assert page_controls(publisher).table == ""


def test_an_alarm_is_the_first_note(bench):
    publisher, operator, _, _ = bench
    operator(draw_snapshot(1, notice="tare: done", alarms=(Alarm("force", 1.0, "lift it"),)))
    assert page_controls(publisher).notes[:2] == ("lift it", "tare: done")
