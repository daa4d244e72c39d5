"""A recording that is started and ended while the loop runs."""

from types import SimpleNamespace

from rig.commands.run import recording_sinks
from rig.recording.control import Switch


class Kept:
    """A recorder that remembers what it was given."""

    def __init__(self, file, log):
        self.file, self.log = file, log

    def __enter__(self):
        self.log.append(("open", self.file))
        return self

    def __exit__(self, *error):
        self.log.append(("close", self.file))

    def begin(self, *given):
        self.log.append(("begin", *given))

    def put(self, shot):
        self.log.append(("put", shot))

    def summary(self):
        return {"file": self.file, "path": str(self.file)}

    failure = ""


def test_a_recording_begins_with_the_reference_whenever_it_is_started():
    log = []
    zero, chain = SimpleNamespace(), SimpleNamespace()
    with Switch(lambda file: Kept(file, log), None) as switch:
        switch.begin(zero, chain, True)
        switch.put("lost")
        assert switch.summary() is None
        switch.toggle()
        switch.put("kept")
        assert switch.on
        switch.toggle()
        switch.put("lost")
    assert log == [("open", None), ("begin", zero, chain, True), ("put", "kept"), ("close", None)]


def test_a_named_recording_runs_from_the_first_frame_to_the_end():
    log = []
    with Switch(lambda file: Kept(file, log), "a.h5") as switch:
        switch.begin(1, 2, False)
        switch.put("first")
        assert switch.summary()["file"] == "a.h5"
    assert [entry[0] for entry in log] == ["open", "begin", "put", "close"]


def test_a_recording_that_cannot_start_is_a_sentence():
    def refuse(file):
        raise OSError("the folder is read-only")

    with Switch(refuse, None) as switch:
        switch.begin(1, 2, False)
        switch.toggle()
        assert not switch.on
        assert switch.refusal == "the folder is read-only"
        switch.put("shot")


def test_the_terminal_says_once_where_each_recording_lies(tmp_path, monkeypatch):
    said, names = [], ("session-1.h5", "session-2.h5")
    monkeypatch.setattr("rig.commands.run.say", said.append)
    monkeypatch.chdir(tmp_path)
    files = iter(names)
    with Switch(lambda file: Kept(next(files), []), None) as switch:
        sinks = recording_sinks(switch)
        for begins in (False, True, False, True, False):
            if begins:
                switch.toggle()
            for _ in range(3):
                for sink in sinks:
                    sink("snapshot")
            if begins:
                switch.toggle()
    assert said == [
        f"recording to '{tmp_path / name}'" for name in ("session-1.h5", "session-2.h5")
    ]
