"""Generic Zenoh clients read and edit a running system: the third-party zenoh-cli, in an environment of its own.

zenoh-cli exits 0 whatever is answered, so these tests look at what it prints.
"""

import json
import subprocess
import sys
import venv

import pytest
from deixis_schemas import topics
from running import ROOT, get_json, system

ROBOT = "zenoh-cli-test"
STAGES = {"camera", "tracker", "headpose", "gesture", "fusion"}
VASE = {"name": "a second vase", "position_m": [3.0, 1.0, 1.2], "extent_m": 0.3}


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """`zenoh` of zenoh-cli, with deixis-schemas beside it and nothing else of ours."""
    folder = tmp_path_factory.mktemp("zenoh-cli")
    # By our own pip: to give the environment one, and that one what builds ours, takes longer than all the rest.
    venv.create(folder)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", folder / "bin" / "python"]
    ours = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--quiet",
        "--no-build-isolation",
        "--no-deps",
        "-w",
        folder,
        ROOT / "schemas",
    ]
    assert subprocess.run(ours, timeout=120, check=False).returncode == 0
    (wheel,) = folder.glob("deixis_schemas-*.whl")
    # zenoh-cli by itself pulls matplotlib too, which only its drawing of networks uses.
    for what in (["eclipse-zenoh", "parse", "networkx", wheel], ["--no-deps", "zenoh-cli"]):
        install = [*pip, "install", "--quiet", "--no-compile", "--retries", "1", "-c", ROOT / "constraints.txt", *what]
        made = subprocess.run(install, capture_output=True, text=True, timeout=300, check=False)
        if "No matching distribution found" in made.stderr or "Failed to establish a new connection" in made.stderr:
            pytest.skip(f"no package index is reached: {made.stderr.strip().splitlines()[-1]}")
        assert made.returncode == 0, made.stderr
    return folder / "bin" / "zenoh"


@pytest.fixture(scope="module")
def running(tmp_path_factory):
    """The small clip played again and again through all stages."""
    with system(tmp_path_factory.mktemp("system"), ROBOT) as it:
        it.wait_until(lambda: it.state().get("recent_targets"), "an answer", 60)
        yield it


@pytest.fixture
def argv(program, running):
    """zenoh-cli as it is started against the system; its subcommand follows."""
    return [program, "--mode", "client", "--connect", running.endpoint, "--cfg", "scouting/multicast/enabled:false"]


@pytest.fixture
def zenoh(argv):
    """Runs zenoh-cli; gives (what it printed, what it complained of)."""

    def run(*arguments):
        done = subprocess.run([*argv, *arguments], capture_output=True, text=True, timeout=30, check=False)
        return done.stdout, done.stderr

    return run


def lines(text):
    return [json.loads(line) for line in text.splitlines()]


@pytest.mark.parametrize("decoder", ["json", "deixis"])
class TestGetting:
    @pytest.fixture
    def get(self, zenoh, running, decoder):
        """Documents under a key, in the form that the decoder is for."""

        def run(path):
            printed, complaints = zenoh(
                "get", "-s", running.key(path) + "?format=json" * (decoder == "json"), "--decoder", decoder
            )
            assert "ERROR" not in complaints, complaints
            return lines(printed)

        return run

    def test_state_says_what_fusion_knows_and_who_told_it(self, get):
        (state,) = get("fusion/state")
        assert state["robot"] == ROBOT
        producers = {source["stage"]: source["producers"] for source in state["sources"]}
        assert {stage: producers[stage] for stage in ("tracker", "headpose", "gesture")} == {
            stage: [f"{stage}/lockstep"] for stage in ("tracker", "headpose", "gesture")
        }
        assert state["recent_targets"][0]["final"] is True

    def test_every_poi_is_answered_under_its_own_key(self, get):
        assert {poi["poi_id"] for poi in get("fusion/poi/**")} >= {f"P{number}" for number in range(1, 11)}

    def test_camera_info_has_the_calibration(self, get):
        (info,) = get("camera/info")
        assert (info["width"], info["height"], info["state"]) == (320, 240, "streaming")
        assert info["camera_matrix"][0] == 280.0

    def test_health_of_every_stage_comes_with_one_get(self, get):
        healths = get("*/health")
        assert {health["stage"] for health in healths} == STAGES | {topics.SUPERVISOR}
        assert all(health["count"] > 0 for health in healths)


def test_json_is_laid_out_for_a_terminal_and_an_unknown_parameter_is_refused(zenoh, running):
    printed, _ = zenoh("get", "-s", running.key("fusion/state") + "?top=3;format=json", "--decoder", "text")
    rows = printed.splitlines()
    assert len(rows) > 40
    assert any(row.lstrip().startswith('{"poi_id": "P') for row in rows)
    assert json.loads(printed)["robot"] == ROBOT
    _, complaints = zenoh("get", "-s", running.key("fusion/state") + "?tops=3", "--decoder", "text")
    assert "tops: unknown parameter" in complaints


class TestEditing:
    @pytest.fixture(autouse=True)
    def _leave_no_poi(self, running):
        yield
        running.session.delete(running.key("fusion/poi/vase2"))

    def standing(self, running):
        """POIs that the present belief is about."""
        persons = running.state().get("persons") or []
        return {poi["poi_id"] for person in persons for poi in person["pois"]}

    def test_put_and_delete_of_a_poi_are_followed_by_state_and_belief(self, zenoh, running):
        key = running.key("fusion/poi/vase2")
        zenoh("put", "-k", key, "-v", json.dumps(VASE))
        running.wait_until(lambda: "vase2" in {poi["poi_id"] for poi in running.state()["pois"]}, "the POI in the state")
        running.wait_until(lambda: "vase2" in self.standing(running), "the POI in the belief")

        zenoh("delete", "-k", key)
        running.wait_until(lambda: "vase2" not in {poi["poi_id"] for poi in running.state()["pois"]}, "the POI gone")
        running.wait_until(lambda: (found := self.standing(running)) and "vase2" not in found, "the POI gone from the belief")

    def test_a_malformed_put_is_refused_with_the_name_of_the_field(self, zenoh, running):
        before = running.state()["edits_rejected"]
        zenoh("put", "-k", running.key("fusion/poi/vase2"), "-v", json.dumps(VASE | {"position_m": [1.0, "far", 0.0]}))
        state = running.wait_until(lambda: (s := running.state())["edits_rejected"] > before and s, "the refusal counted")
        assert state["rejected_edits"][-1]["key"] == running.key("fusion/poi/vase2")
        assert "position_m" in state["rejected_edits"][-1]["reason"]
        assert "vase2" not in {poi["poi_id"] for poi in state["pois"]}
        assert any("position_m" in note for note in running.health("fusion")["notes"])

    def test_an_acknowledged_edit_is_answered_with_the_stored_poi(self, zenoh, running):
        key = running.key("fusion/poi/vase2")
        printed, _ = zenoh("get", "-s", f"{key}?op=put;by=anna", "-v", json.dumps(VASE), "--decoder", "deixis")
        (stored,) = lines(printed)
        assert stored == {"poi_id": "vase2", "tags": [], **VASE, "edited_by": "anna", "edited_ns": stored["edited_ns"]}
        assert get_json(running.session, key)[0]["name"] == VASE["name"]
        printed, _ = zenoh("get", "-s", f"{key}?op=delete", "--decoder", "deixis")
        assert lines(printed)[0]["poi_id"] == "vase2"
        assert get_json(running.session, key) == []

    def test_a_malformed_acknowledged_edit_is_answered_with_the_name_of_the_field(self, zenoh, running):
        bad = json.dumps(VASE | {"extent_m": -1})
        printed, complaints = zenoh("get", "-s", running.key("fusion/poi/vase2") + "?op=put", "-v", bad)
        assert not printed
        assert "extent_m" in complaints


def documents(line):
    """The JSON documents of a line: zenoh-cli prints each key's on a thread of its own, sometimes two before the line ends."""
    decoder, at = json.JSONDecoder(), 0
    while line[at:].strip():
        document, at = decoder.raw_decode(line, at)
        yield document


def test_frames_and_tracks_are_printed_without_their_images(argv, running):
    keys = ["-k", running.key("camera/frame"), "-k", running.key("tracker/tracks")]
    watching = subprocess.Popen([*argv, "subscribe", *keys, "--decoder", "deixis"], stdout=subprocess.PIPE, text=True)
    try:
        seen = {}
        for line in watching.stdout:
            seen |= {message["stage"]: message for message in documents(line)}
            if set(seen) == {"camera", "tracker"}:
                break
    finally:
        watching.kill()
        watching.communicate()
    assert seen["camera"]["data"] == "<230400 bytes left out>"
    assert seen["tracker"]["width"] == 320
