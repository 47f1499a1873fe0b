"""The watchman under systemd: it ends what hangs, and nobody who could not run, or is on its way out."""

import os
import signal
import subprocess
import sys
import time

import pytest
from beating import BEATS, WAITS
from running import wait_until

LEAVES = """
import os, time
from deixis_runtime.manager import Manager
manager = Manager(os.environ)
manager.tell(time.monotonic())
print("up", flush=True)
manager.leave()
time.sleep(2)
"""


class Watched:
    """A watchman, and programs that give it signs."""

    def __init__(self, folder):
        self.path = folder / "socket"
        self._started = []
        self.start_watchman()

    def start_watchman(self):
        argv = [sys.executable, "-m", "deixis_runtime.watchman", "--socket", self.path]
        self.watchman = subprocess.Popen(argv, stderr=subprocess.PIPE, text=True)
        self._started.append(self.watchman)
        wait_until(self.path.exists, "the watchman hears", 20)

    def start(self, program):
        environment = {**os.environ, "DEIXIS_WATCHMAN": str(self.path)}
        child = subprocess.Popen([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True)
        self._started.append(child)
        assert child.stdout.readline().startswith("up")
        return child

    def end(self):
        for process in self._started:
            process.kill()
            process.communicate()


@pytest.fixture
def watched(tmp_path):
    it = Watched(tmp_path)
    yield it
    it.end()


def test_who_hangs_is_killed_within_two_seconds_and_named_and_the_others_are_not(watched):
    healthy, hung = watched.start(BEATS), watched.start(BEATS)
    with pytest.raises(subprocess.TimeoutExpired):
        hung.wait(1.5)
    hung.send_signal(signal.SIGSTOP)
    began = time.monotonic()
    assert hung.wait(20) == -signal.SIGKILL
    assert time.monotonic() - began < 2.0
    assert f"(process {hung.pid}) gave no sign that its loop runs for 0.8 s; killed" in watched.watchman.stderr.readline()
    assert healthy.poll() is None


def test_who_could_not_run_is_left_in_peace(watched):
    child = watched.start(WAITS)
    assert child.stdout.readline() == f"back {child.pid}\n"


def test_who_ends_in_good_order_has_the_time_it_takes(watched):
    assert watched.start(LEAVES).wait(20) == 0


def test_a_watchman_that_was_killed_hears_the_same_ones_again(watched):
    child = watched.start(BEATS)
    watched.watchman.kill()
    watched.watchman.wait()
    watched.path.unlink()
    with pytest.raises(subprocess.TimeoutExpired):
        child.wait(0.5)
    watched.start_watchman()
    time.sleep(1)
    child.send_signal(signal.SIGSTOP)
    assert child.wait(20) == -signal.SIGKILL


def test_sigterm_ends_it_and_its_socket(watched):
    watched.watchman.terminate()
    assert watched.watchman.wait(20) == 0
    assert not watched.path.exists()


def test_a_socket_that_cannot_be_made_is_said(tmp_path):
    argv = [sys.executable, "-m", "deixis_runtime.watchman", "--socket", tmp_path / "none" / "socket"]
    done = subprocess.run(argv, check=False, capture_output=True, text=True, timeout=20)
    assert done.returncode == 1
    assert done.stderr == f"deixis-watchman: {tmp_path}/none/socket: No such file or directory\n"
