"""The fusion stage as a process behind a real router: edits, kill -9, silent and garbled neighbours."""

from __future__ import annotations

import json
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from deixis_schemas import codec, topics
from deixis_schemas.messages import HeadPoses, Poi, RobotPose
from fusion_bench import Bench, camera_info, fusion_bench, of_frame, router, show, source, wait_until


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    """Endpoint of a router on loopback."""
    with router() as it:
        yield it


@pytest.fixture
def bench(endpoint: str, tmp_path: Path) -> Iterator[Bench]:
    with fusion_bench(endpoint, tmp_path) as it:
        yield it


def edit_until_killed(bench: Bench, numbers: Iterator[int]) -> dict[str, float]:
    """Edits, one after the other, until the stage dies of SIGKILL; the last x of each POI that was acknowledged."""
    acknowledged: dict[str, float] = {}
    assert bench.process is not None
    killer = threading.Timer(0.4, bench.process.kill)
    killer.start()
    while bench.process.poll() is None:
        x = float(next(numbers))
        at = {"position_m": [x, 0, 0]}
        if x % 2:
            pois, replies = [f"p{x % 24:.0f}"], bench.replies(f"fusion/poi/p{x % 24:.0f}", json.dumps(at).encode(), codec.JSON)
        else:
            pois = ["left", "right"]
            both = json.dumps(dict.fromkeys(pois, at)).encode()
            replies = bench.replies("fusion/poi/*?op=put_all", both, codec.JSON)
        if any(reply.ok is not None for reply in replies):
            acknowledged |= dict.fromkeys(pois, x)
    killer.join()
    assert bench.process.wait(10) == -signal.SIGKILL
    return acknowledged


def test_no_acknowledged_edit_is_lost_and_none_is_half_made_when_the_stage_is_killed_in_the_middle(bench: Bench) -> None:
    numbers = iter(range(1_000_000))
    acknowledged: dict[str, float] = {}
    for _ in range(3):
        bench.start()
        taken = edit_until_killed(bench, numbers)
        assert len(taken) > 2
        acknowledged |= taken
    bench.start()
    stored = {poi.poi_id: poi.position_m[0] for poi in bench.state("?top=1024").pois}
    assert stored["left"] == stored["right"]
    assert all(stored[poi_id] >= x for poi_id, x in acknowledged.items())
    # Killed between commit and acknowledgement, it is ahead of what it said: by one edit of each life.
    assert len({stored[poi_id] for poi_id in stored if stored[poi_id] != acknowledged.get(poi_id)}) <= 3
    assert bench.stop() == 0


def test_a_corrupt_registry_is_set_aside_said_so_and_its_last_good_copy_used(bench: Bench) -> None:
    assert bench.registry is not None
    bench.start()
    assert bench.ask("fusion/poi/vase?by=anna", {"position_m": [1, 2, 3]}) is not None
    assert bench.stop() == 0
    bench.registry.write_bytes(b"damaged " * 4000)
    bench.start()
    assert [(poi.poi_id, poi.edited_by) for poi in bench.state().pois] == [("vase", "anna")]
    notes = bench.health().notes
    assert any("is corrupt" in note and "pois.sqlite.corrupt-1" in note and "1 POIs of" in note for note in notes)
    assert bench.stop() == 0


def test_edits_are_answered_or_refused_with_the_fields_name_and_seen_in_state(bench: Bench) -> None:
    bench.start()
    stored = bench.ask("fusion/poi/vase", {"position_m": [1, 2, 3]})
    assert stored is not None
    assert stored[0] == "ok"
    assert bench.ask("fusion/poi/vase", {"position_m": [1, 2, "x"]}) == (
        "refused", "position_m.2: Input should be a valid number, unable to parse string as a number",
    )  # fmt: skip
    assert bench.ask("fusion/poi/ghost?op=delete") == ("refused", "poi_id: there is no POI 'ghost'")
    bench.session.put(f"deixis/{bench.robot}/fusion/poi/door", b'{"position_m": [4, 5, 6]}')
    bench.session.put(f"deixis/{bench.robot}/fusion/poi/bad", b'{"position_m": 4}')
    bench.session.put(f"deixis/{bench.robot}/fusion/poi/x/fusion/poi/vase", b'{"position_m": [9, 9, 9]}')
    no_poi = ("refused", f"key: 'deixis/{bench.robot}/fusion/poi/vase/x' names no single POI")
    assert bench.ask("fusion/poi/vase/x", {"position_m": [9, 9, 9]}) == no_poi
    bench.session.delete(f"deixis/{bench.robot}/fusion/poi/vase/x")
    bench.session.put(f"deixis/{bench.robot}/fusion/poi", b'{"position_m": [9, 9, 9]}')
    wait_until(lambda: bench.state().edits_rejected == 7, "seven refused edits")
    state = bench.state()
    assert [(poi.poi_id, poi.position_m) for poi in state.pois] == [("door", (4, 5, 6)), ("vase", (1, 2, 3))]
    assert any(edit.key.endswith("/bad") and edit.reason.startswith("position_m") for edit in state.rejected_edits)
    keys = sorted(str(r.ok.key_expr).rsplit("/", 1)[1] for r in bench.replies("fusion/poi/**?format=json") if r.ok is not None)
    assert keys == ["door", "vase"]
    bench.session.delete(f"deixis/{bench.robot}/fusion/poi/door")
    wait_until(lambda: [poi.poi_id for poi in bench.state().pois] == ["vase"], "the delete")
    assert bench.stop() == 0


def test_every_edit_of_a_burst_is_stored_in_one_go(bench: Bench) -> None:
    bench.start()
    for i in range(300):
        bench.session.put(f"deixis/{bench.robot}/fusion/poi/p{i}", json.dumps({"position_m": [i, 0, 0]}).encode())
    wait_until(lambda: bench.state().edits_accepted + bench.state().edits_lost >= 300, "300 edits stored or counted")
    state = bench.state("?top=1024")
    assert (state.edits_accepted, state.edits_rejected, state.edits_lost, state.pois_total) == (300, 0, 0, 300)
    assert len(bench.state().pois) == 16
    assert len(bench.replies("fusion/poi/**")) == 300
    assert bench.stop() == 0
    bench.start()
    assert bench.state().pois_total == 300


def test_who_watches_the_pois_hears_each_edit_once(bench: Bench) -> None:
    bench.start()
    heard: list[tuple[str, str]] = []
    watcher = bench.session.declare_subscriber(
        f"deixis/{bench.robot}/fusion/poi/**",
        lambda sample: heard.append((str(sample.key_expr).rsplit("/", 1)[1], str(sample.kind).rsplit(".", maxsplit=1)[-1])),
    )
    bench.ask("fusion/poi/vase", {"position_m": [1, 2, 3]})
    bench.session.put(f"deixis/{bench.robot}/fusion/poi/door", b'{"position_m": [4, 5, 6]}')
    wait_until(lambda: bench.state().edits_accepted == 2, "the put")
    bench.ask("fusion/poi/vase", {"position_m": [1, 2, "x"]})
    bench.ask("fusion/poi/vase?op=delete")
    wait_until(lambda: len(heard) >= 3, "three edits heard")
    time.sleep(0.3)
    assert heard == [("vase", "PUT"), ("door", "PUT"), ("vase", "DELETE")]
    state = bench.state()
    assert (state.edits_accepted, state.edits_rejected) == (3, 1)
    watcher.undeclare()


def test_the_state_answers_as_long_as_it_is_asked_for(bench: Bench) -> None:
    bench.start()
    for i in range(20):
        bench.session.put(f"deixis/{bench.robot}/fusion/poi/p{i:02}", json.dumps({"position_m": [i, 0, 0]}).encode())
    wait_until(lambda: bench.state().pois_total == 20, "20 POIs")
    assert (len(bench.state().pois), len(bench.state("?top=20;format=msgpack").pois)) == (16, 20)
    assert [poi.poi_id for poi in bench.state("?poi=p19").pois] == ["p19"]
    assert bench.ask("fusion/state?top=0") == ("refused", "top: '0' is not a whole number from 1 to 1024")
    assert bench.ask("fusion/state?poi=ghost") == ("refused", "poi: there is no POI 'ghost'")


def test_an_old_pose_of_the_robot_is_said_in_state_and_health(bench: Bench) -> None:
    # Wide limits, so that a busy machine does not make a fresh pose old.
    bench.start("--set", "place.robot_pose_max_age_s=60")
    bench.put(topics.CAMERA_INFO, camera_info())
    content = {"stage": "robot", "instance": "r", "stamp_ns": time.time_ns(), "x_m": 0, "y_m": 0, "yaw_deg": 0}
    bench.put(topics.ROBOT_POSE, RobotPose.model_validate(content))
    wait_until(lambda: bench.state().robot_pose, "the robot's pose")
    show(bench, 1)
    assert source("ok", "robot")(bench.state())
    bench.put(topics.ROBOT_POSE, RobotPose.model_validate(content | {"stamp_ns": time.time_ns() - 120 * 10**9}))
    wait_until(lambda: source("ok", "robot")(bench.state()) and bench.state().sources[-1].received == 2, "the old pose")
    show(bench, 2)
    wait_until(lambda: source("late", "robot")(bench.state()), "an old pose in the state")
    assert any("s older than the frame" in note for note in bench.health().notes)
    assert bench.beliefs[-1].persons[0].evidence[2].source == "robot"


def test_a_stage_that_is_killed_leaves_no_folder_behind(bench: Bench, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (temporary := tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    bench.registry = None
    bench.start()
    assert bench.state().registry_path == ":memory:"
    bench.stop(signal.SIGKILL)
    assert list(temporary.iterdir()) == []


def test_two_stages_on_one_registry_file_the_second_exits_with_one_clear_error(bench: Bench) -> None:
    bench.start()
    second = subprocess.run(bench.command(), capture_output=True, text=True, timeout=20, check=False)
    assert second.returncode == 78
    assert "is locked by another process" in second.stderr
    assert "Traceback" not in second.stderr


def test_a_frame_is_answered_without_a_silent_stage_and_the_episode_ends_with_the_source(bench: Bench) -> None:
    bench.start()
    bench.put(topics.CAMERA_INFO, camera_info())
    # 2 m ahead of the robot stands the person; 60 degrees to the person's left, 2 m away, the vase.
    bench.ask("fusion/poi/vase", {"position_m": [1.0, -1.73, 1.3]})
    bench.ask("fusion/poi/door", {"position_m": [1.0, 1.73, 1.3]})
    for seq in range(20):
        show(bench, seq)
        time.sleep(0.02)
    assert bench.beliefs[-1].missing == []
    (person,) = bench.beliefs[-1].persons
    assert {e.source: (e.producer, e.status) for e in person.evidence} == {
        "gesture": ("gesture/x", "ok"), "headpose": ("headpose/x", "ok"),
    }  # fmt: skip
    bench.put(topics.CAMERA_INFO, camera_info("ended", 19))
    wait_until(lambda: [t for t in bench.targets if t.final], "the final target")
    (final,) = [target for target in bench.targets if target.final]
    assert final.poi_ids == ["vase"]
    assert [target.episode_id for target in bench.state().recent_targets] == [final.episode_id]
    show(bench, 30, head=False)
    assert bench.beliefs[-1].missing == ["headpose"]
    said = next(e for e in bench.beliefs[-1].persons[0].evidence if e.source == "headpose")
    assert (said.status in ("late", "dead"), said.weight) == (True, 0.0)


def test_garbage_on_every_key_is_counted_and_the_stage_goes_on(bench: Bench) -> None:
    bench.start()
    bench.put(topics.CAMERA_INFO, camera_info())
    for topic in (topics.TRACKS, topics.GESTURES, topics.CAMERA_INFO, topics.ROBOT_POSE):
        for payload in (b"", b"\x00\xff garbage", b"\x80"):
            bench.session.put(topic.key(bench.robot), payload, encoding=codec.encoding_of(topic.type))
    bench.session.put(topics.HEAD_POSES.key(bench.robot), b"\x80", encoding=f"{codec.MSGPACK};HeadPoses/9")
    wait_until(lambda: source("wrong_version", "headpose")(bench.state()), "headpose's wrong version in the state")
    show(bench, 1)
    wait_until(lambda: source("ok", "headpose")(bench.state()), "headpose being well again")
    rejected = {s.stage: s.rejected for s in bench.state().sources}
    assert rejected["tracker"] >= 1
    assert rejected["headpose"] == 1
    assert bench.process is not None
    assert bench.process.poll() is None


def test_two_producers_on_one_key_are_noticed_and_said(bench: Bench) -> None:
    bench.start()
    for _ in range(3):
        for instance in ("one", "two"):
            content = of_frame("headpose", 1, time.time_ns()) | {"instance": instance}
            bench.put(topics.HEAD_POSES, HeadPoses.model_validate(content))
    wait_until(lambda: any("2 producers" in s.reason for s in bench.state().sources), "two producers in the state")
    heads = next(s for s in bench.state().sources if s.stage == "headpose")
    assert heads.producers == ["headpose/one", "headpose/two"]


def test_the_site_file_gives_the_first_pois_and_a_bad_setting_is_named(bench: Bench, tmp_path: Path) -> None:
    site = tmp_path / "site.yaml"
    site.write_text("pois:\n  - {poi_id: vase, position_m: [1, 2, 3]}\n")
    bench.start("--site", str(site))
    assert [poi.poi_id for poi in bench.state().pois] == ["vase"]
    assert isinstance(bench.state().pois[0], Poi)
    bench.stop()
    bad = subprocess.run(
        bench.command("--set", "hand.sigma_floor_deg=900"), capture_output=True, text=True, timeout=20, check=False
    )
    assert bad.returncode == 78
    assert "hand.sigma_floor_deg" in bad.stderr
