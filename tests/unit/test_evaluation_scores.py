"""Scores of made-up recordings, where each figure is known beforehand."""

import io
import json
from pathlib import Path
from typing import Any

import pytest
from deixis_evaluation.clip_score import ClipScore, failed_clip, latencies_ms, score_clip
from deixis_evaluation.clips import Truth
from deixis_evaluation.recording import Recording, RecordingError, read_recording
from deixis_evaluation.report import Conditions, report
from deixis_evaluation.slices import Slice
from deixis_evaluation.summary import summarise
from deixis_evaluation.table import print_scores
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import Belief, Gestures, HeadPoses, Target, Tracks
from rich.console import Console

FRAME_NS = 33_000_000
EPOCH_NS = 10**18
ALL_STROKE = range(10, 30)


def truth(persons: int = 1, *, points: bool = True, azimuth_deg: float = 60.0, yaw_deg: float = 50.0) -> Truth:
    """60 frames; person 0 points at P1 from frame 10 to 29 where `points`. Faces 25 px wide, persons 200 px apart."""
    frames = []
    for index in range(60):
        stroke = points and index in ALL_STROKE
        shown = [_person(number, stroke=stroke and number == 0, azimuth=azimuth_deg, yaw=yaw_deg) for number in range(persons)]
        frames.append({"frame": index, "persons": shown})
    camera = {
        "K": [[500, 0, 319.5], [0, 500, 239.5], [0, 0, 1]],
        "R_world_to_cam": [1, 0, 0, 0, -1, 0, 0, 0, -1],
        "t_world_to_cam": [0, 1.3, 2],
        "height_m": 1.3,
        "pitch_up_deg": 0,
    }
    pois = [{"id": name, "xyz_world": [1, 1, 0]} for name in ("P1", "P2")]
    meta = {"kind": "point", "fps": 30, "width": 640, "height": 480, "camera": camera, "pois": pois}
    return Truth.model_validate({"meta": meta, "frames": frames})


def _person(number: int, *, stroke: bool, azimuth: float, yaw: float) -> dict[str, Any]:
    x = 200 + 200 * number

    def hand(at: float) -> dict[str, Any]:
        return {"center_px": [at, 350], "centroid_visible_px": [at, 350], "visible_px": 400, "in_frame": True}

    return {
        "id": number,
        "phase": "stroke" if stroke else "none",
        "gesture": "point" if stroke else "none",
        "poi": "P1" if stroke else None,
        "poi_azimuth_deg": azimuth if stroke else None,
        "head": {"yaw_rel_deg": yaw, "center_px": [x, 200]},
        "face": {"bbox_visible": [x - 15, 180, 30, 40], "centroid_visible_px": [x, 200], "visible_px": 900},
        "hands": {"left": hand(x + 70), "right": hand(x - 70)},
        "arm": {"side": "left"} if stroke else {},
        "user_pos": {"robot_xy": [3.2, 0], "distance_m": 3.2},
    }


def head(seq: int) -> dict[str, Any]:
    return {"run": 1, "seq": seq, "stamp_ns": EPOCH_NS + seq * FRAME_NS, "stage": "test", "instance": "t"}


def track(kind: str, x: float, y: float, person: int | None = 0, number: int = 1) -> dict[str, Any]:
    return {
        "track_id": number,
        "person_id": person,
        "kind": kind,
        "kind_probabilities": {},
        "centroid_px": (x, y),
        "bbox_px": (x - 5, y - 5, 10, 10),
        "velocity_px_s": (0, 0),
    }


def recording(frames: range = range(60), **content: Any) -> Recording:
    """One message of each kind a frame: `tracks`, `poses`, `gestures`, `persons` (of the belief) as given."""
    made = Recording()
    for seq in frames:
        received = EPOCH_NS + seq * FRAME_NS
        made.add_frame(1, seq, EPOCH_NS + seq * FRAME_NS, received + 1_000_000)
        tracks = content.get("tracks", [track("face", 200, 200)])
        made.add(Tracks(**head(seq), width=640, height=480, tracks=tracks), received)
        made.add(HeadPoses(**head(seq), poses=content.get("poses", [])), received)
        made.add(Gestures(**head(seq), gestures=content.get("gestures", [])), received)
        made.add(Belief(**head(seq), persons=content.get("persons", [])), received + 21_000_000)
    return made


def target(first: int, last: int, *poi_ids: str, person: int = 0, final: bool = True) -> Target:
    return Target(
        **head(last),
        episode_id=f"e{first}",
        person_id=person,
        final=final,
        poi_ids=list(poi_ids),
        conflict=0.1,
        reason="because",
        started_ns=EPOCH_NS + first * FRAME_NS,
        ended_ns=EPOCH_NS + last * FRAME_NS,
        latency_ms=0,
    )


def scored(clip: Truth, heard: Recording, *targets: Target, name: str = "clip") -> ClipScore:
    for item in targets:
        heard.add(item, 0)
    return score_clip(name, clip, heard, lockstep=True)


@pytest.mark.parametrize(
    ("answer", "outcome"),
    [(["P1"], "named"), (["P2"], "wrong"), (["P1", "P2"], "in_set"), ([], "missed"), (["P2", "P3"], "wrong")],
)
def test_an_answer_is_named_in_the_set_wrong_or_missed(answer: list[str], outcome: str) -> None:
    score = scored(truth(), recording(), target(12, 31, *answer))
    assert [item.outcome for item in score.answers.episodes] == [outcome]
    assert score.answers.episodes[0].answered
    assert score.answers.false_episodes == ()
    assert score.all_named == (outcome == "named")


def test_a_stroke_without_a_target_is_missed() -> None:
    (episode,) = scored(truth(), recording()).answers.episodes
    assert (episode.outcome, episode.answered, episode.frames) == ("missed", False, (10, 29))


def test_updates_of_a_target_are_no_answers() -> None:
    score = scored(truth(), recording(), target(12, 20, "P1", final=False))
    assert score.answers.episodes[0].outcome == "missed"


def test_a_target_outside_of_the_stroke_is_a_false_episode() -> None:
    score = scored(truth(), recording(), target(40, 50, "P1"))
    assert score.answers.episodes[0].outcome == "missed"
    assert [item.frames for item in score.answers.false_episodes] == [(40.0, 50.0)]


def test_of_two_targets_for_a_stroke_the_longer_one_answers_and_the_other_is_false() -> None:
    score = scored(truth(), recording(), target(10, 14, "P2"), target(16, 31, "P1"))
    assert score.answers.episodes[0].outcome == "named"
    assert [item.poi_ids for item in score.answers.false_episodes] == [("P2",)]


def test_every_final_target_of_a_quiet_clip_is_false() -> None:
    score = scored(truth(points=False), recording(), target(12, 31), target(40, 45, "P1"))
    assert (score.family, len(score.answers.false_episodes), score.answers.episodes) == ("quiet", 2, ())


def test_among_several_persons_only_the_pointing_ones_target_answers() -> None:
    both = [track("face", 200, 200, person=7), track("face", 400, 200, person=3, number=2)]
    wrong_person = scored(truth(2), recording(tracks=both), target(12, 31, "P1", person=3))
    assert (wrong_person.family, wrong_person.answers.episodes[0].outcome) == ("several", "missed")
    assert len(wrong_person.answers.false_episodes) == 1
    right_person = scored(truth(2), recording(tracks=both), target(12, 31, "P1", person=7))
    assert right_person.answers.episodes[0].outcome == "named"


def test_times_between_frames_that_were_not_seen_are_interpolated() -> None:
    heard = recording(range(0, 60, 10))
    assert heard.frame_at(EPOCH_NS + 15 * FRAME_NS) == pytest.approx(15)
    assert heard.frame_at(EPOCH_NS + 20 * FRAME_NS) == 20
    assert heard.frame_at(EPOCH_NS + 99 * FRAME_NS) == 50
    assert heard.frame_at(0) == 0


@pytest.mark.parametrize(
    ("gesture", "azimuth", "side"),
    [
        ("point_left", 60.0, "right"),
        ("point_right", 60.0, "wrong"),
        ("point_right", -60.0, "right"),
        ("invisible", 60.0, "missed"),
        ("point_left", 10.0, None),
        ("point_left", 170.0, None),
    ],
)
def test_the_side_is_scored_for_lateral_targets_only(gesture: str, azimuth: float, side: str | None) -> None:
    said = {"person_id": 0, "phase": "stroke", "gesture": gesture, "bearing_deg": 44, "bearing_sigma_deg": 5}
    (episode,) = scored(truth(azimuth_deg=azimuth), recording(gestures=[said])).answers.episodes
    assert episode.side == side
    assert episode.gestures == {gesture: 20}
    assert episode.bearing_deg == 44


def test_face_and_hand_recall_count_frames() -> None:
    found = [track("face", 214, 218), track("left_hand", 275, 352, number=2), track("right_hand", 270, 350, number=3)]
    blobs = scored(truth(), recording(range(30), tracks=found)).blobs
    assert (blobs.faces.found, blobs.faces.total) == (30, 60)
    # The right hand's track lies on the left hand: the right hand is not found, but somebody's hand is there.
    assert (blobs.hands.found, blobs.hands.total) == (30, 120)
    assert (blobs.raised_hands.found, blobs.raised_hands.total) == (20, 20)
    assert blobs.false_hands == 0


def test_a_hand_track_far_from_all_hands_is_false_and_one_of_another_kind_is_not_a_hand() -> None:
    made_up = [track("left_hand", 500, 100), track("unknown", 20, 20, number=2), track("face", 600, 400, number=3)]
    blobs = scored(truth(), recording(tracks=made_up)).blobs
    assert blobs.false_hands_per_frame == 1
    assert blobs.faces.share == 0


def test_yaw_is_scored_by_band_against_the_person_at_that_place() -> None:
    poses = [
        {"person_id": 5, "status": "tracking", "yaw_deg": 53, "yaw_sigma_deg": 3},
        {"person_id": 6, "status": "tracking", "yaw_deg": -80, "yaw_sigma_deg": 3},
    ]
    tracks = [track("face", 200, 200, person=5), track("face", 600, 80, person=6, number=2)]
    band = scored(truth(), recording(range(45), tracks=tracks, poses=poses)).yaw["30-60"]
    assert (band.frames, band.tracking, band.silent) == (60, 45, 0)
    assert band.mae_deg == pytest.approx(3)
    assert band.share(band.tracking) == 0.75


@pytest.mark.parametrize(
    ("pose", "fine", "silent"),
    [
        ({"status": "out_of_range"}, 60, 0),
        ({"status": "out_of_range", "side": "right"}, 0, 0),
        ({"status": "out_of_range", "side": "left"}, 60, 0),
        ({"status": "tracking", "yaw_deg": 80, "yaw_sigma_deg": 5}, 60, 60),
        ({"status": "tracking", "yaw_deg": -118, "yaw_sigma_deg": 5}, 0, 60),
        ({"status": "lost"}, 0, 0),
    ],
)
def test_over_90_degrees_saying_so_or_the_right_side_is_fine(pose: dict[str, Any], fine: int, silent: int) -> None:
    band = scored(truth(yaw_deg=118), recording(poses=[{"person_id": 0, **pose}])).yaw["over_90"]
    assert (band.said_or_side, band.silent) == (fine, silent)


def test_distance_is_scored_relative_to_the_truth() -> None:
    persons = [{"person_id": 0, "distance_m": 3.2 * 1.05}, {"person_id": 9, "distance_m": 99.0}]
    score = scored(truth(), recording(persons=persons)).distance
    assert score.error_percent == pytest.approx(5)
    assert score.frames == 60


def test_latency_starts_at_the_frames_receipt_in_lockstep_and_at_its_capture_otherwise() -> None:
    heard = recording(range(3))
    assert latencies_ms(heard, lockstep=True) == pytest.approx((20, 20, 20))
    assert latencies_ms(heard, lockstep=False) == pytest.approx((21, 21, 21))


def test_the_summary_counts_clips_strokes_and_false_episodes_apart() -> None:
    named = scored(truth(), recording(), target(12, 31, "P1"), name="a")
    wrong = scored(truth(), recording(), target(12, 31, "P2"), target(50, 55), name="b")
    quiet = scored(truth(points=False), recording(), target(12, 31), name="c")
    failed = failed_clip("d", truth(), "no frame was published")
    summary = summarise([named, wrong, quiet, failed])
    assert (summary.clips_named, summary.pointing_clips) == (1, 3)
    assert summary.outcomes == {"named": 1, "in_set": 0, "missed": 1, "wrong": 1}
    assert (summary.false_quiet, summary.false_pointing, summary.quiet_clips_with_episodes) == (1, 1, 1)
    assert summary.failed == ("d",)
    assert (summary.frames, summary.frames_answered) == (240, 180)
    # A clip that was not played says nothing about recall.
    assert summary.blobs.faces.share == 1


def test_report_and_table_hold_every_clip_and_are_plain_json() -> None:
    scores = [scored(truth(), recording(), target(12, 31, "P1"), name="a"), failed_clip("d", truth(), "[router] is gone")]
    summary = summarise(scores)
    slices = [Slice("arm", "bent", 2, 4, {"named": 1, "in_set": 1, "missed": 2, "wrong": 0})]
    conditions = Conditions(Path("clips"), lockstep=True, truth=("headpose",), plain=True)
    content = json.loads(json.dumps(report(conditions, scores, summary, slices, {"cpu": "x"}), allow_nan=False))
    assert (content["seeds"], content["plain"], content["truth"]) == (None, True, ["headpose"])
    assert (content["slices"][0]["named_share"], content["slices"][0]["missed"]) == (0.25, 2)
    assert content["summary"]["poi_named_share"] == 0.5
    assert content["clips"]["a"]["episodes"][0]["outcome"] == "named"
    assert content["clips"]["a"]["yaw"]["30-60"]["frames"] == 60
    assert content["clips"]["d"]["failure"] == "[router] is gone"
    console = Console(record=True, width=200, file=io.StringIO())
    print_scores(console, scores, summary, slices)
    assert "25 % (5-70)" in console.export_text(clear=False)
    assert "in 1 of 2 pointing clips (50 %)" in console.export_text(clear=False)
    assert "failed: [router] is gone" in console.export_text()


def test_a_recording_is_read_back_from_its_lines(tmp_path: Path) -> None:
    lines = []
    face = track("face", 200, 200) | {"contour": b"\x01\x00\x02\x00"}
    shown = Tracks.model_validate({**head(4), "width": 640, "height": 480, "tracks": [face]})
    for message in (shown, target(1, 4, "P1"), target(1, 4, final=False)):
        entry = {"key": "k", "type": type(message).__name__, "received_ns": 5, "message": json.loads(message.model_dump_json())}
        lines.append(json.dumps(entry))
    lines.append(json.dumps({"key": "k", "type": "Frame", "seq": 4, "stamp_ns": 8, "received_ns": 9, "message": {"run": 1}}))
    lines.append(json.dumps({"key": "k", "type": "CameraInfo", "received_ns": 9, "message": {"of": "no interest"}}))
    for stage, pid in (("fusion", 5), ("tracker", 6), ("fusion", 7)):
        beat = {"stamp_ns": 1, "stage": stage, "instance": "t", "count": 1, "state": "ok", "pid": pid, "host": "h"}
        beat |= {"uptime_s": 1, "cpu_s": 1, "rss_mb": 1}
        lines.append(json.dumps({"key": "k", "type": "Health", "received_ns": 9, "message": beat}))
    path = tmp_path / "a.jsonl"
    path.write_text("\n".join(lines))
    read = read_recording(path)
    assert read.tracks[4] == shown
    assert [item.poi_ids for item in read.targets] == [["P1"]]
    assert read.frame_ns == {4: 9}
    assert read.interruption == "restarted while the clip was played: fusion"


def test_two_passes_through_a_clip_are_not_scored_as_one() -> None:
    heard = recording()
    assert heard.interruption is None
    heard.add_frame(2, 0, EPOCH_NS, EPOCH_NS)
    assert heard.interruption == "the camera began 2 runs of the clip"


def test_face_widths_are_those_of_the_contract() -> None:
    clip = truth()
    assert clip.face_width_px(clip.frames[0].persons[0]) == pytest.approx(500 * FACE_WIDTH_M / 3.2)


@pytest.mark.parametrize(
    "line", ["{", "[]", '{"type": "Tracks", "received_ns": 1, "message": {"seq": -1}}', '{"type": "Frame"}']
)
def test_a_damaged_recording_names_file_and_line(tmp_path: Path, line: str) -> None:
    path = tmp_path / "a.jsonl"
    path.write_text('{"type": "CameraInfo"}\n' + line)
    with pytest.raises(RecordingError, match=r"a\.jsonl' line 2"):
        read_recording(path)
