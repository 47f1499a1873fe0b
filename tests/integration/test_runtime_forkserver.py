"""Stages are forked from a process that has done their imports, and do without it where it fails."""

import logging
import os
import signal
import subprocess
import time
from pathlib import Path

import pytest
from deixis_runtime.host import Host, HostOptions
from deixis_runtime.launching import Forkable, ForkedChild, ForkServer
from deixis_runtime.settings import STARTED_BEFORE
from deixis_runtime.stage import EXIT_CONFIG, EXIT_UNREACHABLE
from deixis_schemas import topics
from running import BIN, children

PYTHON = str(BIN / "python")
ROUTER = Forkable((PYTHON, "-m", "deixis_runtime.router"), "deixis_runtime.router:main")
GESTURE = Forkable((str(BIN / "deixis-gesture"),), "deixis_gesture.service:main")
LONG_S = 60.0
"""A start from nothing takes half a second, and ten where others have the machine."""
NO_ROUTER = [*GESTURE.begins, "--robot", "r", "--connect", "tcp/127.0.0.1:1"]


@pytest.fixture(scope="module")
def server():
    with ForkServer([ROUTER, GESTURE]) as server:
        yield server


@pytest.fixture
def router(server, tmp_path):
    """A router that was forked, once it listens."""
    path = tmp_path / "router.sock"
    child = server.start([*ROUTER.begins, "--supervised", "--listen", f"unixsock-stream/{path}"], os.environ)
    yield until(child, path.exists)
    child.kill()
    child.wait(LONG_S)


def until(child, condition):
    deadline_s = time.monotonic() + LONG_S
    while not condition():
        assert child.poll() is None
        assert time.monotonic() < deadline_s
        time.sleep(0.01)
    return child


def test_a_forked_process_is_our_child_under_its_own_name(router):
    assert isinstance(router, ForkedChild)
    assert router.pid in children(os.getpid())
    assert b"python -m deixis_runtime.router --supervised" in Path(f"/proc/{router.pid}/cmdline").read_bytes()
    assert os.getpgid(router.pid) == router.pid, "Ctrl-C does not reach it"
    with pytest.raises(subprocess.TimeoutExpired):
        router.wait(0.01)
    router.send_signal(signal.SIGTERM)
    assert router.wait(LONG_S) == 0
    assert router.poll() == 0
    router.kill()  # of what has ended nobody is hit, whoever has its number now


def test_how_a_forked_process_ends_is_known(server):
    assert server.start(NO_ROUTER, os.environ).wait(LONG_S) == EXIT_UNREACHABLE
    assert server.start([*GESTURE.begins, "--no-such-option"], os.environ).wait(LONG_S) == 2
    killed = server.start(NO_ROUTER, os.environ)
    killed.kill()
    assert killed.wait(LONG_S) == -signal.SIGKILL


def test_a_forked_process_has_the_environment_it_is_given(server):
    child = server.start(NO_ROUTER, {**os.environ, STARTED_BEFORE: "many times"})
    assert child.wait(LONG_S) == EXIT_CONFIG


def test_another_command_is_started_from_nothing(server):
    child = server.start(["true"], os.environ)
    assert isinstance(child, subprocess.Popen)
    assert child.wait(LONG_S) == 0


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP], ids=["killed", "stopped"])
def test_children_outlive_the_process_that_forks_and_new_ones_do_without_it(number, tmp_path, caplog):
    with ForkServer([ROUTER, GESTURE]) as server:
        path = tmp_path / "router.sock"
        router = server.start([*ROUTER.begins, "--supervised", "--listen", f"unixsock-stream/{path}"], os.environ)
        until(router, path.exists)
        os.kill(server.pid, number)
        before = set(children(os.getpid()))
        with caplog.at_level(logging.WARNING):
            child = server.start(NO_ROUTER, os.environ)
        assert isinstance(child, subprocess.Popen)
        assert "started from nothing" in caplog.text
        assert child.wait(LONG_S) == EXIT_UNREACHABLE
        assert set(children(os.getpid())) <= before  # nobody was forked all the same
        assert router.poll() is None
        router.send_signal(signal.SIGTERM)
        assert router.wait(LONG_S) == 0


def test_what_cannot_be_imported_or_starts_a_thread_is_not_forked(tmp_path, monkeypatch):
    (tmp_path / "broken.py").write_text("raise OSError('no such model')")
    (tmp_path / "threaded.py").write_text(
        "import threading, time\nthreading.Thread(target=time.sleep, args=[60], daemon=True).start()\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with ForkServer([GESTURE, Forkable(("broken",), "broken:main")]) as server:
        assert server.targets == {GESTURE.target}
    with ForkServer([GESTURE, Forkable(("threaded",), "threaded:main")]) as server:
        assert server.targets == frozenset()


def test_who_is_told_to_stop_does_not_wait_for_imports(tmp_path, monkeypatch):
    (tmp_path / "endless.py").write_text("import time\ntime.sleep(60)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    began_s = time.monotonic()
    with ForkServer([Forkable(("endless",), "endless:main")], stopped=lambda: True) as server:
        assert server.targets == frozenset()
    assert time.monotonic() - began_s < 30


def test_the_router_and_all_stages_of_ours_are_forked():
    """None of their imports starts a thread: a process with threads must not be forked."""
    with ForkServer(Host(HostOptions(robot="r", stages=topics.STAGES)).forkables()) as server:
        assert len(server.targets) == 1 + len(topics.STAGES)
