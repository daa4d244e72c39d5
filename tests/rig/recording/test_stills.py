"""Stills that are asked for faster than they are written."""

from threading import Event

from rig.recording.stills import WAITING, Stills
from tests.rig.page.conftest import draw_snapshot


def test_stills_beyond_those_that_wait_are_refused_and_the_others_kept(tmp_path):
    said, disk = [], Event()

    def describe(snapshot):
        disk.wait()  # the first is held up, and the others behind it
        return "{}"

    with Stills(tmp_path, said.append, describe) as keep:
        for sequence in range(WAITING + 2):
            keep(draw_snapshot(sequence))
        assert said == [f"snapshot is not kept: {WAITING} wait to be written; ask for fewer"] * 2
        disk.set()
    assert len(list(tmp_path.glob("*.png"))) == WAITING
