"""Recordings that are played beside a run, on a page of another process."""

import json
import os
import signal

import httpx
import pytest
from websockets.sync.client import connect

from rig.calibration.store import Calibration
from rig.page.files import open_files
from rig.page.operator import Operator
from rig.page.playback_page import PlaybackPage
from rig.page.server import Publisher
from rig.recording.control import Switch
from rig.recording.paths import recordings
from rig.scene.loop import Page
from rig.web.access import Access
from tests.rig.page.conftest import draw_snapshot
from tests.waiting import wait_for

SECONDS = 60.0
EVERYONE = Page(port=0, viewers="machine")


@pytest.fixture
def folder(session, tmp_path):
    """Give a folder with a recording of ten frames, and a file that is none."""
    session(tmp_path / "whole.h5", range(60, 70))
    (tmp_path / "broken.h5").write_bytes(b"no recording")
    return tmp_path


@pytest.fixture
def listed(tmp_path):
    """Give a folder with two files of which the names alone are read."""
    for name in ("whole.h5", "broken.h5"):
        (tmp_path / name).write_bytes(b"no recording")
    return tmp_path


@pytest.mark.slow
def test_a_recording_is_played_on_a_page_that_ends_with_the_run(folder, ended):
    with PlaybackPage(folder, EVERYONE) as playback:
        assert playback.state().names == ()
        playback.look()
        assert set(playback.state().names) == {"whole.h5", "broken.h5"}
        playback.play("whole.h5")
        assert (playback.state().played, playback.state().address) == ("whole.h5", "")
        address = wait_for(lambda: playback.state().address)
        assert "Place in the recording" in httpx.get(address).text
        with connect(address.replace("http", "ws") + "stream") as client:
            client.send("camera")
            header = json.loads(client.recv(timeout=SECONDS))
        assert header["played"]["length"] > 0
        assert " in whole.h5: " in header["status"]
        pid = playback.pid
    assert ended([pid]) == []


@pytest.mark.slow
def test_a_file_that_is_no_recording_is_a_sentence_and_another_can_be_chosen(folder):
    with PlaybackPage(folder, EVERYONE) as playback:
        playback.look()
        playback.play("broken.h5")
        sentence = wait_for(lambda: playback.state().trouble)
        assert "broken.h5" in sentence
        playback.play("whole.h5")
        assert playback.state().trouble == ""


@pytest.mark.slow
def test_a_page_that_dies_is_a_sentence(folder):
    with PlaybackPage(folder, EVERYONE) as playback:
        playback.look()
        playback.play("whole.h5")
        os.kill(playback.pid, signal.SIGKILL)
        sentence = wait_for(lambda: playback.state().trouble)
        assert sentence == "page of 'whole.h5' has ended; choose the recording again"
        assert (playback.state().address, playback.pid) == ("", None)


def test_a_recording_that_goes_while_the_folder_is_read_is_not_listed(listed):
    (listed / "gone.h5").symlink_to(listed / "nowhere")
    assert set(recordings(listed)) == {"whole.h5", "broken.h5"}


@pytest.mark.parametrize("name", ["../whole.h5", "other.h5", "", None])
def test_only_what_is_listed_is_played(listed, name):
    publisher, switch = Publisher(0, None, Access()), Switch(lambda file: None, None)
    with open_files(listed, EVERYONE, print) as files:
        operator = Operator(publisher, switch, Calibration(), (), files=files)
        publisher.ask({"do": "recordings"})
        publisher.ask({"do": "playback", "name": name})
        operator(draw_snapshot(1))
        shown = publisher.packets._newest.page_controls
        assert set(shown.recordings.names) == {"whole.h5", "broken.h5"}
        assert shown.recordings.played == ""
    (note,) = shown.notes
    assert note.startswith(f"no recording here is called '{name}'")
