"""Tables of touches that are begun and ended while frames come."""

from datetime import datetime
from unittest.mock import Mock

from rig.recording.touches_table import TouchesTable


def test_a_table_of_the_same_second_is_not_written_over(tmp_path, monkeypatch):
    moment = datetime(2026, 1, 2, 3, 4, 5)
    monkeypatch.setattr("rig.recording.touches_table.datetime", Mock(now=lambda: moment))
    said = []
    with TouchesTable(tmp_path, said.append) as table:
        table.toggle()
        table.toggle()
        (path,) = tmp_path.iterdir()
        path.write_text("what was measured")
        table.toggle()
        assert table.path is None
    assert path.read_text() == "what was measured"
    assert said[-1].endswith(f"table of touches '{path}' is there already; choose another name")
