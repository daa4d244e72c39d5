"""`touchplate view` as a command: it serves until it is interrupted, or refuses in a sentence."""

import json
import signal
import subprocess
import sys

import httpx
import pytest

from rig import cli

COMMAND = [sys.executable, "-c", "from rig.cli import main; main()", "view"]


def test_it_serves_until_it_is_interrupted(result, photographs, tmp_path):
    words = [str(result), "--frames", str(photographs), "--out", str(tmp_path), "--json"]
    with subprocess.Popen(
        [*COMMAND, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        page = json.loads(process.stdout.readline())["page"]
        with httpx.Client(follow_redirects=True, trust_env=False) as browser:
            assert "touchplate view" in browser.get(page).text
            state = browser.get(page.partition("?")[0] + "state").json()
            assert len(state["result"]["frames"]) == 3
            assert state["controls"]
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=120) == 0
        assert "Traceback" not in process.stderr.read()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nothing.h5"], "does not exist"),
        (["*.none"], "no image is called"),
        (["{result}", "--interval", "0"], "interval must be positive"),
        (["{result}", "--port", "99999"], "--port 8765"),
    ],
)
def test_what_cannot_be_shown_is_one_sentence(words, said, result, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    words = [word.format(result=result) for word in words]
    monkeypatch.setattr(sys, "argv", ["touchplate", "view", *words])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    text = capsys.readouterr().err
    assert ended.value.code == 2
    assert said in text
    assert text.count("\n") == 1
