"""A robot with a camera and an edge with everything else: one router on each, and a link between them.

The clip is played in lockstep, so that a busy machine plays it slowly and drops nothing.
"""

import json
import signal
from contextlib import ExitStack

import pytest
from running import CLIP, POINTED_AT, ROOT, SITE, command, tail, wait_until
from site_made import add, make_site
from two_hosts import TwoHosts, assert_each_frame_crosses_once, missing_for_two_hosts

WHY_NOT = missing_for_two_hosts()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)]

PATIENCE_S = 90.0
ADDRESS = "10.77.0.2"
EDGE, GUARDED_EDGE = f"tcp/{ADDRESS}:7447", f"tls/{ADDRESS}:7448"
# Answers and tracks have a connection of their own, so that they do not queue behind frames.
TWO_LINKS = tuple(part for prio in ("1-4", "5-7") for part in ("--connect", f"{GUARDED_EDGE}?prio={prio}#so_sndbuf=65536"))


class RobotAndEdge:
    """`deixis up` on two hosts, and `deixis watch` on the edge. What they say lies in `folder`."""

    def __init__(self, hosts, folder, robot):
        self.hosts, self.folder, self.robot = hosts, folder, robot
        self._processes = []
        self._watched = folder / "watch"
        self._open = ExitStack()

    def start(self, encoding, connect, listen):
        """The robot first: it has to wait for the edge."""
        camera = {"source": CLIP, "loop": "true", "encoding": encoding}
        sets = [part for name, value in camera.items() for part in ("--set", f"camera.{name}={value}")]
        config = ROOT / "config"
        self._up("robot", "--only", "camera", *connect, "--zenoh-config", config / "robot.json5", *sets)
        registry = ["--registry", self.folder / "pois.sqlite"]
        self._up("edge", "--except", "camera", *listen, "--zenoh-config", config / "edge.json5", *registry)
        wait_until(lambda: "started, reached at" in tail(self.folder / "edge"), "the edge", PATIENCE_S, self.folder / "edge")
        self._start("edge", "watch", command("deixis", "watch", "--robot", self.robot, "--json"))

    def answers(self):
        """Final answers so far."""
        return [message for message in self._heard("Target") if message["final"]]

    def newest_frame(self):
        """Run and seq of the newest frame that was answered."""
        belief = self._heard("Belief")[-1]
        return belief["run"], belief["seq"]

    def _heard(self, type_):
        heard = [json.loads(line) for line in self._watched.read_text().splitlines(keepends=True) if line.endswith("\n")]
        return [line["message"] for line in heard if line["type"] == type_]

    def wait_for_right_answer(self, after=0):
        """Wait for an answer beyond the first `after` that names the POI."""

        def named():
            return any(answer["poi_ids"] == [POINTED_AT] for answer in self.answers()[after:])

        said = "\n".join(tail(self.folder / host) for host in ("robot", "edge"))
        wait_until(named, f"{POINTED_AT} named on the edge; so far {self.answers()}\n{said}", PATIENCE_S)

    def stop(self):
        for process in reversed(self._processes):
            process.send_signal(signal.SIGTERM)
        statuses = [process.wait(30) for process in self._processes]
        self._open.close()
        return statuses

    def _up(self, host, *arguments):
        self._start(host, host, command("deixis", "up", "--robot", self.robot, "--site", SITE, "--lockstep", *arguments))

    def _start(self, host, name, argv):
        out = self._open.enter_context((self.folder / name).open("ab"))
        errors = self._open.enter_context((self.folder / f"{name}.err").open("ab")) if name == "watch" else out
        self._processes.append(self.hosts.popen(host, argv, stdout=out, stderr=errors))


@pytest.fixture
def hosts():
    with TwoHosts("robot", "edge") as two:
        yield two


@pytest.fixture
def pair(hosts, tmp_path, robot):
    two = RobotAndEdge(hosts, tmp_path, robot)
    yield two
    assert two.stop() == [0, 0, 0], "robot, edge and watch stop in good order"


def test_the_poi_is_named_across_the_link_and_each_frame_crosses_it_once(hosts, pair):
    hosts.link(delay_ms=5, jitter_ms=2)
    pair.start("bgr8", ("--connect", EDGE), ("--listen", "tcp/0.0.0.0:7447", "--insecure"))
    pair.wait_for_right_answer()
    assert_each_frame_crosses_once(hosts, pair.newest_frame)


def test_the_poi_is_named_by_mutual_tls_and_again_after_the_link_was_cut(hosts, pair, robot, tmp_path):
    hosts.link(delay_ms=5, jitter_ms=2)
    site = make_site(tmp_path / "site")
    robots, edges = add(site, f"robot:{robot}"), add(site, "edge:e1", ADDRESS)
    listen = ("--listen", "tcp/127.0.0.1:7447", "--listen", "tls/0.0.0.0:7448", "--certs", edges.folder)
    pair.start("jpeg", (*TWO_LINKS, "--certs", robots.folder), listen)
    pair.wait_for_right_answer()

    hosts.cut()
    log = pair.folder / "robot"
    wait_until(lambda: "no link yet" in log.read_text(), "the robot's router notices the cut", 20, log)
    before = len(pair.answers())
    hosts.restore()

    pair.wait_for_right_answer(after=before)
