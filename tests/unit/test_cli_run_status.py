"""Exit statuses and words of `deixis run`."""

import json
import signal

import pytest
from deixis_cli.live_view import LineView
from deixis_cli.play import PlayResult
from deixis_cli.run import document, exit_status, print_answers
from deixis_cli.summary import Summary
from deixis_cli.wording import target_line
from deixis_schemas.samples import FRAME, SAMPLES
from rich.console import Console

TARGET = next(message for message in SAMPLES if type(message).__name__ == "Target")
HEALTH = next(message for message in SAMPLES if type(message).__name__ == "Health")
CAMERA = next(message for message in SAMPLES if type(message).__name__ == "CameraInfo")
NAMES = {"vase": "the blue vase"}


def status(result, *, endless=False, expected=None):
    return exit_status(result, endless=endless, expected=expected)


def test_a_run_that_did_its_job_succeeds(capsys):
    assert status(PlayResult(frames=9)) == 0
    assert capsys.readouterr().err == ""


def test_a_failure_is_told_on_standard_error_and_gives_status_1(capsys):
    assert status(PlayResult(frames=9, failure="camera is given up")) == 1
    assert "camera is given up" in capsys.readouterr().err


@pytest.mark.parametrize(("number", "expected"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupt_before_the_end_gives_the_shells_status(number, expected, capsys):
    assert status(PlayResult(frames=9, signal=number)) == expected
    assert "before the end" in capsys.readouterr().err


def test_an_interrupt_is_the_good_end_of_a_source_without_one():
    assert status(PlayResult(frames=9, signal=signal.SIGINT), endless=True) == 0
    assert status(PlayResult(frames=0, signal=signal.SIGINT), endless=True) == 130


@pytest.mark.parametrize(
    ("answers", "expected"),
    [([["vase"]], 0), ([["door"]], 1), ([["vase", "door"]], 1), ([["vase"], ["vase"]], 1), ([[]], 1), ([], 1)],
)
def test_the_expected_poi_has_to_be_the_one_and_only_answer(answers, expected):
    targets = [TARGET.model_copy(update={"poi_ids": poi_ids}) for poi_ids in answers]
    assert status(PlayResult(frames=9, targets=targets), expected="vase") == expected


def test_the_answer_is_printed_with_name_belief_conflict_and_reason():
    console = Console(record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    print_answers(console, PlayResult(frames=9, targets=[TARGET], counters={"Belief": 9, "rejected": 2}), NAMES)
    text = console.export_text()
    for part in ("the blue vase (vase)", "belief 0.900", "conflict 0.000", TARGET.reason, "9 answered", "2 messages refused"):
        assert part in text


@pytest.mark.parametrize(
    ("answered", "fusion", "said", "unsaid"),
    [
        (0, {"state": "degraded", "reason": "tracker is dead"}, "fusion is degraded: tracker is dead", "too slow"),
        (0, None, "9 frames in 0.0 s, 0 answered.", "too slow"),
        (2, {"state": "ok"}, "Only 22% of the frames were answered: this machine is too slow", "No frame was"),
    ],
)
def test_where_frames_go_unanswered_it_is_said_whose_fault_it_is(answered, fusion, said, unsaid):
    console = Console(record=True, file=open("/dev/null", "w"), width=200)  # noqa: SIM115
    health = {} if fusion is None else {"fusion": HEALTH.model_copy(update=fusion)}
    print_answers(console, PlayResult(frames=9, health=health, counters={"Belief": answered}), NAMES)
    text = console.export_text()
    assert said in text
    assert unsaid not in text


def test_a_recording_without_frames_is_told_of_as_well():
    console = Console(record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    print_answers(console, PlayResult(frames=0, counters={"Belief": 9}), NAMES)
    assert "Nobody was seen pointing." in (text := console.export_text())
    assert "9 frames in 0.0 s, 9 answered." in text


def test_the_json_document_can_be_read_and_holds_the_answers():
    result = PlayResult(frames=9, targets=[TARGET], camera=CAMERA, counters={"Frame": 9}, wall_s=1.23456)
    read = json.loads(json.dumps(document("r1", "rtsp://user:secret@host/", result)))
    assert read["answers"][0]["poi_ids"] == ["vase"]
    assert (read["robot"], read["source"], read["frames"], read["wall_s"]) == ("r1", CAMERA.source, 9, 1.235)


def test_a_target_without_an_answer_says_so():
    assert "no answer" in target_line(TARGET.model_copy(update={"poi_ids": []}), NAMES)
    assert "the blue vase (vase) (probability 0.97, belief 0.90" in target_line(TARGET, NAMES)


def test_a_line_tells_what_each_stage_sees():
    summary = Summary(dict(NAMES))
    for message in SAMPLES:
        summary.hear(message)
    line = summary.line()
    for part in (
        "frame 7",
        "face",
        "+58±4°",
        "out of range right",
        "stroke point_left +62±15°, index finger",
        "the blue vase (vase) 0.97",
        "without headpose",
    ):
        assert part in line


def test_rate_and_drops_are_those_of_the_clip():
    summary = Summary({})
    belief = next(message for message in SAMPLES if type(message).__name__ == "Belief")
    for seq in range(61):
        of_frame = {"seq": seq, "stamp_ns": 10**18 + seq * 50_000_000}
        summary.hear(FRAME.model_copy(update=of_frame))
        if seq % 6:
            summary.hear(belief.model_copy(update=of_frame))
    assert summary.rate_hz() == pytest.approx(20)
    assert summary.clip_s == pytest.approx(3.0)
    assert summary.drops() == 10  # 11 unanswered, of which the last may still be on its way


def test_lines_are_printed_although_fusion_answers_nothing():
    console = Console(record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    view = LineView(console, {}, ("camera", "fusion"))
    for seq in range(91):
        view.hear("", FRAME.model_copy(update={"seq": seq, "stamp_ns": 10**18 + seq * 33_333_333}))
    assert 2 <= len(console.export_text().splitlines()) <= 6
