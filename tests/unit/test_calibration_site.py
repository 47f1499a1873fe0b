"""`deixis calibrate site`: the mount by pointings at known things, what is told apart, and the tables of a site."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
from deixis_calibration import site_report
from deixis_calibration.mount_fit import MountFitError, fit_mount
from deixis_calibration.site_confusion import Read, hand_table, head_table
from deixis_calibration.site_guide import HoldWatch, plan
from deixis_calibration.told_apart import Try, standings
from deixis_cli.main import main
from deixis_cli.mcap_file import McapRecorder
from deixis_cli.raw_message import RawMessage
from deixis_fusion.config import FusionConfig
from deixis_fusion.confusion import fig_6, table_1
from deixis_fusion.localisation import RobotPlace
from deixis_runtime.site import load_site
from deixis_schemas import codec, topics
from deixis_schemas.messages import CameraInfo, Gesture, Gestures, Poi
from pointing_people import BELIEVED, POIS, SPOTS, TRUE, camera_info, messages_of, simulated, write_site


def test_a_camera_that_is_four_degrees_off_is_corrected_within_half_a_degree():
    fit = fit_mount(list(simulated()), POIS, SPOTS, BELIEVED, person_height_m=1.75)
    assert fit.mount.yaw_deg == pytest.approx(4.0, abs=0.5)
    assert fit.mount.pitch_up_deg == pytest.approx(1.0, abs=0.5)
    assert fit.is_needed
    assert fit.yaw_sigma_deg < 0.5
    assert fit.head_gain == pytest.approx(0.9, abs=0.05)
    assert fit.distance_ratio == pytest.approx(1, abs=0.05)


def test_the_stated_error_of_the_correction_is_true():
    fits = [fit_mount(list(simulated(1, seed)), POIS, SPOTS, BELIEVED, 1.75) for seed in range(5)]
    off = [(fit.mount.yaw_deg - 4.0) / fit.yaw_sigma_deg for fit in fits]
    assert np.sqrt(np.mean(np.square(off))) < 1.7


def test_a_mount_that_is_right_is_left_as_it_is():
    fit = fit_mount(list(simulated()), POIS, SPOTS, TRUE, 1.75)
    assert abs(fit.yaw_change_deg) < 0.5
    assert not fit.is_needed


def test_a_robot_that_stands_elsewhere_in_the_map_changes_nothing():
    turn, shift = math.radians(90), np.array([5.0, -3.0])

    def moved(xy):
        return (
            shift[0] + xy[0] * math.cos(turn) - xy[1] * math.sin(turn),
            shift[1] + xy[0] * math.sin(turn) + xy[1] * math.cos(turn),
        )

    robot = RobotPlace(5.0, -3.0, 90.0)
    pois = {name: Poi(poi_id=name, position_m=(*moved(poi.position_m), 1.25)) for name, poi in POIS.items()}
    spots = {name: moved(spot) for name, spot in SPOTS.items()}
    there = fit_mount([replace(one, robot=robot) for one in simulated()], pois, spots, BELIEVED, 1.75)
    here = fit_mount(list(simulated()), POIS, SPOTS, BELIEVED, 1.75)
    assert there.mount.yaw_deg == pytest.approx(here.mount.yaw_deg, abs=0.01)


def test_pointings_that_went_astray_hardly_count():
    pointings = [replace(one, bearing_deg=150.0) if number % 8 == 0 else one for number, one in enumerate(simulated())]
    assert fit_mount(pointings, POIS, SPOTS, BELIEVED, 1.75).mount.yaw_deg == pytest.approx(4.0, abs=0.8)


def test_three_pointings_are_no_mount():
    with pytest.raises(MountFitError, match="3 pointings at known POIs"):
        fit_mount(list(simulated())[:3], POIS, SPOTS, BELIEVED)


def test_verdicts_are_those_of_a_rehearsal():
    tries = [
        *[Try("P1", ("P1",))] * 3,
        *[Try("P2", ("P2", "P3"))] * 2,
        Try("P2", ("P3",)),
        *[Try("P3", ("P2",))] * 2,
        Try("P3", ("P3",)),
        *[Try("P4", None)] * 2,
    ]
    found = {one.poi_id: one for one in standings(tries)}
    assert [one.verdict for one in found.values()] == ["told apart", "tied", "confused", "not seen"]
    assert found["P2"].instead == ("P3",)


def test_tables_move_from_the_papers_toward_what_was_seen():
    nothing, often = hand_table([], "x"), hand_table([Read(90.0, "invisible", 40.0)] * 50, "x")
    assert nothing.share("point_left", "left") == pytest.approx(table_1().share("point_left", "left"), abs=0.08)
    assert often.share("invisible", "left") > 0.8
    assert often.share("point_right", "right") == nothing.share("point_right", "right")
    head = head_table([Read(-80.0, None, -40.0)] * 50 + [Read(130.0, None, None)] * 5, "x")
    intended, perceived = head.intended_deg.index(80), head.perceived_deg.index(40)
    assert head.table[perceived][intended] > 0.8
    assert head.not_computed[head.intended_deg.index(130)] == 1
    assert np.allclose(np.array(head.table)[:, 0], np.array(fig_6().table)[:, 0], atol=0.01)


def test_everybody_walks_once_to_each_spot():
    asked = list(plan(["A", "B"], ["P1", "P2", "P3"], 2))
    assert [one.poi_id for one in asked[:6]] == ["P1", "P2", "P3", "P3", "P2", "P1"]
    assert [one.number for one in asked if one.first_at_spot] == [0, 6]
    assert len(asked) == 12


def gestures_at(seconds, kind="point_left", phase="stroke"):
    gesture = Gesture(person_id=0, phase=phase, gesture=kind)
    return Gestures(
        run=1, seq=round(seconds * 30), stamp_ns=round(seconds * 1e9), stage="gesture", instance="g", gestures=[gesture]
    )


def test_a_pointing_has_to_be_held_and_is_waited_for_so_long():
    watch, idle = HoldWatch(), {"kind": "none", "phase": "idle"}
    said = [watch.hear(gestures_at(0, **idle)), *(watch.hear(gestures_at(1 + t / 10)) for t in range(16))]
    assert said[0] == "waiting"
    assert said[1] == "pointing"
    assert said[-1] == "held"
    assert watch.span_ns == (1_000_000_000, 2_500_000_000)
    assert [HoldWatch().hear(gestures_at(0, **idle)), watch.hear(gestures_at(3.5, **idle))] == ["waiting", "waiting"]
    nobody = HoldWatch()
    assert [nobody.hear(gestures_at(t, **idle)) for t in (0, 10, 16)] == ["waiting", "waiting", "given up"]


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A site file, the recording of a session in it, and its labels."""
    folder = tmp_path_factory.mktemp("session")
    write_site(folder / "site.yaml")
    key, seq, labelled = {"Tracks": topics.TRACKS, "HeadPoses": topics.HEAD_POSES, "Gestures": topics.GESTURES}, 0, []
    info = camera_info()
    with McapRecorder(folder / "session.mcap") as recorder:
        recorder.write(RawMessage(topics.CAMERA_INFO.key("r"), codec.encoding_of(CameraInfo), codec.encode(info), 1))
        for pointing in simulated(rounds=1):
            still = replace(pointing, gesture=None)
            labelled.append({"poi_id": pointing.poi_id, "spot": pointing.spot, "from_s": seq / 10, "to_s": (seq + 9) / 10})
            for what in (*[pointing] * 9, *[still] * 6):
                for message in messages_of(what, seq):
                    name = type(message).__name__
                    payload = codec.encode(message)
                    recorder.write(RawMessage(key[name].key("r"), codec.encoding_of(type(message)), payload, seq))
                seq += 1
    labels = {"spots": {name: list(at) for name, at in SPOTS.items()}, "person_height_m": 1.75, "pointings": labelled}
    (folder / "labels.yaml").write_text(json.dumps(labels))
    return folder


def calibrate(session, *words):
    files = ["--site", session / "site.yaml", "--from", session / "session.mcap", "--labels", session / "labels.yaml"]
    return main(["calibrate", "site", *map(str, (*files, *words))])


def test_a_recorded_session_corrects_the_site_file_and_keeps_its_comments(session, capsys):
    out = session / "corrected.yaml"
    assert calibrate(session, "--out", out) in (0, 3)
    said = capsys.readouterr().out
    assert "24 pointings measured" in said
    named = re.findall(r"named alone in (\d) of 3 as it is, in (\d) as corrected", said)
    before, after = (sum(int(one[when]) for one in named) for when in (0, 1))
    assert len(named) == len(POIS)
    assert after > before
    assert after >= 16
    text = out.read_text()
    assert text.startswith("# the hall\n")
    assert "# by protractor" in text
    site = load_site(out)
    assert site.camera["mount"]["yaw_deg"] == pytest.approx(4.0, abs=0.5)
    assert f"camera.mount.yaw_deg: {site.camera['mount']['yaw_deg']:.2f} (changed by +" in said
    tables = FusionConfig.model_validate(site.settings["fusion"]).confusion
    assert tables.hand.share("point_left", "left") > 0.8


def test_of_a_session_that_was_ended_early_the_pointings_until_then_count(session, tmp_path, capsys):
    labels = json.loads((session / "labels.yaml").read_text())
    labels["pointings"] = labels["pointings"][:2]
    (tmp_path / "labels.yaml").write_text(json.dumps(labels))
    assert calibrate(session, "--labels", tmp_path / "labels.yaml", "--json") == 3
    said = json.loads(capsys.readouterr().out)
    assert (said["pointings"], said["mount"]) == (2, None)
    assert "4 are the fewest" in said["why_no_mount"]
    assert [one["poi_id"] for one in said["after"]] == ["P1", "P2"]


def test_a_recorded_session_that_was_cut_off_is_said_to_be(session, tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes((session / "session.mcap").read_bytes()[:-10])
    labels = json.loads((session / "labels.yaml").read_text())
    labels["pointings"] = labels["pointings"][:2]
    (tmp_path / "labels.yaml").write_text(json.dumps(labels))
    assert calibrate(session, "--from", cut, "--labels", tmp_path / "labels.yaml") == 3
    said = f"deixis calibrate site: '{cut}' was cut off while it was written; what it holds is used"
    assert said in capsys.readouterr().err.splitlines()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--out", "/elsewhere.yaml"), "has to lie beside"),
        (("--labels", "nowhere.yaml"), "No such file"),
        (("--from", "nowhere.mcap"), "No such file"),
    ],
)
def test_bad_usage_is_refused_by_name(session, words, said, capsys):
    assert calibrate(session, *words) == 1
    assert said in capsys.readouterr().err


def test_a_live_session_says_what_it_needs(session, capsys):
    site = str(session / "site.yaml")
    for words, said in (
        ((), "give --robot NAME, or --from"),
        (("--robot", "r"), "give --stand X,Y"),
        (("--robot", "r", "--stand", "1;2"), "not of the form X,Y"),
        (("--robot", "r", "--stand", "1,2", "--only", "P99"), "--only P99: no POI"),
    ):
        assert main(["calibrate", "site", "--site", site, *words]) == 1
        assert said in capsys.readouterr().err


def test_labels_that_name_no_spot_are_refused_by_field(session, tmp_path, capsys):
    labels = json.loads((session / "labels.yaml").read_text())
    labels["pointings"][2]["spot"] = "Z"
    (tmp_path / "labels.yaml").write_text(json.dumps(labels))
    assert calibrate(session, "--labels", tmp_path / "labels.yaml") == 1
    assert "pointings.2.spot: 'Z' is none of the spots" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("shift_s", "first", "said"),
    [
        (900, 0, "pointings.0: the labels lie after the recording's end: from 900 s on, where"),
        (900, 23, "pointings.23: the labels lie after the recording's end"),
        (0, 24, "pointings: there are none"),
    ],
)
def test_labels_of_another_recording_or_of_nothing_are_refused(session, shift_s, first, said, tmp_path, capsys):
    labels = json.loads((session / "labels.yaml").read_text())
    labels["pointings"] = [] if first == 24 else labels["pointings"]
    for pointing in labels["pointings"][first:]:
        pointing["from_s"] += shift_s
        pointing["to_s"] += shift_s
    (tmp_path / "labels.yaml").write_text(json.dumps(labels))
    assert calibrate(session, "--labels", tmp_path / "labels.yaml") == 1
    heard = capsys.readouterr()
    assert (heard.out, heard.err.count("\n")) == ("", 1)
    assert said in heard.err


def test_no_pointing_is_judged_by_tables_and_a_mount_that_it_helped_to_make(session, monkeypatch, capsys):
    tables, mounts = [], []

    def noted(heard, label, site, config, mount, _answer=site_report.answer):
        tables.append(config.confusion)
        mounts.append(mount)
        return _answer(heard, label, site, config, mount)

    reads = []
    monkeypatch.setattr(site_report, "answer", noted)
    monkeypatch.setattr(site_report, "head_table", lambda given, source: reads.append(given) or head_table(given, source))
    assert calibrate(session, "--json") in (0, 3)
    said = json.loads(capsys.readouterr().out)
    whole, *others = reads
    assert [[one for one in whole if one not in some] for some in others] == [[one] for one in whole]
    as_it_is, corrected = mounts[: len(whole)], mounts[len(whole) :]
    assert set(map(repr, as_it_is)) == {repr(BELIEVED)}
    assert len(set(map(repr, corrected))) == len(whole), "each has a mount of its own"
    assert repr(said["mount"]["mount"]) not in {repr(mount.model_dump()) for mount in corrected}
    assert all(one.head.model_dump() != said["head"] for one in tables[len(whole) :])
