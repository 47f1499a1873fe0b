"""docs/tutorial.md does what it says, word for word and in its order, but for the ports and the first command."""

import os
import re
import subprocess

from running import ROOT, free_port

PAGE = (ROOT / "docs" / "tutorial.md").read_text()
EDGE_PORT = "7448"
ROBOT_UP = "--only camera"
DOCTOR = "deixis doctor --robot r1 --connect tls/127.0.0.1:7448"


def as_script(edge_port, robot_port, alone_port):
    """The tutorial's commands as one script, on ports that are free."""
    blocks = re.findall(r"^```sh\n(.*?)^```$", PAGE, re.DOTALL | re.MULTILINE)
    assert blocks[0] == "make demo\n"
    # What a failed command leaves running is ended with the script.
    text = "\n".join(["set -euo pipefail", "trap 'kill $(jobs -p) 2>/dev/null || true' EXIT", *blocks[1:]])
    # A busy machine is slow, which the doctor finds wrong.
    for said, done in (
        (ROBOT_UP, f"{ROBOT_UP} --listen tcp/127.0.0.1:{robot_port}"),
        (DOCTOR, f"{DOCTOR} || [ $? = 1 ]"),
        ("--lockstep --expect", f"--lockstep --listen tcp/127.0.0.1:{alone_port} --expect"),
        (EDGE_PORT, str(edge_port)),
    ):
        assert said in text, said
        text = text.replace(said, done)
    return text


def test_the_tutorial_leads_from_nothing_to_a_robot_and_an_edge_pc(tmp_path):
    for name in ("examples", ".venv"):
        (tmp_path / name).symlink_to(ROOT / name)
    environment = {**os.environ, "HOME": str(tmp_path), "XDG_STATE_HOME": str(tmp_path / "state"), "COLUMNS": "200"}
    environment.pop("DEIXIS_CERTS", None)
    done = subprocess.run(
        ["bash", "-c", as_script(free_port(), free_port(), free_port())],
        cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=240, check=False,
    )  # fmt: skip
    said = done.stdout + done.stderr
    assert done.returncode == 0, said[-4000:]
    assert said.count("Person 0 points at: the ship model (ship)") == 2, "once on one machine, once between two hosts"
    assert re.search(r"^lamp .*the lamp$", done.stdout, re.MULTILINE), "the POI that was added is listed"
    assert re.search(r"^ok .*the router at tls/127.0.0.1:\d+ answers$", done.stdout, re.MULTILINE)
    assert re.search(r"visit\.mcap: .*fusion/belief \d+", said), "the recording holds answers"
