"""Garbage on every key of the contract while the whole system runs: counted, named, and nothing dies."""

import json
import os
import random
import subprocess

import flooding
import msgpack
import pytest
import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import CameraInfo, Frame, Producer, Tracks
from deixis_schemas.topics import By
from running import SMALL_POINTED_AT, system

ROBOT = "garbage-test"
HEARD_BY = {  # the keys that stages listen to, and one stage that hears each
    "camera/frame": "tracker",
    "camera/info": "fusion",
    "tracker/tracks": "fusion",
    "headpose/poses": "fusion",
    "gesture/gestures": "fusion",
    "robot/pose": "fusion",
    "fusion/belief": "camera",
}
EVERY_KEY = [topic.key(ROBOT, stage=stage, id="garbage") for topic in topics.TOPICS for stage in topics.STAGES]
QUERYABLE = [topic.key(ROBOT, stage="tracker", id="garbage") for topic in topics.TOPICS if topic.queryable]
# On all keys together, for the suite's sake; DEIXIS_GARBAGE=1500000 puts as many on each of the fifteen.
FLOOD = int(os.environ.get("DEIXIS_GARBAGE", "100000"))
FLOOD_OF_GETS = 2_000
FRAME = Frame(stamp_ns=1, stage="camera", instance="x", run=1, seq=1, width=1, height=1, encoding="bgr8", data=b"abc")
NAN = float("nan")
NOT_NUMBERS = {  # a field of each type; the others ignore what they do not know
    "width": float("inf"),
    "x_m": NAN,
    "position_m": [NAN] * 3,
    "persons": [{"person_id": 0, "unknown": NAN}],
    "poses": [{"person_id": 0, "status": "tracking", "yaw_deg": NAN, "yaw_sigma_deg": 3.0}],
    "gestures": [{"person_id": 0, "phase": "stroke", "gesture": "none", "bearing_deg": NAN, "bearing_sigma_deg": 3.0}],
}
TRACKS = Tracks.derive(FRAME, Producer("tracker", "x"), width=1, height=1).model_dump()


def garbage(topic):
    """Payloads that break the contract of a topic, with their labels, by what is wrong with them."""
    label = codec.encoding_of(topic.type)
    noise = random.Random(topic.path)
    return {
        "random bytes": (noise.randbytes(2000), label),
        "nothing": (b"", label),
        "random bytes without a label": (noise.randbytes(2000), "zenoh/bytes"),
        "a version from the future": (msgpack.packb(TRACKS), f"{codec.MSGPACK};{topic.type.__name__}/99"),
        "the label of another type": (msgpack.packb(TRACKS), f"{codec.MSGPACK};Nothing/1"),
        "JSON": (json.dumps(TRACKS, default=str).encode(), codec.JSON),
        "JSON under the label of msgpack": (json.dumps(TRACKS, default=str).encode(), label),
        "msgpack cut short": (msgpack.packb({"seq": 1, "stamp_ns": 2, "data": b"x" * 100})[:-5], label),
        "a list": (msgpack.packb([1, 2, 3]), label),
        "a huge list": (msgpack.packb({"tracks": list(range(200_000)), "poses": list(range(200_000))}), label),
        "more bytes than allowed": (msgpack.packb({"seq": b"x" * (2 << 20)}), label),
        "nested without end": (b"\x91" * 5000, label),
        "positions that are not numbers": (
            msgpack.packb({**TRACKS, **NOT_NUMBERS}), label,
        ),
    }  # fmt: skip


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    with system(tmp_path_factory.mktemp("system"), ROBOT) as it:
        it.wait_until(lambda: it.state().get("recent_targets"), "an answer", 120)
        yield it


def counted(running, path):
    """(rejections, last error) of a key, as the stage that hears it says in its health."""
    inputs = running.health(HEARD_BY[path]).get("inputs", [])
    (entry,) = [item for item in inputs if item["key"] == running.key(path)]
    return entry["rejected"], entry["last_error"]


@pytest.mark.parametrize("path", HEARD_BY)
def test_garbage_on_a_key_is_counted_and_named_in_health(running, path):
    (topic,) = [topic for topic in topics.TOPICS if topic.path == path]
    assert counted(running, path)[0] == 0
    for number, (what, (payload, label)) in enumerate(garbage(topic).items(), start=1):
        # One at a time: of a key with room for the newest only, the one before would be overwritten unread.
        before = counted(running, path)[0]

        def refused(payload=payload, label=label, before=before):
            running.session.put(running.key(path), payload, encoding=label)
            return counted(running, path)[0] > before

        running.wait_until(refused, f"{what} on {path} counted as a rejection ({number})")
        assert counted(running, path)[1], what
    assert running.key(path) in running.log.read_text(), "the log names the key"


def test_garbage_on_the_keys_of_pois_is_refused_and_counted(running):
    before = running.state()["edits_rejected"]
    offers = garbage(topics.POI)
    for payload, label in offers.values():
        # Zenoh's default drops where a queue is full: on a busy machine one of them never arrived, and none is counted twice.
        block = zenoh.CongestionControl.BLOCK
        running.session.put(running.key("fusion/poi/garbage"), payload, encoding=label, congestion_control=block)
    state = running.wait_until(
        lambda: (state := running.state()).get("edits_rejected", 0) >= before + len(offers) and state, "all refused"
    )
    assert {edit["key"] for edit in state["rejected_edits"]} <= {
        running.key("fusion/poi/garbage"),
        running.key("fusion/poi/a/b"),
    }
    assert {poi["poi_id"] for poi in state["pois"]} == {f"P{number}" for number in range(1, 11)}


def test_garbage_on_keys_that_only_tools_hear_and_in_gets_disturbs_nobody(running):
    others = [topic for topic in topics.TOPICS if topic.path not in HEARD_BY and topic.by is not By.GET and topic != topics.POI]
    for topic in others:
        for payload, label in garbage(topic).values():
            running.session.put(topic.key(ROBOT, stage="tracker"), payload, encoding=label)
    for path in ("fusion/state", "camera/info", "tracker/health", "fusion/poi/P1"):
        for parameters in ("?format=xml", "?op=nonsense", "?format=json;op=put"):
            for _ in running.session.get(running.key(path) + parameters, payload=os.urandom(500), timeout=2.0):
                pass
    assert running.state()["pois"]


def test_a_lens_that_cannot_be_is_counted_by_those_who_read_it_and_named_in_the_log(running):
    lens = {"width": 640, "height": 480, "camera_matrix": (1.0, 0, 320, 0, 1.0, 240, 0, 0, 1)}
    info = CameraInfo(stamp_ns=1, stage="camera", instance="x", state="streaming", source="0", **lens)
    running.session.put(running.key("camera/info"), codec.encode(info), encoding=codec.encoding_of(CameraInfo))
    readers = ("fusion", "gesture", "headpose")
    for stage in readers:
        running.wait_until(lambda stage=stage: running.health(stage)["counters"].get("lenses_refused"), f"{stage} to count it")
    said = f"{running.key('camera/info')}: not used: camera/x: camera_matrix: a focal length of 1 pixels"
    running.wait_until(lambda: running.log.read_text().count(said) == len(readers), "each to say it")


def test_these_are_all_keys_that_stages_listen_to(running):
    heard = {item["key"] for stage in topics.STAGES for item in running.health(stage)["inputs"]}
    assert heard == {running.key(path) for path in HEARD_BY}


def flood(running, what, count, keys):
    argv = flooding.command(running.endpoint, what, count, *keys)
    done = subprocess.run(argv, capture_output=True, text=True, timeout=240 + FLOOD / 1000, check=True)
    return json.loads(done.stdout)


def test_a_hundred_thousand_payloads_of_garbage_on_all_keys_leave_memory_as_it_is_and_a_few_lines_in_the_log(running):
    before_mb = {stage: running.health(stage)["rss_mb"] for stage in topics.STAGES}
    pois, rejected = running.state()["pois"], running.state()["edits_rejected"]
    lines = len(running.log.read_text().splitlines())
    assert flood(running, "garbage", FLOOD, dict.fromkeys(EVERY_KEY)) == {"sent": FLOOD}
    state = running.wait_until(
        lambda: (state := running.state()).get("edits_rejected", 0) > rejected + 1000 and state, "refusals"
    )
    assert state["pois"] == pois
    for stage in topics.STAGES:
        running.wait_until(lambda stage=stage: running.health(stage), f"health of {stage}")
        assert running.health(stage)["rss_mb"] < before_mb[stage] + 15, stage
    said = [line for line in running.log.read_text().splitlines()[lines:] if "WARNING" in line]
    assert len(said) < 200 * max(1, FLOOD / 100_000), "said by key and cause, at intervals"


def test_thousands_of_gets_with_garbage_are_answered_or_refused_and_change_nothing(running):
    before = running.state()["pois"]
    became = flood(running, "garbage_gets", FLOOD_OF_GETS, QUERYABLE)
    assert sum(became.values()) == FLOOD_OF_GETS
    assert "timed out" not in became
    assert running.state()["pois"] == before


def test_afterwards_all_stages_still_run_and_the_poi_is_named(running):
    assert "starting it again" not in running.log.read_text(), "no stage died"
    known = {target["episode_id"] for target in running.state()["recent_targets"]}

    def named_anew():
        fresh = [target for target in running.state()["recent_targets"] if target["episode_id"] not in known]
        return any(target["poi_ids"] == [SMALL_POINTED_AT] for target in fresh)

    running.wait_until(named_anew, f"{SMALL_POINTED_AT} named again", 120)
