"""What the checks of a stage make of what was fed and heard."""

from dataclasses import replace
from itertools import combinations
from xml.etree import ElementTree

import pytest
import zenoh
from deixis_cli.mcap_file import McapRecorder
from deixis_cli.raw_message import RawMessage
from deixis_conformance.answer_checks import (
    check_answers,
    check_backlog,
    check_jpeg,
    check_new_run,
    check_old,
    check_silence,
    check_survived,
    fed_of,
)
from deixis_conformance.camera_checks import check_camera
from deixis_conformance.examination import watched_keys
from deixis_conformance.garbage import garbage_for
from deixis_conformance.health_checks import check_health, check_says_rejected
from deixis_conformance.observation import Fed, Heard, Phase
from deixis_conformance.payload_checks import check_payloads, check_producer
from deixis_conformance.recording import SHIPPED, RecordingError, jpeg_frame, raw_frame, read_recording
from deixis_conformance.report import print_report, unseen, write_junit
from deixis_conformance.results import Result
from deixis_schemas import Producer, codec, topics
from deixis_schemas.messages import FrameId, Gestures, InputHealth
from deixis_schemas.samples import FRAME, SAMPLES

SAMPLE = {type(message).__name__: message for message in SAMPLES}
TRACKS = SAMPLE["Tracks"]


def source(seq, run=1, stamp_ns=None):
    return TRACKS.model_copy(update={"run": run, "seq": seq, "stamp_ns": 1_000 + seq if stamp_ns is None else stamp_ns})


def heard(message, at_s, key="gesture/gestures", **changes):
    label = changes.pop("label", codec.encoding_of(type(message)))
    payload = codec.pack({**message.model_dump(), **changes})
    return Heard(f"deixis/r1/{key}", label, payload, at_s)


def answer(seq, at_s, run=1, **changes):
    said = Gestures.derive(source(seq, run), Producer("gesture", "g-1"), gestures=[])
    return heard(said, at_s, **changes)


def phase(answers, frames=10, run=1, running=True):
    fed = [Fed(FrameId(run, seq), 1_000 + seq, seq * 0.1) for seq in range(frames)]
    return Phase("p", 0.0, frames * 0.1 + 0.5, fed, list(answers), running)


def outcomes(results):
    return {result.name: result.outcome for result in results}


GOOD = phase([answer(seq, seq * 0.1 + 0.02) for seq in range(10)])


def test_frames_answered_in_time_once_and_by_name_pass():
    results = check_answers("gesture", GOOD)
    assert set(outcomes(results).values()) == {"passed"}
    assert results[0].found == "100% of 10 frames answered on gesture/gestures, 95 % of them within 20 ms"


@pytest.mark.parametrize(
    ("answers", "failed"),
    [
        ([], "answers"),
        ([answer(seq, seq * 0.1) for seq in range(4)], "answers"),
        ([answer(seq, seq * 0.1 + 1.2) for seq in range(10)], "answers"),
        ([*GOOD.heard, answer(77, 1.0)], "frame"),
        ([*GOOD.heard[1:], answer(0, 0.1, run=2)], "frame"),
        ([*GOOD.heard[1:], answer(0, 0.1, stamp_ns=5)], "stamp"),
        ([*GOOD.heard, answer(3, 0.9)], "once"),
    ],
)
def test_a_breach_fails_its_own_check_alone(answers, failed):
    found = outcomes(check_answers("gesture", phase(answers)))
    assert [name for name, outcome in found.items() if outcome == "failed"] == [failed]


def test_an_answer_of_a_run_before_is_no_answer_to_a_new_one():
    assert outcomes(check_new_run("gesture", phase([answer(0, 0.1, run=1)], run=2))) == {"new run": "failed"}
    assert outcomes(check_new_run("gesture", phase([answer(0, 0.1, run=2)], run=2))) == {"new run": "passed"}


def test_jpegs_need_an_answer_and_silence_none():
    nothing = phase([])
    assert outcomes(check_jpeg("gesture", nothing) + check_silence("gesture", nothing)) == {
        "jpeg": "failed",
        "silence": "passed",
    }
    assert outcomes(check_jpeg("gesture", GOOD) + check_silence("gesture", GOOD)) == {"jpeg": "passed", "silence": "failed"}


def test_who_dies_of_something_and_who_is_struck_dumb_by_it_both_fail():
    dead, dumb = phase([], running=False), phase([])
    for before, after in ((dead, dead), (GOOD, dead), (GOOD, dumb)):
        assert outcomes(check_survived("garbage", "garbage", "gesture", before, after)) == {"garbage": "failed"}
    assert outcomes(check_survived("garbage", "garbage", "gesture", dumb, GOOD)) == {"garbage": "passed"}


def test_old_frames_are_to_be_left_alone_and_others_may_be_answered():
    assert outcomes(check_old("gesture", phase([answer(3, 0.1)]))) == {"age": "failed"}
    assert outcomes(check_old("gesture", phase([answer(3, 0.1, run=0)]))) == {"age": "passed"}


def test_of_a_burst_the_last_frame_counts():
    for answers, outcome in (
        ([answer(9, 1.0)], "passed"),
        ([answer(seq, 1.0) for seq in range(9)], "failed"),
        ([answer(9, 2.1)], "failed"),
        ([], "failed"),
    ):
        assert outcomes(check_backlog("gesture", phase(answers))) == {"backlog": outcome}


# --- payloads ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("message", "failed", "named"),
    [
        (answer(0, 0.1, label=""), "labels", "expected 'application/msgpack;Gestures/"),
        (answer(0, 0.1, label="application/msgpack;Gestures/1"), "labels", "version '1'"),
        (answer(0, 0.1, gestures=[{"person_id": "one"}]), "schema", "gestures.0.person_id"),
        (answer(0, 0.1, key="gesture/notes"), "schema", "a key outside the contract"),
        (answer(0, 0.1, key="headpose/poses"), "keys", "deixis/r1/headpose/poses"),
    ],
)
def test_a_wrong_payload_is_named_with_its_key(message, failed, named):
    results = check_payloads("gesture", [GOOD, phase([message])])
    (wrong,) = [result for result in results if result.outcome == "failed"]
    assert wrong.name == failed
    assert named in wrong.found
    assert "deixis/r1/" in wrong.found


def test_messages_that_were_too_many_to_be_judged_fail():
    flooded = replace(phase([]), unheard=7)
    (flood,) = [result for result in check_payloads("gesture", [phase([]), flooded]) if result.name == "flood"]
    assert (flood.outcome, flood.found) == ("failed", "7 messages came beyond those that were judged")
    assert "flood" not in outcomes(check_payloads("gesture", [phase([])]))


def test_a_producer_has_one_name_which_is_its_tokens():
    stranger = phase([answer(0, 0.1, instance="g-2")])
    assert outcomes(check_producer("gesture", [GOOD], "g-1")) == {"producer": "passed"}
    assert outcomes(check_producer("gesture", [GOOD], None)) == {"producer": "passed"}
    for phases, instance in (([GOOD], "g-2"), ([GOOD, stranger], "g-1"), ([GOOD, stranger], None)):
        assert outcomes(check_producer("gesture", phases, instance)) == {"producer": "failed"}
    assert outcomes(check_producer("tracker", [GOOD], None)) == {"producer": "failed"}
    assert check_producer("gesture", [phase([])], "g-1") == []


# --- health -----------------------------------------------------------------------------------------------------------


def beat(count, at_s, rejected=0):
    health = SAMPLE["Health"].model_copy(update={"stage": "gesture", "count": count})
    told = health.model_copy(update={"inputs": [InputHealth(key="k", rejected=rejected)]})
    return heard(told, at_s, key="gesture/health")


def beats(*items):
    return phase([beat(*item) for item in items])


def test_a_heartbeat_comes_once_a_second_and_counts():
    good = [beats((1, 0.0), (2, 1.0), (3, 2.1))]
    assert set(outcomes(check_health("gesture", good, 1, "")).values()) == {"passed"}
    slow = outcomes(check_health("gesture", [beats((1, 0.0), (2, 4.0))], 1, ""))
    hung = outcomes(check_health("gesture", [beats((1, 0.0), (1, 1.0))], 1, ""))
    mute = outcomes(check_health("gesture", good, 0, ""))
    assert [name for found in (slow, hung, mute) for name, outcome in found.items() if outcome == "failed"] == [
        "heartbeat",
        "heartbeat counts",
        "health by get",
    ]


def test_a_stage_without_health_is_noted_and_not_failed():
    assert outcomes(check_health("gesture", [GOOD], 0, "")) == {"health": "noted"}


def test_health_that_counts_no_broken_message_is_noted():
    before = [beats((1, 0.0, 2))]
    assert outcomes(check_says_rejected("gesture", before, [beats((2, 1.0, 2))], 9)) == {"rejected": "noted"}
    assert outcomes(check_says_rejected("gesture", before, [beats((2, 1.0, 5))], 9)) == {"rejected": "passed"}
    assert check_says_rejected("gesture", before, [phase([])], 9) == []


# --- camera -----------------------------------------------------------------------------------------------------------


def frames(*items):
    said = [FRAME.model_copy(update={"run": run, "seq": seq, "stamp_ns": stamp_ns}) for run, seq, stamp_ns in items]
    return [phase([heard(frame, index * 0.1, key="camera/frame") for index, frame in enumerate(said)])]


@pytest.mark.parametrize(
    ("phases", "told", "replies", "failed"),
    [
        (frames((1, 0, 10), (1, 1, 20), (2, 0, 30)), 1, 1, []),
        (frames((1, 1, 10), (1, 0, 20)), 1, 1, ["numbers"]),
        (frames((1, 0, 20), (1, 1, 20)), 1, 1, ["stamps"]),
        (frames((1, 0, 10), (1, 1, 20)), 0, 1, ["lens"]),
        (frames((1, 0, 10), (1, 1, 20)), 1, 0, ["lens by get"]),
        (frames(), 1, 1, ["frames"]),
    ],
)
def test_a_camera_numbers_and_stamps_upward_and_tells_its_lens(phases, told, replies, failed):
    results = check_camera(phases, told, replies)
    assert [result.name for result in results if result.outcome == "failed"] == failed


# --- what stages are fed with -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("stage", [stage for stage, inputs in topics.INPUTS.items() if inputs])
def test_the_shipped_recording_feeds_each_stage_with_all_of_its_inputs(stage):
    recording = read_recording(SHIPPED, topics.INPUTS[stage])
    needed = {topic for topic in topics.INPUTS[stage] if topic.max_age_s is not None}
    assert len(recording.moments) == 63
    assert all(needed <= moment.messages.keys() for moment in recording.moments)
    assert recording.moments[-1].after_s == pytest.approx(62 / 15)
    assert {topics.CAMERA_INFO, topics.POI} <= recording.once.keys()


def test_a_recording_without_what_a_stage_needs_is_refused(tmp_path):
    with McapRecorder(tmp_path / "empty.mcap"):
        pass
    with pytest.raises(RecordingError, match=r"empty\.mcap' holds 0 frames with all of camera/frame; 40 are needed"):
        read_recording(tmp_path / "empty.mcap", topics.INPUTS["tracker"])


def recorded(path, frames):
    with McapRecorder(path) as recorder:
        for frame in frames:
            label = codec.encoding_of(type(frame))
            recorder.write(RawMessage("deixis/r1/camera/frame", label, codec.encode(frame), frame.stamp_ns))
    return path


def frames_at(*times_s, **changes):
    return [FRAME.model_copy(update={"seq": seq, "stamp_ns": round(at_s * 1e9), **changes}) for seq, at_s in enumerate(times_s)]


def test_a_recording_that_is_too_short_for_the_checks_is_refused(tmp_path):
    path = recorded(tmp_path / "short.mcap", frames_at(*(seq / 30 for seq in range(39))))
    with pytest.raises(RecordingError, match="holds 39 frames"):
        read_recording(path, topics.INPUTS["tracker"])


def test_of_a_long_recording_only_what_is_fed_is_kept_and_its_holes_are_short(tmp_path):
    times_s = [*(seq / 30 for seq in range(10)), *(3600 + seq / 30 for seq in range(100))]
    moments = read_recording(recorded(tmp_path / "long.mcap", frames_at(*times_s)), topics.INPUTS["tracker"]).moments
    assert len(moments) == 64
    assert moments[-1].after_s == pytest.approx(62 / 30 + 0.5)


def test_frames_whose_picture_cannot_be_read_are_not_fed(tmp_path):
    good = frames_at(*(seq / 30 for seq in range(40)))
    bad = frames_at(2.0, 2.1, encoding="jpeg", data=b"\xff\xd8 of no picture")
    moments = read_recording(recorded(tmp_path / "a.mcap", [*good, *bad]), topics.INPUTS["tracker"]).moments
    assert len(moments) == 40


def test_a_picture_is_fed_raw_and_as_jpeg_however_it_was_recorded():
    jpeg = jpeg_frame(raw := FRAME.model_copy(update={"encoding": "bgr8", "width": 16, "height": 8, "data": b"\x80" * 384}))
    assert jpeg.encoding == "jpeg"
    assert raw_frame(jpeg) == raw
    assert (jpeg_frame(jpeg), raw_frame(raw)) == (jpeg, raw)


@pytest.mark.parametrize("topic", [topic for inputs in topics.INPUTS.values() for topic in inputs], ids=lambda t: t.path)
def test_all_garbage_is_refused(topic):
    valid = SAMPLE[topic.type.__name__]
    garbage = list(garbage_for(topic, valid))
    assert len(garbage) > 10
    for label, payload in garbage:
        with pytest.raises(codec.CodecError):
            codec.decode(topic.type, payload, label, max_bytes=topic.max_bytes)


def test_a_watched_stage_was_fed_what_came_on_the_last_of_its_inputs():
    watched = phase([heard(source(4), 0.3, key="tracker/tracks"), answer(4, 0.4)], frames=0)
    assert fed_of(watched, "gesture") == [Fed(FrameId(1, 4), 1_004, 0.3)]


def test_junit_that_cannot_be_written_is_an_error(tmp_path):
    with pytest.raises(OSError, match="No such file"):
        write_junit(tmp_path / "none" / "report.xml", "gesture", [Result("a", "passed", "b")], 1.0)


def test_junit_is_xml_whatever_a_stage_has_printed(tmp_path):
    write_junit(tmp_path / "a.xml", "gesture", [Result("starts", "failed", "its log: \x1b[31mno\0 model\ud800 é", "b")], 1.0)
    assert ElementTree.parse(tmp_path / "a.xml").find("testcase/failure").get("message") == "its log: [31mno model é"


# --- a stage that runs already ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("stage", topics.STAGES)
def test_beside_a_running_stage_no_key_is_heard_twice_and_frames_only_by_whom_they_concern(stage):
    keys = [zenoh.KeyExpr(key) for key in watched_keys("r1", stage)]
    assert not [pair for pair in combinations(keys, 2) if pair[0].intersects(pair[1])]

    def hears(topic):
        return any(key.intersects(zenoh.KeyExpr(topic.key("r1", id="*", stage=stage))) for key in keys)

    # A subscription that takes in frames is denied whole to viewers and robots.
    assert hears(topics.FRAME) == (stage in ("camera", "tracker"))
    assert all(hears(topic) for topic in topics.INPUTS[stage] if topic is not topics.FRAME)
    assert hears(topics.HEALTH)


@pytest.mark.parametrize(("outcome", "verdict"), [("skipped", "was not seen at work"), ("passed", "keeps the contract")])
def test_a_stage_that_was_not_seen_at_work_is_not_said_to_keep_the_contract(outcome, verdict, capsys):
    results = [Result("liveliness", "passed", "its token stands"), Result("answers", outcome, "nothing came", "")]
    print_report("gesture", results, 1.0)
    assert f"gesture: {verdict} (" in capsys.readouterr().out
    assert unseen(results) == (outcome == "skipped")


def test_a_frame_that_was_on_its_way_when_the_look_began_is_no_stranger_but_one_of_another_run_is():
    def looked(*others):
        fed = [Fed(FrameId(1, seq), 1_000 + seq, seq * 0.1) for seq in range(4, 14)]
        return Phase("watched", 0.4, 2.0, fed, [*others, *(answer(seq, seq * 0.1 + 0.02) for seq in range(4, 14))], True)

    assert outcomes(check_answers("gesture", looked(answer(3, 0.41))))["frame"] == "passed"
    for stranger in (answer(3, 0.41, run=2), answer(14, 0.41)):
        assert outcomes(check_answers("gesture", looked(stranger)))["frame"] == "failed"
