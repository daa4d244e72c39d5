"""Names of recordings: those that others give never lead out of the folder."""

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from rig.recording.paths import named, require_new


@pytest.mark.parametrize(
    "name",
    ["../x", "/etc/x", "a/b", "..", ".hidden", "", "a\\b", "a\0b", "a..h5", "x" * 101, "a\n"],
)
def test_a_name_that_leads_elsewhere_is_refused(name):
    with pytest.raises(ValueError, match="recording cannot be called"):
        named(Path("recordings"), name)


@given(st.text(max_size=30))
def test_every_name_that_is_taken_lies_in_the_folder(name):
    folder = Path("/data/recordings")
    try:
        path = named(folder, name)
    except ValueError:
        return
    assert path.parent == folder
    assert path.resolve().parent == folder.resolve()
    assert path.suffix == ".h5"


def test_a_recording_replaces_nothing(tmp_path):
    (tmp_path / "there.h5").write_bytes(b"")
    with pytest.raises(OSError, match="is there already; choose another name"):
        require_new(tmp_path / "there.h5")
    with pytest.raises(OSError, match="does not exist; make it first"):
        require_new(tmp_path / "no" / "new.h5")
    with pytest.raises(ValueError, match=r"must be a file \*\.h5"):
        require_new(tmp_path / "new.mat")
    assert require_new(tmp_path / "new.h5") == tmp_path / "new.h5"
