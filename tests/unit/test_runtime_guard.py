"""The first process of a container: it ends what hangs, and ends with it."""

import signal
import subprocess
import sys
import time

import pytest

# As a stage does: alive several times a second.
BEATS = """
import os, time
from deixis_runtime.manager import Manager
manager = Manager(os.environ)
print("up", os.getpid(), flush=True)
while True:
    manager.tell(time.monotonic())
    time.sleep(0.05)
"""


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
        guard.kill()
        guard.communicate()


def test_a_process_that_is_stopped_is_killed_and_the_status_says_so(guarded):
    guard, pid = guarded(BEATS, "--silent-s", "1")
    with pytest.raises(subprocess.TimeoutExpired):  # alive for longer than silence is borne
        guard.wait(2)
    subprocess.run(["kill", "-STOP", str(pid)], check=True)
    began = time.monotonic()
    assert guard.wait(20) == 128 + signal.SIGKILL
    assert time.monotonic() - began > 0.5
    assert "gave no sign that its loop runs for 1 s; killing it" in guard.stderr.read()


def test_a_process_that_never_says_that_it_is_ready_is_killed(guarded):
    guard, _ = guarded("import time; print('up 0', flush=True); time.sleep(60)", "--ready-s", "0.5")
    assert guard.wait(20) == 128 + signal.SIGKILL


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
