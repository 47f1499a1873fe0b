"""The core of the view: which frames are drawn, with what, and what is said where something is missing."""

import numpy as np
from deixis_schemas import topics
from deixis_schemas.messages import Belief, CameraInfo, Frame, Gestures, HeadPoses, Health, Poi, PoiBelief, Target, Tracks
from deixis_view.curves import MOST_CURVES, Curves
from deixis_view.drawing import CurveStyle, Value
from deixis_view.known import Known
from deixis_view.scene import UNRECORDED, WITHHELD, Scene

BEGAN_NS = 1_700_000_000_000_000_000
MS = 1_000_000
PICTURE = np.full((48, 64, 3), 128, np.uint8).tobytes()
NEVER = "x"


def made(type_, seq, stage, run=1, **content):
    stamp_ns = BEGAN_NS + seq * 33 * MS
    return type_.model_validate({"stage": stage, "instance": "t", "run": run, "seq": seq, "stamp_ns": stamp_ns, **content})


def frame_of(seq, run=1):
    """What all stages say of a frame, with the milliseconds after its capture."""
    yield 3, made(Frame, seq, "camera", run, width=64, height=48, encoding="bgr8", data=PICTURE)
    yield 10, made(Tracks, seq, "tracker", run, width=64, height=48)
    yield 14, made(HeadPoses, seq, "headpose", run)
    yield 15, made(Gestures, seq, "gesture", run)
    person = {"person_id": 0, "position_m": (2, 0, 1), "pois": [standing("vase", 0.8)], "conflict": 0.1}
    yield 20, made(Belief, seq, "fusion", run, persons=[person])


def standing(poi_id, probability):
    return PoiBelief(poi_id=poi_id, mass=0, belief=0, plausibility=1, pignistic=0, probability=probability).model_dump()


def play(scene, seqs, kinds=(Frame, Tracks, HeadPoses, Gestures, Belief), late_ms=0, run=1):
    shots = []
    for seq in seqs:
        for after_ms, message in frame_of(seq, run):
            if isinstance(message, kinds):
                now_ns = message.stamp_ns + (after_ms + late_ms) * MS
                shots += scene.hear(NEVER, message, now_ns)
    return shots


def paths(shot):
    return [drawing.path for drawing in shot.drawings]


def at(shot, path):
    return next(drawing.what for drawing in shot.drawings if drawing.path == path)


def test_of_thirty_frames_a_second_ten_are_drawn_each_once_with_its_picture_and_its_answer():
    shots = [shot for shot in play(Scene(Known(), rate_hz=10), range(90)) if shot.seq is not None]
    assert [shot.seq for shot in shots] == list(range(0, 90, 3))
    for shot in shots:
        assert shot.stamp_ns == BEGAN_NS + shot.seq * 33 * MS
        drawn = [drawing.path for drawing in shot.drawings if not isinstance(drawing.what, CurveStyle)]
        assert len(drawn) == len(set(drawn))
        assert {"picture", "picture/tracks", "map/pois", "belief/0/vase", "latency/fusion"} <= set(drawn)
        assert {"reason", "health"} <= set(drawn)


def test_delays_are_from_capture_to_being_heard_by_the_clock_of_the_cameras_host():
    scene = Scene(Known())
    scene.camera_ahead_ns = -5 * MS  # it is behind ours, so that all looks later than it is
    (shot, *_) = play(scene, [0])
    latencies = {
        drawing.path: drawing.what.value
        for drawing in shot.drawings
        if drawing.path.startswith("latency/") and isinstance(drawing.what, Value)
    }
    assert latencies == {f"latency/{s}": ms for s, ms in zip(topics.STAGES, (-2, 5, 9, 10, 15), strict=True)}


def test_in_lockstep_there_are_no_delays_and_it_says_so():
    scene = Scene(Known())
    info = CameraInfo(stage="camera", instance="t", stamp_ns=0, state="streaming", source="x", lockstep=True)
    assert list(scene.hear(NEVER, info, BEGAN_NS)) == []
    (shot, *_) = play(scene, [0])
    assert not [path for path in paths(shot) if path.startswith("latency")]
    assert "lockstep" in at(shot, "health").markdown


def test_a_frame_that_nobody_answers_is_drawn_all_the_same_and_again_when_its_answer_is_late():
    scene = Scene(Known(), rate_hz=10)
    shots = play(scene, range(40), kinds=(Frame, Tracks))
    drawn = [shot.seq for shot in shots if shot.seq is not None]
    assert len(drawn) >= 2
    assert "belief/0/vase" not in {path for shot in shots for path in paths(shot)}
    late = [shot for shot in play(scene, [drawn[-1]], kinds=Belief, late_ms=800) if shot.seq == drawn[-1]]
    assert len(late) == 1
    assert "belief/0/vase" in paths(late[0])
    assert "picture" not in paths(late[0])  # it has been drawn


def test_a_camera_that_begins_anew_is_drawn_from_its_first_frame():
    scene = Scene(Known(), rate_hz=10)
    play(scene, range(10))
    assert play(scene, [0], run=2)[0].seq == 0


def test_without_frames_all_but_the_picture_is_drawn_and_the_page_says_why():
    scene = Scene(Known(), rate_hz=10)
    shots = play(scene, range(120), kinds=(Tracks, HeadPoses, Gestures, Belief))
    assert len([shot for shot in shots if shot.seq is not None]) == 40
    assert "picture" not in {path for shot in shots for path in paths(shot)}
    assert WITHHELD not in at(shots[0], "reason").markdown
    assert WITHHELD in at(shots[-1], "reason").markdown
    recorded = play(Scene(Known(), live=False), range(120), kinds=(Tracks, Belief))
    assert UNRECORDED in at(recorded[-1], "reason").markdown


def test_pictures_that_are_not_wanted_are_not_shown_though_they_come():
    shots = play(Scene(Known(), no_pictures="not wanted"), range(120))
    assert "picture" not in {path for shot in shots for path in paths(shot)}
    assert "not wanted" in at(shots[0], "reason").markdown


def test_a_picture_that_cannot_be_read_is_said_and_the_rest_drawn():
    scene = Scene(Known())
    broken = made(Frame, 0, "camera", width=64, height=48, encoding="jpeg", data=b"no picture")
    shots = list(scene.hear(NEVER, broken, BEGAN_NS))
    shots += play(scene, [0], kinds=(Tracks, Belief))
    assert "picture" not in paths(shots[0])
    assert "picture/tracks" in paths(shots[0])
    assert "data" in at(shots[0], "reason").markdown


def test_with_a_dead_camera_the_stages_are_shown_once_a_second():
    scene = Scene(Known())
    sick = {"state": "failed", "reason": "no such device", "count": 1, "pid": 1, "host": "h", "uptime_s": 1, "cpu_s": 1}
    health = Health.model_validate({"stage": "camera", "instance": "t", "stamp_ns": BEGAN_NS, "rss_mb": 1, **sick})
    shots = list(scene.hear(NEVER, health, BEGAN_NS))
    for tick in range(1, 60):
        shots += scene.tick(BEGAN_NS + tick * 100 * MS)
    assert len(shots) == 5
    assert all(shot.seq is None for shot in shots)
    assert "no such device" in at(shots[0], "health").markdown
    assert "silent" not in at(shots[0], "health").markdown
    assert "silent" in at(shots[-1], "health").markdown


def test_a_recording_shows_nothing_before_its_first_frame_has_told_the_time():
    scene = Scene(Known(), live=False)
    assert [shot for tick in range(50) for shot in scene.tick(BEGAN_NS + tick * 100 * MS)] == []


def test_the_answer_is_named_in_words_with_its_reason_and_kept_in_the_log():
    scene = Scene(Known([Poi(poi_id="vase", name="the [blue] vase", position_m=(1, 1, 1))]))
    target = made(
        Target, 0, "fusion", episode_id="e", person_id=0, final=True, poi_ids=["vase"], pois=[standing("vase", 0.9)],
        conflict=0.1, reason="It points there.", started_ns=0, ended_ns=0, latency_ms=1,
    )  # fmt: skip
    (shot,) = scene.hear(NEVER, target, BEGAN_NS)
    assert "ANSWER" in at(shot, "log").text
    shown = at(play(scene, [0])[0], "reason").markdown
    assert "It points there." in shown
    assert "the (blue) vase (vase)" in shown  # no link of somebody else's making
    assert at(play(scene, [9])[0], "map/named").strips


def test_pois_come_and_go_and_a_thousand_have_no_more_curves_than_can_be_looked_at():
    known = Known()
    key = topics.POI.key("r1", id="vase")
    known.hear(key, Poi(poi_id="vase", position_m=(1, 1, 1)), 0)
    assert known.names == {"vase": ""}
    known.hear(key, None, 0)
    assert known.names == {}
    curves = Curves()
    pois = [standing(f"p{i}", 0.9) for i in range(1000)]
    belief = made(Belief, 0, "fusion", persons=[{"person_id": p, "pois": pois[:10]} for p in range(3)])
    named = [drawing for _ in range(2) for drawing in curves.of_belief(belief, {}) if isinstance(drawing.what, CurveStyle)]
    assert len([drawing for drawing in named if drawing.path.startswith("belief/")]) == 30
    belief = made(Belief, 0, "fusion", persons=[{"person_id": 0, "pois": pois}])
    list(curves.of_belief(belief, {}))
    assert len(curves._of_pois) == MOST_CURVES


def test_visitors_who_come_all_day_share_the_curves_of_their_places():
    curves, drawn = Curves(), set()
    for visitor in range(100):
        # Each meets the one before, who then leaves.
        persons = [{"person_id": p, "pois": [standing("vase", 0.9)]} for p in (visitor, visitor + 1)]
        drawn |= {drawing.path for drawing in curves.of_belief(made(Belief, visitor, "fusion", persons=persons), {})}
    assert {path for path in drawn if path.startswith("belief/")} == {"belief/0/vase", "belief/1/vase"}
