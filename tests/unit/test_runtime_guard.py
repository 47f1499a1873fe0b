"""The first process of a container: it ends what hangs, starts again what was killed, and ends with what ended."""

import os
import signal
import subprocess
import sys
import time

import pytest
from beating import BEATS, WAITS


@pytest.fixture
def guarded():
    """Starts a Python program under guard; gives the guard and the program's process number."""
    started = []

    def start(program, *options):
        argv = [sys.executable, "-m", "deixis_runtime.guard", *options, "--", sys.executable, "-c", program]
        guard = subprocess.Popen(argv, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        started.append(guard)
        return guard, int(guard.stdout.readline().split()[1])

    yield start
    for guard in started:
        guard.terminate()
        guard.communicate(timeout=20)


@pytest.mark.parametrize("number", [signal.SIGSTOP, signal.SIGKILL])
def test_a_process_that_hangs_or_is_killed_is_there_again_within_two_seconds(guarded, number):
    guard, pid = guarded(BEATS)
    with pytest.raises(subprocess.TimeoutExpired):  # alive for longer than silence is borne
        guard.wait(2)
    os.kill(pid, number)
    began = time.monotonic()
    word, again = guard.stdout.readline().split()
    assert time.monotonic() - began < 2.0
    assert word == "up"
    assert int(again) != pid


def test_what_hangs_again_and_again_is_given_up_and_the_reason_said(guarded):
    guard, _ = guarded("print('up 0', flush=True); import time; time.sleep(60)", "--ready-s", "0.2")
    assert guard.wait(40) == 128 + signal.SIGKILL
    said = guard.stderr.read()
    assert "gave no sign that its loop runs within 0.2 s; killing it" in said
    assert "is given up: it ended 6 times within 60 s" in said


def test_a_process_that_could_not_run_is_left_in_peace(guarded):
    """It is silent for more than twice what is borne, through no fault of its own."""
    guard, pid = guarded(WAITS)
    assert guard.stdout.readline() == f"back {pid}\n"


def test_sigterm_reaches_the_process_even_a_stopped_one(guarded):
    stops = "import os, signal; print('up', os.getpid(), flush=True); signal.sigwait([signal.SIGTERM]); raise SystemExit(7)"
    program = "import signal; signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM]); " + stops
    guard, pid = guarded(program)
    subprocess.run(["kill", "-STOP", str(pid)], check=True)
    guard.send_signal(signal.SIGTERM)
    assert guard.wait(20) == 7


def test_the_status_is_that_of_the_process():
    argv = [sys.executable, "-m", "deixis_runtime.guard", sys.executable, "-c", "raise SystemExit(78)"]
    assert subprocess.run(argv, check=False, timeout=20).returncode == 78
