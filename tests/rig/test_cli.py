"""The command line: quick, a sentence for what the user can correct, a traceback on demand."""

import errno
import importlib.metadata
import os
import subprocess
import sys

import pytest
from rich.markup import render
from typer.main import get_command
from typer.testing import CliRunner

import rig
from rig import cli

RUN = [sys.executable, "-c", "from rig.cli import main; main()"]


def touchplate(*arguments, **options):
    return subprocess.run(
        [*RUN, *arguments], capture_output=True, text=True, check=False, **options
    )


def test_help_names_every_command_and_imports_none():
    code = (
        "import sys; sys.argv = ['touchplate', '--help']\n"
        "from rig.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'numpy', 'pydantic', 'dic', 'fe', 'synthetic', 'models', 'torch', 'numba'}\n"
        "print(heavy & set(sys.modules), [m for m in sys.modules if m.startswith('rig.commands.')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip().endswith("set() []")
    for name in cli.COMMANDS:
        assert name in done.stdout


def test_the_version_is_that_of_the_package():
    done = touchplate("--version")
    assert done.stdout == f"touchplate {importlib.metadata.version('touchplate')}\n"
    assert (done.returncode, done.stderr) == (0, "")
    assert rig.__version__ == importlib.metadata.version("touchplate")


CALIBRATIONS = ("camera", "pose", "projector", "latency", "noise", "stripes")


@pytest.mark.parametrize(
    "name",
    [
        *sorted(set(cli.COMMANDS) - {"calibrate", "print"}),
        *(f"calibrate {what}" for what in CALIBRATIONS),
        *(f"print {what}" for what in ("board", "speckle")),
    ],
)
def test_every_command_has_help(name):
    arguments = [*name.split(), "--help"]
    done = CliRunner().invoke(cli.application(arguments), arguments)
    assert done.exit_code == 0, done.output
    assert "--json" in done.output


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_no_help_holds_brackets_that_markup_would_swallow(name):
    waiting = [get_command(cli.application([name])).commands[name]]
    while waiting:
        command = waiting.pop()
        waiting += getattr(command, "commands", {}).values()
        for text in (command.help, *(each.help for each in command.params)):
            assert render(text or "").plain == (text or "")


def test_the_help_of_calibrate_names_what_it_can():
    done = CliRunner().invoke(cli.application(["calibrate"]), ["calibrate", "--help"])
    assert all(what in done.output for what in CALIBRATIONS)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["show", "nothing"], "touchplate: no scene is called 'nothing'; shipped are "),
        (["show", "no/such.toml"], "touchplate: scene file 'no/such.toml' does not exist"),
        (["show", "twin", "--set", "plate.thickness=-2"], "touchplate: twin.toml: plate.thickness"),
        (["show", "twin", "--set", "plate.thickness"], "touchplate: setting 'plate.thickness'"),
    ],
)
def test_what_the_user_can_correct_is_one_line(arguments, sentence):
    done = touchplate(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith(sentence)
    assert done.stderr.count("\n") == 1


def test_a_pipe_without_greek_letters_gets_the_rest():
    environment = dict(os.environ, PYTHONIOENCODING="cp1252")
    done = touchplate("show", "twin", env=environment, encoding="cp1252")
    assert (done.returncode, done.stderr) == (0, "")
    assert "MPa, ? 0.38" in done.stdout
    assert "254 × 254 × 2 mm" in done.stdout


def test_a_pipe_of_utf_8_gets_every_letter():
    environment = dict(os.environ, PYTHONIOENCODING="utf-8")
    assert "MPa, ν 0.38" in touchplate("show", "twin", env=environment, encoding="utf-8").stdout


def test_a_traceback_comes_when_it_is_asked_for():
    by_option = touchplate("show", "nothing", "--traceback")
    by_variable = touchplate("show", "nothing", env={"TOUCHPLATE_TRACEBACK": "1"})
    for done in (by_option, by_variable):
        assert done.returncode == 1
        assert "Traceback" in done.stderr
        assert "SceneError: no scene is called 'nothing'" in done.stderr


def test_a_wrong_command_or_option_is_explained():
    for arguments in (["shew"], ["show", "twin", "--jsn"]):
        done = touchplate(*arguments)
        assert done.returncode == 2
        assert "No such" in done.stderr
        assert "Traceback" not in done.stderr


def test_an_error_of_the_system_names_file_and_remedy():
    says = "'a.h5': Permission denied; change its permissions, or name another place"
    assert cli.sentence(OSError(errno.EACCES, "Permission denied", "a.h5")) == says
    full = OSError(errno.ENOSPC, "No space left on device")
    assert cli.sentence(full) == "No space left on device; free some space, or name another place"
    assert cli.sentence(ValueError("two\n  lines")) == "two lines"


def run_raising(error, monkeypatch):
    def broken() -> None:
        raise error

    monkeypatch.setattr(cli, "_part", lambda name: broken)
    monkeypatch.setattr(sys, "argv", ["touchplate", "show"])
    cli.main()


def test_ctrl_c_ends_quietly(monkeypatch, capsys):
    with pytest.raises(SystemExit) as ended:
        run_raising(KeyboardInterrupt(), monkeypatch)
    assert ended.value.code == 130
    assert capsys.readouterr() == ("", "")


def test_a_fault_of_the_program_is_not_hidden(monkeypatch):
    with pytest.raises(RuntimeError, match="a bug"):
        run_raising(RuntimeError("a bug"), monkeypatch)
