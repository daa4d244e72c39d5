"""A real desktop, as the setup asks it: in a process of its own, each time anew."""

import pytest

from rig.setup.real_bench import RealBench


@pytest.fixture
def bench():
    said = []
    return RealBench(said.append)


def test_a_desktop_says_which_outputs_it_has(bench, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    (output,) = bench.outputs()
    assert output.index == 0
    assert min(output.size) > 0


def test_without_a_desktop_a_sentence_says_so(bench, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("SDL_VIDEODRIVER", "x11")
    monkeypatch.setenv("DISPLAY", ":987")
    with pytest.raises(OSError, match=r"^the display did not open \(.*\); log in to a desktop, "):
        bench.outputs()


def test_a_desktop_that_nobody_sees_is_none(bench, monkeypatch, tmp_path):
    for name in ("WAYLAND_DISPLAY", "SDL_VIDEODRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("DISPLAY", ":987")  # SDL looks for others, and falls back to one in memory
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(OSError, match=r"nobody sees it: driver '.*'\); log in to a desktop"):
        bench.outputs()


def test_cameras_are_those_of_the_kernel(bench, monkeypatch, tmp_path):
    from rig.doctor import devices

    for number, (name, index) in enumerate([("Left", "0"), ("Left", "1"), ("Right", "0")]):
        folder = tmp_path / f"video{number}"
        folder.mkdir()
        (folder / "name").write_text(f"{name}\n")
        (folder / "index").write_text(f"{index}\n")
    monkeypatch.setattr(devices, "VIDEO", tmp_path)
    found = [(one.device, one.name) for one in bench.cameras()]
    assert found == [("/dev/video0", "Left"), ("/dev/video2", "Right")]
