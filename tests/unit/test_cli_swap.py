"""What `deixis swap` makes of what it hears: whether a newcomer is fit, and what a swap has cost."""

import pytest
from deixis_cli import newcomer as newcomers
from deixis_cli.gets import Refusal
from deixis_cli.main import main
from deixis_cli.newcomer import SupervisedNewcomer
from deixis_cli.standby_exam import ENOUGH_FRAMES, StandbyExam
from deixis_cli.swap_count import SwapCount
from deixis_schemas import codec, topics
from deixis_schemas.messages import FrameId, HeadPoses, Voice

LABEL = codec.encoding_of(HeadPoses)


def poses(seq, instance, run=1, stamp_ns=None):
    stamp_ns = 1000 + seq if stamp_ns is None else stamp_ns
    return HeadPoses(run=run, seq=seq, stamp_ns=stamp_ns, stage="headpose", instance=instance)


def examined(answers, frames=range(ENOUGH_FRAMES + 1)):
    """The exam of a newcomer that says these answers, (payload, label) by seq, while the old one answers all frames."""
    exam = StandbyExam(topics.HEAD_POSES, "new")
    for seq in frames:
        for answer in answers(seq):
            exam.hear_new(*answer)
        exam.hear_old(poses(seq, "old"))
    return exam


def sound(seq):
    return [(codec.encode(poses(seq, "new")), LABEL)]


def test_a_newcomer_that_answers_what_the_old_one_answers_is_fit():
    exam = examined(sound)
    assert exam.enough()
    assert exam.verdict() == ""


@pytest.mark.parametrize(
    ("answers", "said"),
    [
        (lambda _: [(b"garbage", LABEL)], "its messages break the contract"),
        (lambda seq: [(codec.encode(poses(seq, "new")), "application/msgpack;HeadPoses/1")], "its messages break the contract"),
        (lambda seq: [(codec.encode(poses(seq, "me")), LABEL)], "it names itself 'me', and its token says 'new'"),
        (lambda seq: sound(seq) * 2, "it answers a frame twice: seq 0 of run 1"),
        (lambda seq: sound(seq) if seq % 3 == 0 else [], "it answers 7 frames while 21 are answered"),
        (lambda seq: [(codec.encode(poses(seq, "new", stamp_ns=5)), LABEL)], "does not repeat the frame's stamp_ns"),
        (lambda _: [], "it says nothing aside, while 21 frames were answered"),
    ],
)
def test_what_a_newcomer_does_wrong_is_named(answers, said):
    assert said in examined(answers).verdict()


def test_a_newcomer_that_lags_is_not_fit():
    exam = StandbyExam(topics.HEAD_POSES, "new")
    for seq in range(100):
        exam.hear_old(poses(seq, "old"))
        if seq >= 50:
            exam.hear_new(*sound(seq - 50)[0])
    assert exam.verdict() == "it is 50 frames behind"


def test_without_frames_nobody_is_seen_at_work():
    exam = StandbyExam(topics.HEAD_POSES, "new")
    assert not exam.enough()
    assert "start the camera first" in exam.verdict()


def counted(of_old, of_new, given=range(30)):
    count = SwapCount("old", "new")
    for seq in given:
        count.give(FrameId(1, seq))
        for instance, seqs in (("old", of_old), ("new", of_new)):
            if seq in seqs:
                count.hear(FrameId(1, seq), instance, seq / 10)
    return count.cost()


def test_a_swap_between_two_frames_costs_nothing():
    cost = counted(range(2, 15), range(15, 29))
    assert (cost.gap_frames, cost.twice, cost.unanswered, cost.answered) == (0, 0, 0, 27)
    assert cost.gap_s == pytest.approx(0.1)
    assert cost.usual_s == pytest.approx(0.1)


def test_frames_that_nobody_answers_and_those_that_both_do_are_counted():
    assert counted(range(15), range(18, 30)).gap_frames == 3
    assert counted(range(15), range(18, 30)).unanswered == 3
    assert counted(range(15), range(13, 30)).twice == 2
    assert counted({*range(15)} - {4}, range(15, 30)).gap_frames == 0
    assert counted({*range(15)} - {4}, range(15, 30)).unanswered == 1


def test_frames_that_the_stage_was_not_given_are_not_missed():
    given = [seq for seq in range(30) if seq not in (15, 16)]
    assert counted(range(15), range(17, 30), given).gap_frames == 0


def test_the_cost_is_not_known_where_one_of_the_two_was_not_heard():
    assert counted(range(0), range(5)) is None


@pytest.mark.parametrize(("stage", "why"), [("fusion", "registry"), ("camera", "device")])
def test_a_stage_that_cannot_be_swapped_is_refused_with_the_reason(stage, why, capsys):
    assert main(["swap", stage, "--robot", "r1"]) == 1
    said = capsys.readouterr().err
    assert f"{stage} cannot be swapped while it runs" in said
    assert why in said
    assert "restart it" in said


def test_settings_are_for_a_stage_that_is_started_anew(capsys):
    assert main(["swap", "headpose", "--robot", "r1", "--set", "method=affine", "--instance", "x"]) == 1
    assert "a command or instance has its own settings" in capsys.readouterr().err


def test_a_newcomer_that_is_heard_has_not_ended_though_its_supervisor_knows_no_newcomer_any_more(monkeypatch):
    started = Voice(stage="supervisor", instance="s", stamp_ns=1, state="speaks", other="new")
    replies = [([("key", started)], []), *[([], [Refusal("key", "there is no newcomer of headpose")])] * 3]
    monkeypatch.setattr(newcomers, "get_all", lambda *_, **__: replies.pop(0))
    newcomer = SupervisedNewcomer(None, "r1", "headpose", (), "old")
    assert newcomer.instance == "new"
    assert newcomer.ended() == "there is no newcomer of headpose"
    newcomer.keep(lambda: {"new"})
    assert newcomer.ended() == ""
    newcomer.keep(set)
    assert newcomer.ended() == "there is no newcomer of headpose"
