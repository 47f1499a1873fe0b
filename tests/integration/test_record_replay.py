"""A run is recorded, and its recording takes the place of some of its stages."""

import json
import subprocess

import pytest
from deixis_cli.mcap_file import McapReader
from deixis_schemas import topics
from running import SITE, SMALL_CLIP, SMALL_POINTED_AT, command, free_port, system

ALL_BUT_FUSION = "camera,tracker,headpose,gesture"


def deixis(*arguments, timeout=120):
    return subprocess.run(command("deixis", *arguments), capture_output=True, text=True, timeout=timeout, check=False)


def played(folder, *arguments):
    """A run or a replay in lockstep, with what it published but health by topic; its registry is its own."""
    registry = folder / "pois.sqlite"
    done = deixis(
        *arguments, "--lockstep", "--listen", f"tcp/127.0.0.1:{free_port()}", "--registry", registry, "--out", folder, "--json"
    )
    assert done.returncode == 0, done.stderr
    published = {}
    for line in next(folder.glob("*.jsonl")).read_text().splitlines():
        entry = json.loads(line)
        if entry["type"] not in ("Health", "Poi"):
            published.setdefault(entry["key"], []).append(entry["message"])
    return json.loads(done.stdout), published


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The small clip, played once: (its recording, what was published)."""
    folder = tmp_path_factory.mktemp("run")
    answers, published = played(folder, "run", SMALL_CLIP, "--site", SITE, "--pictures")
    assert [target["poi_ids"] for target in answers["answers"]] == [[SMALL_POINTED_AT]]
    return folder / f"{SMALL_CLIP.stem}.mcap", published


@pytest.mark.parametrize("spoken_for", ["camera", ALL_BUT_FUSION])
def test_the_same_recording_gives_the_same_outputs_whichever_stages_it_speaks_for(tmp_path, run, spoken_for):
    recording, published = run
    _, again = played(tmp_path, "replay", recording, "--site", SITE, "--as", spoken_for)
    assert again == published


def test_at_its_own_rate_a_recording_is_answered_like_the_camera_that_it_was(tmp_path, run, robot):
    registry = tmp_path / "pois.sqlite"
    done = deixis(
        *("replay", run[0], "--site", SITE, "--robot", robot, "--as", ALL_BUT_FUSION, "--expect", SMALL_POINTED_AT, "--json"),
        *("--listen", f"tcp/127.0.0.1:{free_port()}", "--registry", registry),
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)["answers"][0]
    assert answer["run"] != run[1]["deixis/demo/fusion/target"][-1]["run"], "who knows the recorded run would not begin anew"
    assert "replay-" in answer["evidence"][0]["producer"], "nobody takes a recording for the stage itself"


def test_a_running_system_is_recorded_with_what_was_said_before_and_with_pictures_or_without(tmp_path, robot):
    with system(tmp_path, robot) as running:
        running.wait_until(lambda: running.state().get("sources"), "fusion")
        for options, pictures in ([], True), (["--no-pictures"], False):
            path = tmp_path / f"{pictures}.mcap"
            done = deixis("record", path, "--robot", robot, "--connect", running.endpoint, "--seconds", "2.5", *options)
            assert done.returncode == 0, done.stderr
            messages = list(McapReader(path))
            heard = {topics.topic_of(message.key) for message in messages}
            assert {topics.CAMERA_INFO, topics.POI, topics.TRACKS, topics.BELIEF, topics.HEALTH} <= heard
            assert (topics.FRAME in heard) == pictures
            of_the_poi = {message.key for message in messages if message.key.endswith(SMALL_POINTED_AT)}
            assert of_the_poi, "the POIs were there before us"
        again = deixis("record", path, "--robot", robot, "--connect", running.endpoint, "--seconds", "1")
        assert again.returncode == 1
        assert "exists already" in again.stderr
        nobody = deixis("record", tmp_path / "none.mcap", "--robot", "x", "--connect", running.endpoint, "--seconds", "0.5")
        assert nobody.returncode == 1
        assert f"nothing was heard of robot 'x' at {running.endpoint}" in nobody.stderr
        assert not (tmp_path / "none.mcap").exists()
