"""A supervisor tells a lost link and its own standstill from stages that hang: with real processes, and short patience."""

import os
import signal
import sys
import time

import cv2
import numpy as np
import pytest
from running import child_called, free_port, process, tail, wait_until

READY_S, SILENT_S, BLIND_S = 12.0, 4.0, 1.5
SUPERVISOR = f"""
import sys, time
from deixis_runtime.host import Host, HostOptions
from deixis_runtime.stage import setup_logging
from deixis_runtime.watchdog import Patience

robot, endpoint, pictures = sys.argv[1:]
sets = {{"camera": (f"source={{pictures}}", "loop=true", "rate_hz=5")}}
patience = Patience(ready_s={READY_S}, silent_s={SILENT_S}, blind_s={BLIND_S})
options = HostOptions(robot=robot, stages=("camera", "gesture"), listen=(endpoint,), sets=sets, patience=patience)
setup_logging()
with Host(options) as host:
    host.start()
    print("all are ready", file=sys.stderr, flush=True)
    while True:
        host.poll()
        time.sleep(0.05)
"""


@pytest.fixture
def supervised(tmp_path, robot):
    """A supervisor with camera and gesture, older than the time of a fresh start: (its process, its log)."""
    for index in range(5):
        cv2.imwrite(str(tmp_path / f"{index}.png"), np.full((72, 96, 3), 40 * index, np.uint8))
    endpoint, log = f"tcp/127.0.0.1:{free_port()}", tmp_path / "log"
    with process([sys.executable, "-c", SUPERVISOR, robot, endpoint, tmp_path], log) as child:
        wait_until(lambda: "all are ready" in log.read_text(), "all are ready", 30, log)
        time.sleep(READY_S + 0.5)
        yield child, log


def processes(supervisor):
    """Process numbers of the router and the stages."""
    words = {"router": "deixis_runtime.router", "camera": "deixis-camera", "gesture": "deixis-gesture"}
    return {name: child_called(supervisor.pid, word) for name, word in words.items()}


@pytest.mark.slow
def test_neither_a_crash_of_the_router_nor_a_standstill_kills_a_healthy_stage_and_a_hung_one_is_still_found(supervised):
    child, log = supervised
    before = processes(child)

    os.kill(before["router"], signal.SIGKILL)
    wait_until(lambda: processes(child)["router"] not in (None, before["router"]), "a new router", 20, log)
    time.sleep(SILENT_S + BLIND_S)
    assert "killing it" not in tail(log)

    child.send_signal(signal.SIGSTOP)
    time.sleep(SILENT_S + BLIND_S)
    child.send_signal(signal.SIGCONT)
    time.sleep(SILENT_S)
    assert "killing it" not in tail(log)
    assert processes(child) == before | {"router": processes(child)["router"]}

    os.kill(before["gesture"], signal.SIGSTOP)
    wait_until(lambda: "gesture gives no heartbeat for 4 s; killing it" in tail(log), "the hung one is found", 20, log)
    assert "camera gives" not in tail(log)
