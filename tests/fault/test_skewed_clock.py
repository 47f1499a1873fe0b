"""A camera on a host whose clock is minutes off and is set while it runs: answers as before, and the skew is said."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from deixis_cli.checks import CLOCK_ADVICE
from deixis_runtime.session import open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import Target
from held_link import HeldLink
from running import CLIP, POINTED_AT, ROOT, SITE, System, answers, command, free_port, process, wait_until

ROBOT = "skewed-clock"
AHEAD_S, BEHIND_S = 300.0, -420.0
# Slow enough for a busy machine to keep up: what it drops is of no matter here, but has to be no reason for no answer.
RATE_HZ = 10
PATIENCE_S = 60.0


@dataclass(frozen=True)
class SkewedSystem(System):
    """The system, the link to its camera's host, and the clock there."""

    link: HeldLink

    def set_clock(self, ahead_s):
        """Set that clock so far ahead of the true time, seconds."""
        new = self.log.parent / "new"
        new.write_text(str(ahead_s))
        new.rename(self.log.parent / "ahead")

    @contextmanager
    def answers_from_now(self):
        """Final answers that come from now on, a list that grows."""
        heard = []

        def hear(sample):
            target = codec.decode(Target, sample.payload.to_bytes(), str(sample.encoding))
            if target.final:
                heard.append(target)

        subscriber = self.session.declare_subscriber(self.key(topics.TARGET.path), hear)
        yield heard
        subscriber.undeclare()

    def clock_as_seen_by_fusion(self):
        """(seconds ahead, by how much that may be wrong) of the camera's clock; none while it is not known."""
        clocks = self.health("fusion").get("clocks", [])
        return next(((clock["ahead_s"], clock["uncertain_s"]) for clock in clocks if clock["stage"] == "camera"), None)


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    folder, port = tmp_path_factory.mktemp("skewed"), free_port()
    endpoint = f"tcp/127.0.0.1:{port}"
    (folder / "ahead").write_text(str(AHEAD_S))
    edge = command("deixis", "up", "--except", "camera", "--robot", ROBOT, "--site", SITE, "--listen", endpoint)
    settings = {"source": CLIP, "loop": "true", "rate_hz": RATE_HZ, "encoding": "jpeg", "adapt": "false"}
    camera = [sys.executable, ROOT / "tests" / "skewed_clock.py", folder / "ahead", "deixis_camera.service"]
    with process([*edge, "--registry", folder / "pois.sqlite"], folder / "log") as child:
        wait_until(lambda: child.poll() is not None or answers(endpoint), "a router", PATIENCE_S, folder / "log")
        with HeldLink(port) as link, open_client(endpoint, shared_memory=False) as session:
            camera += ["--robot", ROBOT, "--connect", f"tcp/127.0.0.1:{link.port}", "--site", SITE]
            camera += [part for name, value in settings.items() for part in ("--set", f"{name}={value}")]
            with process(camera, folder / "camera"):
                yield SkewedSystem(ROBOT, endpoint, session, child, folder / "log", link)


def assert_named(running, answers):
    right = running.wait_until(
        lambda: [answer for answer in answers if answer.poi_ids == [POINTED_AT]], "the answer", PATIENCE_S
    )
    assert 0 <= right[0].latency_ms < 5000, "by one clock, not by the difference of two"


def doctor(running):
    argv = command("deixis", "doctor", "--robot", ROBOT, "--connect", running.endpoint, "--json")
    done = subprocess.run(argv, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    return json.loads(done.stdout)["findings"]


def assert_skew_is_said(running, ahead_s, in_words):
    def known():
        clock = running.clock_as_seen_by_fusion()
        return clock is not None and abs(clock[0] - ahead_s) <= clock[1] + 0.05

    running.wait_until(known, f"fusion to know that the camera's clock is {ahead_s:g} s ahead")
    pattern = rf"the clock of host \S+ \(camera\) is {in_words} that of host \S+"
    running.wait_until(
        lambda: any(re.search(pattern, note) for note in running.health("fusion").get("notes", ())), "health to say it"
    )
    found = [finding for finding in doctor(running) if re.search(pattern, finding["what"])]
    assert [finding["advice"] for finding in found if finding["level"] == "wrong"] == [CLOCK_ADVICE]


def test_a_camera_whose_clock_is_five_minutes_ahead_gives_answers_and_the_skew_is_said_in_health_and_by_doctor(running):
    with running.answers_from_now() as heard:
        assert_named(running, heard)
    assert_skew_is_said(running, AHEAD_S, r"5 min 0 s ahead of")
    assert "(camera) is 5 min 0 s ahead of" in running.log.read_text()


def published_by_tracker(running):
    health = running.wait_until(lambda: running.health("tracker"), "health of the tracker")
    return next(item["published"] for item in health["outputs"] if item["key"] == running.key(topics.TRACKS.path))


def test_a_clock_that_is_set_back_by_twelve_minutes_stops_no_answers_and_the_new_skew_is_said(running):
    frames = published_by_tracker(running)
    running.set_clock(BEHIND_S)
    running.wait_until(lambda: published_by_tracker(running) > frames + 2 * RATE_HZ, "frames go on")
    assert_skew_is_said(running, BEHIND_S, r"7 min 0 s behind")
    with running.answers_from_now() as heard:  # until the clocks are compared again, a second or two, a latency may be wrong
        assert_named(running, heard)


def too_old(running, stage):
    return sum(item["too_old"] for item in running.health(stage).get("inputs", []))


def test_what_waited_longer_than_the_age_limit_is_dropped_by_a_skewed_clock_as_by_a_true_one(running):
    before = too_old(running, "tracker")

    def dropped():
        # For less than the lease, so that the session stands.
        running.link.hold_for(1.6)
        deadline = time.monotonic() + 2
        while too_old(running, "tracker") == before and time.monotonic() < deadline:
            time.sleep(0.1)
        return too_old(running, "tracker") > before

    running.wait_until(dropped, "frames dropped for their age")
    with running.answers_from_now() as heard:
        assert_named(running, heard)
