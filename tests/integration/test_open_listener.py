"""A listener that faces the network without TLS: commands and router refuse it in one sentence, unless --insecure is said."""

import subprocess
import sys

import pytest
from running import CLIP, command, free_port, process, wait_until

PATIENCE_S = 30.0
ROUTER = [sys.executable, "-m", "deixis_runtime.router"]


@pytest.mark.parametrize(
    ("argv", "status"),
    [
        (command("deixis", "up", "--robot", "r1", "--only", "gesture"), 1),
        (command("deixis", "run", CLIP, "--only", "camera"), 1),
        (ROUTER, 78),
    ],
    ids=["up", "run", "router"],
)
def test_an_open_listener_is_refused_in_one_sentence(argv, status):
    endpoint = f"tcp/0.0.0.0:{free_port()}"
    ended = subprocess.run([*argv, "--listen", endpoint], capture_output=True, text=True, timeout=60, check=False)
    assert ended.returncode == status
    (said,) = ended.stderr.strip().splitlines()
    assert f"refusing to listen on {endpoint}" in said
    assert "'deixis certs'" in said
    assert "--insecure" in said


def test_an_open_listener_that_is_meant_is_said_at_each_start(tmp_path):
    # Loopback by another name: the test opens nothing to the network, and the router cannot know where a name leads.
    endpoint, log = f"tcp/ip6-loopback.invalid:{free_port()}", tmp_path / "log"
    with process([*ROUTER, "--listen", f"unixsock-stream/{tmp_path}/s", "--listen", endpoint, "--insecure"], log):
        wait_until(lambda: f"insecure: whoever reaches {endpoint}" in log.read_text(), "the caution", PATIENCE_S, log)
