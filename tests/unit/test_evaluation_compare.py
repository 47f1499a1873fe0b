"""Two recorded runs beside each other."""

import argparse
import json

import pytest
from deixis_cli.mcap_file import McapRecorder
from deixis_cli.options import CommandError
from deixis_cli.raw_message import RawMessage
from deixis_evaluation.compare_command import compare, read_run, register
from deixis_schemas import codec, topics
from deixis_schemas.messages import HeadPoses, Producer
from deixis_schemas.samples import FRAME, SAMPLES

BELIEF = next(message for message in SAMPLES if type(message).__name__ == "Belief")


def poses(seq, yaw_deg, run=1, instance="a"):
    frame = FRAME.model_copy(update={"run": run, "seq": seq, "stamp_ns": FRAME.stamp_ns + seq * 33_000_000})
    pose = {"person_id": 0, "status": "tracking", "yaw_deg": yaw_deg, "yaw_sigma_deg": 3.0}
    return HeadPoses.derive(frame, Producer("headpose", instance), poses=[pose])


def recording(path, messages, garbage=0):
    with McapRecorder(path) as recorder:
        for at, message in enumerate(messages):
            topic = next(topic for topic in topics.TOPICS if topic.type is type(message))
            recorder.write(RawMessage(topic.key("r1"), codec.encoding_of(type(message)), codec.encode(message), at * 5_000_000))
        for _ in range(garbage):
            recorder.write(RawMessage(topics.TRACKS.key("r1"), codec.encoding_of(HeadPoses), b"\x00", 10**9))
    return path


def command(*arguments):
    parser = argparse.ArgumentParser()
    register(parser.add_subparsers())
    given = parser.parse_args(["compare", *map(str, arguments)])
    return given.run(given)


@pytest.fixture
def first(tmp_path):
    return recording(tmp_path / "first.mcap", [poses(seq, 10.0) for seq in range(100)])


def test_a_run_is_equal_to_itself_whatever_its_process_its_run_and_its_clock(tmp_path, first, capsys):
    again = [poses(seq, 10.0, run=2, instance="b") for seq in range(100)]
    again = [message.model_copy(update={"stamp_ns": message.stamp_ns + 10**12}) for message in again]
    assert command(first, recording(tmp_path / "second.mcap", again), "--exact") == 0
    assert capsys.readouterr().out.splitlines()[0] == "headpose: 100 messages, all equal"


def test_small_differences_are_within_tolerance_unless_none_is_allowed(tmp_path, first, capsys):
    second = recording(tmp_path / "second.mcap", [poses(seq, 10.5) for seq in range(100)])
    assert command(first, second) == 0
    assert "100 not equal, within the tolerances" in capsys.readouterr().out
    assert command(first, second, "--exact") == 1


def test_a_head_that_turns_elsewhere_is_named_with_its_first_frame(tmp_path, first, capsys):
    second = recording(tmp_path / "second.mcap", [poses(seq, 10.0 if seq < 90 else 60.0) for seq in range(100)])
    assert command(first, second) == 1
    out = capsys.readouterr().out
    assert "headpose: 100 messages, 10 not equal" in out
    assert "yaw_deg differs by more than 1.5 in 10 of 100 frames (2 allowed), first in frame 90" in out


def test_a_lost_frame_puts_no_other_out_of_place(tmp_path, first):
    second = recording(tmp_path / "second.mcap", [poses(seq, 10.0) for seq in range(100) if seq != 5])
    (stage,) = compare(read_run(first), read_run(second))
    assert (stage.messages, stage.unequal) == ((100, 99), 1)
    assert stage.differs(exact=False), "a frame that is answered in one run alone is a difference"


def test_later_runs_and_broken_messages_are_left_out_and_counted(tmp_path, first, capsys):
    messages = [*(poses(seq, 10.0) for seq in range(100)), *(poses(seq, 50.0, run=2) for seq in range(7))]
    second = recording(tmp_path / "second.mcap", messages, garbage=3)
    assert command(first, second, "--json") == 0
    document = json.loads(capsys.readouterr().out)
    assert (document["later"], document["unreadable"], document["differs"]) == ([0, 7], [0, 3], False)


def test_the_time_to_an_answer_is_from_the_first_word_about_the_frame_to_its_belief(tmp_path):
    belief = BELIEF.model_copy(update={"run": 1, "seq": 0})
    run = read_run(recording(tmp_path / "a.mcap", [poses(0, 1.0), poses(1, 1.0), belief]))
    assert run.took_ms() == [10.0]


def test_what_holds_no_answers_is_refused_by_name(tmp_path, first):
    empty = recording(tmp_path / "empty.mcap", [])
    with pytest.raises(CommandError, match=r"empty\.mcap' holds no answers"):
        command(first, empty)
    with pytest.raises(CommandError, match=r"none\.mcap"):
        command(first, tmp_path / "none.mcap")


def test_a_recording_that_was_cut_off_is_said_to_be_and_what_it_holds_is_compared(tmp_path, first, capsys):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(first.read_bytes()[:-10])
    assert command(first, cut) == 0
    said = capsys.readouterr()
    assert said.err == f"deixis compare: '{cut}' was cut off while it was written; what it holds is used\n"
    assert said.out.splitlines()[0] == "headpose: 100 messages, all equal"
