"""A router whose link is cut goes on between its own clients, also when frames that nobody takes any more fill the link."""

import sys
import time
from pathlib import Path

import pytest
from running import CLIP, SITE, wait_until
from two_hosts import TwoHosts, missing_for_two_hosts

WHY_NOT = missing_for_two_hosts()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)]

BENCH = str(Path(__file__).parents[2] / "bench")
# A camera that does not adapt: 137 kB a frame, 10 a second.
CAMERA = {"quality": 100, "rate_hz": 10}
CUT_S = 8.0
LONGEST_SILENCE_S = 3.5
PATIENCE_S = 60.0


@pytest.fixture
def two(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(BENCH)
    from link import Heard
    from link_layouts import Layout

    with TwoHosts("robot", "edge") as hosts, Layout("fixed", hosts, tmp_path, CLIP, SITE, CAMERA) as layout:
        yield hosts, layout, Heard(layout.heard["robot"]), Heard(layout.heard["edge"])
    for name in ("link", "link_layouts", "link_listener", "peer_stage"):
        sys.modules.pop(name, None)


def test_a_cut_link_does_not_keep_the_robots_own_processes_from_hearing_each_other(two):
    """Zenoh's router was deaf to all its clients for 10 s then, and its supervisor killed the camera as hung."""
    hosts, layout, at_robot, at_edge = two
    wait_until(at_edge.beliefs, "a belief", PATIENCE_S, layout.folder / "robot.log")
    hosts.link(rate_mbit=8.0)
    full = hosts.statistics.bytes + 4_000_000
    wait_until(lambda: hosts.statistics.bytes > full, "a link that has been full for seconds", PATIENCE_S)
    hosts.cut()
    cut_s = time.time()

    def last_heard_s():
        return max((line["at_s"] for line in at_robot.read() if line["type"] == "Health"), default=cut_s)

    longest_s = 0.0
    while time.time() - cut_s < CUT_S:
        longest_s = max(longest_s, time.time() - max(cut_s, last_heard_s()))
        time.sleep(0.1)
    assert longest_s < LONGEST_SILENCE_S, "the camera's health comes once a second"
    assert "killing it" not in layout.log("robot", whole=True)
