"""The whole chain through a stock zenohd on each of two hosts, in place of our router, by TLS and the rules of the site."""

import json
import subprocess
import tempfile
from contextlib import ExitStack
from pathlib import Path

import pytest
from running import BIN, CLIP, POINTED_AT, ROOT, SITE, command, process, tail, wait_until
from site_made import add, make_site
from stock_zenohd import WHY_NO_ZENOHD, ZENOHD
from two_hosts import TwoHosts, assert_each_frame_crosses_once, missing_for_two_hosts

WHY_NOT = missing_for_two_hosts() or WHY_NO_ZENOHD
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)]

PATIENCE_S = 90.0
ROBOT = "zenohd-test"
ADDRESS = "10.77.0.2"
ON = {"camera": "robot", "tracker": "edge", "headpose": "edge", "gesture": "edge", "fusion": "edge"}
OF_CAMERA = ("--set", f"source={CLIP}", "--set", "loop=true", "--set", "encoding=bgr8")


class Chain:
    """A zenohd on each host, the stages as clients of theirs, and `deixis watch` on the edge."""

    def __init__(self, hosts, folder):
        self.hosts, self.folder = hosts, folder
        self._stack = ExitStack()

    def __enter__(self):
        # A socket's path is limited to about 100 bytes.
        self._sockets = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="zenohd-")))
        site = make_site(self._sockets / "site")
        robot, edge = add(site, f"robot:{ROBOT}").folder, add(site, "edge:pc", ADDRESS).folder
        self._run("robot", "zenohd-robot", self._zenohd("robot", robot, "-e", f"tls/{ADDRESS}:7447"))
        self._run("edge", "zenohd-edge", self._zenohd("edge", edge, "-l", "tls/0.0.0.0:7447"))
        for host in ("robot", "edge"):
            wait_until(self._socket(host).exists, f"a zenohd on {host}", PATIENCE_S, self.folder / f"zenohd-{host}")
        self._run("edge", "watch", self._client("edge", "deixis", "watch", "--json"))
        for stage, host in ON.items():
            more = {"camera": OF_CAMERA, "fusion": ("--set", f"registry={self.folder / 'pois.sqlite'}")}.get(stage, ())
            argv = self._client(host, f"deixis-{stage}", "--site", SITE, "--lockstep", *more)
            self._run(host, stage, argv)
        return self

    def __exit__(self, *_):
        self._stack.close()

    def said(self):
        """What every process has said."""
        return "\n".join(f"{file.name}:\n{tail(file)}" for file in sorted(self.folder.iterdir()))

    def heard(self, type_):
        """The messages of a type that came to `deixis watch`."""
        lines = (self.folder / "watch").read_text().splitlines(keepends=True)
        documents = [json.loads(line) for line in lines if line.startswith("{") and line.endswith("\n")]
        return [document["message"] for document in documents if document["type"] == type_]

    def _zenohd(self, host, certificates, *endpoints):
        """As docs/security.md says: our settings with the rules of the site in them."""
        argv = command("deixis", "certs", "zenohd", certificates, "--config", ROOT / "config" / f"{host}.json5")
        settings = self._sockets / f"{host}.json"
        settings.write_text(subprocess.run(argv, capture_output=True, text=True, check=True, timeout=60).stdout)
        return [ZENOHD, "-c", settings, "-l", self._endpoint(host), *endpoints]

    def _client(self, host, name, *arguments):
        return [BIN / name, *arguments, "--robot", ROBOT, "--connect", self._endpoint(host)]

    def _socket(self, host):
        return self._sockets / f"{host}.sock"

    def _endpoint(self, host):
        return f"unixsock-stream/{self._socket(host)}"

    def _run(self, host, name, argv):
        self._stack.enter_context(process(self.hosts.command(host, argv), self.folder / name))


@pytest.fixture(scope="module")
def chain(tmp_path_factory):
    with TwoHosts("robot", "edge") as hosts:
        hosts.link(delay_ms=2)
        with Chain(hosts, tmp_path_factory.mktemp("chain")) as it:
            yield it


def test_the_poi_is_named_across_two_hosts_with_a_stock_zenohd_and_the_rules_of_the_site_on_each(chain):
    def named():
        return any(answer["final"] and answer["poi_ids"] == [POINTED_AT] for answer in chain.heard("Target"))

    wait_until(named, f"{POINTED_AT} named on the edge; so far:\n{chain.said()}", PATIENCE_S)


def test_each_frame_crosses_the_link_once_though_two_stages_read_it(chain):
    def newest():
        belief = chain.heard("Belief")[-1]
        return belief["run"], belief["seq"]

    assert_each_frame_crosses_once(chain.hosts, newest)
