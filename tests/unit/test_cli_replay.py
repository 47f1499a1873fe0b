"""What of a recording is said again, and how: in the order of frames, or with the stamps of now."""

import argparse

import pytest
from deixis_cli import replayer
from deixis_cli.frame_groups import LOOK_AHEAD_NS, Line, by_frame
from deixis_cli.mcap_file import McapRecorder
from deixis_cli.options import CommandError
from deixis_cli.pace import Pace
from deixis_cli.raw_message import RawMessage
from deixis_cli.replay import register, run, stages_in
from deixis_cli.restamp import Restamper
from deixis_cli.run import out_options
from deixis_conformance.command import own_router
from deixis_runtime.session import open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import CameraInfo, FrameId, OfFrame
from deixis_schemas.samples import FRAME, SAMPLES
from hypothesis import given
from hypothesis import strategies as st
from running import wait_until

SAMPLE = {type(message).__name__: message for message in SAMPLES}
MS = 1_000_000


def line(topic, seq, at_ms, run=1):
    message = SAMPLE[topic.type.__name__].model_copy(update={"run": run, "seq": seq} if seq is not None else {})
    return Line(topic.key("r1"), topic, message, at_ms * MS)


def said(groups):
    return [[(item.topic.path, item.frame_id.seq if item.frame_id else None) for item in group] for group in groups]


def test_answers_that_came_late_stand_with_their_frame():
    lines = [
        line(topics.FRAME, 0, 0),
        line(topics.FRAME, 1, 33),
        line(topics.TRACKS, 0, 40),
        line(topics.ROBOT_POSE, None, 50),
        line(topics.FRAME, 2, 66),
        line(topics.TRACKS, 1, 70),
    ]
    assert said(by_frame(lines)) == [
        [("camera/frame", 0), ("tracker/tracks", 0)],
        [("camera/frame", 1), ("tracker/tracks", 1)],
        [("robot/pose", None)],
        [("camera/frame", 2)],
    ]


def test_frames_of_the_same_number_in_two_runs_are_two_frames():
    lines = [line(topics.FRAME, 0, 0, run=1), line(topics.FRAME, 0, 10, run=2), line(topics.TRACKS, 0, 20, run=1)]
    groups = list(by_frame(lines))
    assert [group[0].frame_id for group in groups] == [FrameId(1, 0), FrameId(2, 0)]
    assert len(groups[0]) == 2


@given(
    st.lists(
        st.tuples(
            st.sampled_from([topics.FRAME, topics.TRACKS, topics.HEAD_POSES, topics.ROBOT_POSE]),
            st.integers(0, 5),
            st.integers(0, 2 * LOOK_AHEAD_NS // MS),
        ),
        max_size=40,
    )
)
def test_nothing_is_lost_or_said_twice(items):
    lines = [line(topic, None if topic is topics.ROBOT_POSE else seq, at_ms) for topic, seq, at_ms in items]
    groups = list(by_frame(lines))
    assert sorted(id(item) for group in groups for item in group) == sorted(map(id, lines))
    assert all(len({item.frame_id for item in group}) == 1 for group in groups)
    assert all(len(group) == 1 for group in groups if group[0].frame_id is None)


def test_messages_said_again_are_of_now_and_of_a_new_run():
    now = Restamper(shift_ns=5_000, first_run=700, instance="replay-1")
    first = now.now(FRAME.model_copy(update={"run": 3, "seq": 8}))
    tracks = now.now(SAMPLE["Tracks"].model_copy(update={"run": 3, "seq": 8}))
    later = now.now(FRAME.model_copy(update={"run": 4, "seq": 0}))
    assert (first.run, first.seq, first.stamp_ns, first.instance) == (700, 8, FRAME.stamp_ns + 5_000, "replay-1")
    assert tracks.frame_id == first.frame_id
    assert later.run == 701
    assert now.now(FRAME.model_copy(update={"run": 3})).run == 700, "a run keeps its new name"


def test_a_target_said_again_began_and_ended_as_long_ago_as_it_did():
    target = SAMPLE["Target"]
    moved = Restamper(10_000, 1, "replay-1").now(target)
    assert moved.stamp_ns - moved.started_ns == target.stamp_ns - target.started_ns
    assert moved.ended_ns - moved.started_ns == target.ended_ns - target.started_ns


def test_a_camera_that_has_sent_nothing_yet_names_no_run():
    now = Restamper(0, 700, "replay-1")
    info = SAMPLE["CameraInfo"]
    silent = now.now(info.model_copy(update={"run": 0, "last_seq": -1, "lockstep": True}))
    assert (silent.run, silent.lockstep) == (0, False)
    assert now.now(info.model_copy(update={"run": 9, "last_seq": 4})).run == 700


@pytest.mark.parametrize("message", SAMPLES, ids=lambda message: type(message).__name__)
def test_what_is_said_again_keeps_to_the_contract(message):
    again = Restamper(-(10**18) * 3, 1, "replay-1").now(message)
    assert codec.decode(type(again), codec.encode(again), codec.encoding_of(type(again)), max_bytes=1 << 27) == again
    if not isinstance(message, OfFrame | CameraInfo) and not hasattr(message, "stamp_ns"):
        assert again == message


# --- what is refused before anything starts ---------------------------------------------------------------------------


def recorded(path, *names):
    with McapRecorder(path) as recorder:
        for name in names:
            message = SAMPLE[name]
            topic = next(topic for topic in topics.TOPICS if topic.type is type(message))
            key = topic.key("r1", stage="camera", id="door")
            recorder.write(RawMessage(key, codec.encoding_of(type(message)), codec.encode(message), 1))
    return path


def given_(*arguments):
    parser = argparse.ArgumentParser()
    register(parser.add_subparsers())
    return parser.parse_args(["replay", *map(str, arguments)])


def test_a_stage_speaks_in_a_recording_when_it_speaks_of_frames(tmp_path):
    path = recorded(tmp_path / "a.mcap", "CameraInfo", "Health", "Poi", "Tracks", "Belief")
    assert stages_in(path) == {"tracker", "fusion"}


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--as", "camera"], "no messages of 'camera' about frames .it holds those of: tracker"),
        (["--as", "oracle"], "no stage 'oracle'"),
        (["--as", ","], "--as names no stage"),
        (["--as", "tracker"], "headpose would run without pictures: give --as camera,tracker, or --except headpose"),
        (["--as", "tracker", "--only", "fusion", "--pictures"], "--pictures goes with --out"),
    ],
)
def test_what_cannot_be_played_is_refused_with_what_to_do(tmp_path, arguments, text):
    path = recorded(tmp_path / "a.mcap", "CameraInfo", "Tracks")
    with pytest.raises(CommandError, match=text):
        run(given_(path, *arguments))


@pytest.mark.parametrize("stage", ["gesture", "fusion"])
def test_a_stage_that_would_wait_in_vain_for_each_frame_is_refused(tmp_path, stage):
    path = recorded(tmp_path / "a.mcap", "CameraInfo", "Frame")
    with pytest.raises(CommandError, match=f"{stage} would run without tracks: give --as tracker,camera, or --except {stage}"):
        run(given_(path, "--as", "camera", "--only", stage))


def test_a_recording_is_not_replayed_into_itself_and_what_lies_beside_it_stays(tmp_path):
    path = recorded(tmp_path / "a.mcap", "CameraInfo", "Frame")
    (tmp_path / "a.jsonl").write_text("what was said")
    with pytest.raises(CommandError, match=r"a\.mcap' is what is to be played.*give another --out"):
        run(given_(path, "--out", tmp_path))
    assert stages_in(path) == {"camera"}
    assert (tmp_path / "a.jsonl").read_text() == "what was said"


def test_a_second_run_into_one_folder_begins_its_files_anew(tmp_path):
    path = recorded(tmp_path / "a.mcap", "CameraInfo", "Frame")
    options = out_options(argparse.Namespace(site=None, out=tmp_path, pictures=False), "a")
    assert options["mcap"] == path
    with McapRecorder(options["mcap"]):
        pass
    assert stages_in(path) == set()


def test_a_replay_in_lockstep_does_not_wait_for_ever_for_stages_that_answer_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(replayer, "ANSWER_TIMEOUT_S", 0.05)
    path = tmp_path / "a.mcap"
    with McapRecorder(path) as recorder:
        for seq in range(9):
            frame = FRAME.model_copy(update={"seq": seq})
            recorder.write(RawMessage("deixis/r1/camera/frame", codec.encoding_of(type(frame)), codec.encode(frame), seq))
    playing = replayer.Replayer(path, "r1", {"camera"}, {"tracker"}, lockstep=True, pois=False)
    with own_router() as (_, session), playing.on(session):
        wait_until(playing.is_over, "its end", 10)
    assert playing.failure == "3 frames in a row were not answered on tracker/tracks"
    assert playing.frames == 3


def test_a_hole_in_a_recording_is_told_of_and_its_end_is_not_waited_for_when_told_to_stop(tmp_path, caplog):
    path = tmp_path / "a.mcap"
    with McapRecorder(path) as recorder:
        for at_s in (0, 3600):
            label = codec.encoding_of(type(FRAME))
            recorder.write(RawMessage("deixis/r1/camera/frame", label, codec.encode(FRAME), at_s * 10**9))
    playing = replayer.Replayer(path, "r1", {"camera"}, {"tracker"}, lockstep=False, pois=False)
    with own_router() as (_, session), playing.on(session):
        wait_until(lambda: "nothing is said for 3600 s" in caplog.text, "a word", 10)
    assert playing.is_over()
    assert playing.frames == 1


def test_the_stages_spoken_for_are_alive_until_the_last_answer_is_heard(tmp_path):
    playing = replayer.Replayer(
        recorded(tmp_path / "a.mcap", "Tracks"), "r1", {"tracker"}, {"gesture"}, lockstep=False, pois=False
    )
    with own_router() as (endpoint, session), open_client(endpoint, shared_memory=False) as other:

        def alive():
            return [reply.ok for reply in other.liveliness().get("deixis/r1/@alive/tracker/*", timeout=1.0)]

        with playing.on(session):
            wait_until(playing.is_over, "its end", 10)
            assert alive()
        wait_until(lambda: not alive(), "the end of its tokens", 5)


def test_a_missing_recording_is_named():
    with pytest.raises(CommandError, match=r"none\.mcap"):
        run(given_("none.mcap"))


# --- pace -------------------------------------------------------------------------------------------------------------


def info(at_ms, *, lockstep):
    message = SAMPLE["CameraInfo"].model_copy(update={"lockstep": lockstep})
    return Line(topics.CAMERA_INFO.key("r1"), topics.CAMERA_INFO, message, at_ms * MS)


def stamped(seq, at_ms, stamp_ms):
    message = FRAME.model_copy(update={"run": 1, "seq": seq, "stamp_ns": stamp_ms * MS})
    return Line(topics.FRAME.key("r1"), topics.FRAME, message, at_ms * MS)


def test_messages_come_as_far_apart_as_they_were_heard():
    pace = Pace()
    lines = [info(1000, lockstep=False), stamped(0, 1040, 5), stamped(1, 1090, 38)]
    assert [pace.after_s(item) for item in lines] == pytest.approx([0, 0.040, 0.090])


def test_a_recording_of_lockstep_keeps_the_time_of_its_pictures_however_slow_the_machine_was():
    pace = Pace()
    lines = [info(0, lockstep=True), stamped(0, 700, 0), stamped(1, 1500, 33), info(1600, lockstep=True), stamped(2, 2900, 66)]
    assert [pace.after_s(item) for item in lines] == pytest.approx([0, 0, 0.033, 0.033, 0.066])


@given(st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 10_000)), min_size=1), st.booleans())
def test_time_never_goes_back(times, lockstep):
    pace = Pace()
    after = [pace.after_s(info(0, lockstep=lockstep)), *(pace.after_s(stamped(0, at, stamp)) for at, stamp in times)]
    assert after == sorted(after)
