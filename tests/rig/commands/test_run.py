"""`touchplate run`: one JSON object, a page of the real loop, and an end that leaves nothing."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest
from websockets.sync.client import connect

PROGRAM = [sys.executable, "-c", "from rig.cli import main; main()"]
READY = "the source gets ready"


SHOWN = (  # what a program has imported in the end, behind what it prints
    "import sys\n"
    "from rig.cli import main\n"
    "try: main()\n"
    "except SystemExit: pass\n"
    "print(*{name.split('.')[0] for name in sys.modules})"
)


@pytest.fixture(scope="module")
def environment(live_cache):
    return os.environ | {"TOUCHPLATE_CACHE": str(live_cache)}


@pytest.fixture(scope="module")
def of_a_process(environment, small_settings):
    """Text of a headless run in a process of its own, and what it has imported."""
    return subprocess.run(
        [
            *(sys.executable, "-c", SHOWN, "run", "twin", *small_settings),
            *("--frames=60", "--headless", "--json", "--set=source.script=random"),
            *("--set=touches.force=[2, 4]", "--set=source.shift=[0.3, 0]"),
        ],
        capture_output=True, text=True, check=False, env=environment,
    )  # fmt: skip


@pytest.fixture
def touchplate(in_process, small_settings, live_cache, tmp_path):
    """Run the small twin to its end; its frames come from a process of their own."""

    def call(*arguments, cache=live_cache):
        return in_process(tmp_path, "run", "twin", *small_settings, *arguments, cache=cache)

    return call


@pytest.fixture
def started(environment, small_settings, session_of):
    """Start the small twin in a session of its own; what is left of it in the end is killed."""
    runs = []

    def start(*arguments, **variables):
        command = [*PROGRAM, "run", "twin", *small_settings, *arguments]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        run = subprocess.Popen(
            command, **pipes, env=environment | variables, start_new_session=True
        )
        runs.append(run)
        return run

    yield start
    for run in runs:
        for pid in session_of(run.pid):
            os.kill(pid, signal.SIGKILL)
        run.communicate()


def read_until(stream, text):
    """Lines of a stream up to the one that holds `text`."""
    lines = ""
    while text not in lines:
        line = stream.readline()
        assert line, f"ended without {text!r}: {lines}"
        lines += line
    return lines


def ask(client):
    client.send("camera strain")
    header = json.loads(client.recv(timeout=120))
    return header, {name: client.recv(timeout=120) for name in header["parts"]}


def test_json_is_one_object_with_figures_against_the_truth(of_a_process):
    assert of_a_process.returncode == 0, of_a_process.stderr
    text, _ = of_a_process.stdout.splitlines()
    said = json.loads(text)
    assert said["frames"] == 60
    assert said["dropped"] >= 0
    assert said["fps"] > 0
    assert 0 < said["latency_ms"]["median"] <= said["latency_ms"]["p95"]
    assert said["stages_ms"].keys() == {
        "arrive", "correlate", "mask", "estimate", "strain", "from strain", "track",
    }  # fmt: skip
    for way, bound in (("pattern", 4.0), ("strain", 6.0)):
        assert said[way]["scored"] >= 20
        assert said[way]["false_touches"] == 0
        assert said[way]["position_median_mm"] < bound
        assert said[way]["force_median_percent"] < 8
    assert READY in of_a_process.stderr


def test_a_headless_run_imports_what_is_shown_and_no_more(of_a_process):
    _, modules = of_a_process.stdout.splitlines()
    left_out = "torch kornia skimage matplotlib h5py usb pygame starlette uvicorn websockets"
    assert not set(modules.split()) & set(left_out.split())
    assert {"dic", "numba", "fe", "synthetic", "models"} <= set(modules.split())


@pytest.mark.slow
def test_nobody_touches_and_nothing_is_found(touchplate):
    done = touchplate(
        "--frames=60", "--headless", "--json", "--set=source.script=empty",
        "--set=source.shift=[0.3, 0]",
    )  # fmt: skip
    said = json.loads(done.stdout)
    for way in ("pattern", "strain"):
        assert said[way]["false_touches"] == said[way]["scored"] == 0
        assert said[way]["position_median_mm"] is None


@pytest.mark.slow
def test_a_second_start_computes_nothing_and_a_damaged_file_heals(touchplate, tmp_path):
    cache = tmp_path / "cache"
    first = touchplate("--frames=1", "--headless", "--json", cache=cache)
    second = touchplate("--frames=1", "--headless", cache=cache)
    assert first.returncode == second.returncode == 0
    assert "plate modes" in first.stderr
    assert "plate modes" not in second.stderr
    # Without --json the figures are a table.
    for text in ("1 frames", "frames a second", "–", "capture to touches", "position median mm"):
        assert text in second.stdout
    kinds = sorted(path.parent.name for path in cache.rglob("*.npz"))
    assert kinds == ["modes", "regime", "sharp-pattern"]
    (modes,) = (cache / "modes").iterdir()
    modes.write_bytes(modes.read_bytes()[:-50])
    third = touchplate("--frames=1", "--headless", "--json", cache=cache)
    assert third.returncode == 0
    assert f"cache file {modes} was damaged and is computed again" in third.stderr


def assert_one_sentence(done, text):
    *before, last = done.stderr.splitlines()
    assert done.returncode == 2
    assert done.stdout == ""
    assert last.startswith("touchplate: ")
    assert text in last
    assert not [line for line in before if "Traceback" in line or "touchplate:" in line]


@pytest.mark.parametrize(
    ("scene", "sentence"),
    [("paper-one", "has no source of frames; add [source]"), ("nothing", "no scene is called")],
)
def test_a_scene_that_cannot_run_is_one_sentence(in_process, tmp_path, scene, sentence):
    done = in_process(tmp_path, "run", scene)
    assert_one_sentence(done, sentence)
    assert done.stderr.count("\n") == 1


def test_a_table_that_is_there_is_refused_before_anything_starts(in_process, tmp_path):
    (tmp_path / "touches.csv").write_text("what was measured")
    done = in_process(tmp_path, "run", "twin", "--touches", "touches.csv")
    assert_one_sentence(done, "table of touches 'touches.csv' is there already; choose another")
    assert (tmp_path / "touches.csv").read_text() == "what was measured"


def test_a_port_in_use_is_refused_before_anything_starts(touchplate):
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        done = touchplate("--frames=1", f"--set=page.port={port}")
    assert_one_sentence(done, f"port {port} on 127.0.0.1 is in use; choose another")
    assert done.stderr.count("\n") == 1


@pytest.mark.slow
def test_the_page_shows_the_real_loop_and_ctrl_c_ends_both(
    started, session_of, shared_memory, ended
):
    settings = "page.port=0", "page.viewers=machine", "source.script=random"
    run = started("--json", *(f"--set={one}" for one in settings))
    url = re.search(r"http://127\.0\.0\.1:\d+/", read_until(run.stderr, "page:")).group()
    assert "touchplate" in httpx.get(url).text
    with connect(f"ws{url.removeprefix('http')}stream", max_size=None) as client:
        first, parts = ask(client)
        for _ in range(600):
            if "strain" in parts:  # not while the loop gets ready
                break
            first, parts = ask(client)
        later, _ = ask(client)
        for _ in range(60):
            if later["touches"]:
                break
            later, _ = ask(client)
    assert first["size"] == [384, 320]
    assert later["sequence"] > first["sequence"]
    assert parts["camera"][:2] == b"\xff\xd8"
    assert len(parts["strain"]) == 3 * 4 * 38 * 46
    (true,), (found,) = later["truth"], later["touches"]
    assert abs(found["x"] - true["x"]) + abs(found["y"] - true["y"]) < 40
    said = interrupt(run, session_of, shared_memory, ended)
    assert said["frames"] >= 2
    assert "show" in said["stages_ms"]
    with pytest.raises(httpx.ConnectError):
        httpx.get(url)


def whole_session(run, signum):
    """Signal the loop and all that it has started, as a terminal does, and systemd by default."""
    os.killpg(run.pid, signum)


def loop_alone(run, signum):
    """Signal the loop, as `kill` does."""
    os.kill(run.pid, signum)


def interrupt(run, session_of, shared_memory, ended, signum=signal.SIGINT, to=whole_session):
    """Press Ctrl-C in a running loop: figures on stdout, code 0, and nothing left."""
    pids = session_of(run.pid)
    assert len(pids) >= 2  # loop and twin
    memory = set().union(*(shared_memory(pid) for pid in pids))
    assert memory
    to(run, signum)
    out, err = run.communicate(timeout=120)
    assert run.returncode == 0, err
    assert "leaked" not in err
    assert "Traceback" not in err
    assert "Error" not in err
    assert not ended(pids)
    assert not [name for name in memory if Path(name).exists()]
    return json.loads(out)


def at_work(started):
    """Start a run without a page; its first frame has been seen."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    run = started("--headless", "--json", f"--set=outputs.websocket.port={port}")
    read_until(run.stderr, READY)
    with connect(f"ws://127.0.0.1:{port}/touches") as touches:
        touches.recv(timeout=120)
    return run


@pytest.mark.slow
@pytest.mark.parametrize("to", [whole_session, loop_alone])
def test_sigterm_ends_a_run_as_cleanly_as_ctrl_c(started, session_of, shared_memory, ended, to):
    run = at_work(started)
    said = interrupt(run, session_of, shared_memory, ended, signal.SIGTERM, to)
    assert said["frames"] > 0


@pytest.mark.parametrize("cached", [True, False])
def test_ctrl_c_while_it_starts_ends_quietly_with_130(
    started, session_of, ended, live_cache, tmp_path, cached
):
    """Before the first frame there are no figures to give."""
    cache = live_cache if cached else tmp_path
    run = started("--json", "--set=page.port=0", TOUCHPLATE_CACHE=str(cache))
    read_until(run.stderr, READY if cached else "page:")
    time.sleep(0.05)
    pids = session_of(run.pid)
    os.killpg(run.pid, signal.SIGINT)
    out, err = run.communicate(timeout=120)
    assert run.returncode == 130, err
    assert out == ""
    assert "Traceback" not in err
    assert "Error" not in err
    assert not ended(pids)
    assert not list(tmp_path.rglob("*.partial"))


@pytest.mark.slow
def test_a_twin_that_dies_ends_the_run_with_one_sentence(started, session_of, ended):
    run = at_work(started)
    pids = session_of(run.pid)
    twins = [p for p in pids if "spawn_main" in Path(f"/proc/{p}/cmdline").read_text()]
    os.kill(twins[0], signal.SIGKILL)
    out, err = run.communicate(timeout=120)
    assert run.returncode == 2
    assert json.loads(out)["frames"] >= 1  # what it had seen until then
    assert err.splitlines()[-1] == "touchplate: the twin's process has ended; start the run again"
    assert not ended(pids)
