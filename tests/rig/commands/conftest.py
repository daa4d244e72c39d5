"""A command in this process, where starting another would prove no more."""

import subprocess
import sys
import warnings

import pytest

from rig.cli import main


@pytest.fixture
def in_process(monkeypatch, capfd):
    """Run a command in a folder that holds its cache: `in_process(folder, "score", "oblong")`."""
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # that of the command ends

    def run(folder, *arguments, cache=None):
        monkeypatch.chdir(folder)
        monkeypatch.setenv("TOUCHPLATE_CACHE", str(cache or folder / "cache"))
        monkeypatch.setattr(sys, "argv", ["touchplate", *arguments])
        capfd.readouterr()
        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code or 0
        return subprocess.CompletedProcess(arguments, code, *capfd.readouterr())

    return run
