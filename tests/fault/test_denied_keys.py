"""Access control denies without a word; `deixis doctor` names the key that is published and does not come."""

import json

from deixis_cli.doctor import examine
from running import CLIP, SITE, answers, command, free_port, process, wait_until

PATIENCE_S = 60.0
ROBOT = "denied-test"


def settings_that_deny(key):
    """Settings of a router that keeps one key from all who come by TCP."""
    rule = {"id": "kept", "permission": "deny", "flows": ["egress"], "messages": ["put"], "key_exprs": [key]}
    return {
        "mode": "router",
        "access_control": {
            "enabled": True,
            "default_permission": "allow",
            "rules": [rule],
            "subjects": [{"id": "tcp", "link_protocols": ["tcp"]}],
            "policies": [{"rules": ["kept"], "subjects": ["tcp"]}],
        },
    }


def test_doctor_names_a_key_that_is_published_and_denied_to_us(tmp_path):
    endpoint, settings, log = f"tcp/127.0.0.1:{free_port()}", tmp_path / "router.json5", tmp_path / "log"
    settings.write_text(json.dumps(settings_that_deny(f"deixis/{ROBOT}/tracker/tracks")))
    options = ("--robot", ROBOT, "--site", SITE, "--only", "camera,tracker")
    camera = ("--set", f"camera.source={CLIP}", "--set", "camera.loop=true", "--set", "camera.rate_hz=5")
    argv = command("deixis", "up", *options, *camera, "--listen", endpoint, "--zenoh-config", settings)
    with process(argv, log):
        wait_until(lambda: "started, reached at" in log.read_text() and answers(endpoint), "the system", PATIENCE_S, log)

        def denied():
            return [found for found in examine(endpoint, ROBOT) if found.what.startswith("tracker/tracks: tracker publishes")]

        (found,) = wait_until(denied, "the key is named", PATIENCE_S, log)
        assert "and we hear none" in found.what
        assert found.advice == "access control on the way denies it to us; of no matter if that is meant"
