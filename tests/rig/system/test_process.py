"""Ctrl-C: ends what may be ended, also where it was lost, and never what closes."""

import signal
import subprocess
import sys
import time
from contextlib import suppress

import pytest

from rig.system.process import AGAIN, deaf_to_interrupts, interruptible


def lose_an_interrupt():
    """As a callback of compiled code does."""
    with suppress(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)


def run(*steps):
    with interruptible():
        for step in steps:
            step()


def fail():
    raise SystemError


def test_an_interrupt_that_was_lost_comes_again():
    with pytest.raises(KeyboardInterrupt):
        run(lose_an_interrupt, lose_an_interrupt, lambda: time.sleep(20 * AGAIN))


def test_an_interrupt_that_became_a_system_error_is_one_again():
    with pytest.raises(KeyboardInterrupt):
        run(lose_an_interrupt, fail)


def test_an_own_system_error_stays_one():
    with pytest.raises(SystemError):
        run(fail)


def test_nothing_comes_again_after_the_block():
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        run(lambda: signal.raise_signal(signal.SIGINT))
    assert signal.getsignal(signal.SIGINT) is before
    time.sleep(2 * AGAIN)


def test_what_closes_within_the_block_is_not_broken_off():
    closed = []

    def close():
        try:
            signal.raise_signal(signal.SIGINT)
        finally:
            with deaf_to_interrupts():
                time.sleep(2 * AGAIN)
                closed.append(True)

    with pytest.raises(KeyboardInterrupt):
        run(close)
    assert closed


def test_an_interrupt_while_a_process_starts_is_answered_after():
    done = []

    def start():
        with deaf_to_interrupts():
            signal.raise_signal(signal.SIGINT)
            done.append("started")
        done.append("went on")

    with pytest.raises(KeyboardInterrupt):
        run(start)
    assert done == ["started"]


def test_a_process_that_starts_in_the_block_is_deaf_to_interrupts():
    code = "import os, signal; os.kill(os.getpid(), signal.SIGINT); print('deaf')"
    with deaf_to_interrupts():
        process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE)
    assert process.communicate(timeout=120)[0] == b"deaf\n"


def test_an_alarm_of_the_user_rings_as_ever():
    rung, before = [], signal.getsignal(signal.SIGALRM)
    signal.signal(signal.SIGALRM, lambda signum, frame: rung.append(signum))
    try:
        with interruptible():
            signal.raise_signal(signal.SIGALRM)
        signal.raise_signal(signal.SIGALRM)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert rung == [signal.SIGALRM] * 2


def test_a_process_that_is_spawned_does_not_run_the_script_again(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import multiprocessing, os\n"
        "from rig.system.process import without_script\n"
        "process = multiprocessing.get_context('spawn').Process(target=os.getpid)\n"
        "with without_script():\n"
        "    process.start()\n"
        "process.join()\n"
        "print(process.exitcode)\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert done.stdout == "0\n"
    assert done.stderr == ""
