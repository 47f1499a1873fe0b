"""The first final answer, heard or remembered, and whether it is the one expected."""

import pytest
from deixis_cli.first_answer import ASK_EVERY_S, FirstAnswer
from deixis_cli.main import main
from deixis_schemas.messages import State
from deixis_schemas.samples import SAMPLES

TARGET = next(message for message in SAMPLES if type(message).__name__ == "Target")
FINAL, UPDATE = (TARGET.model_copy(update={"final": final}) for final in (True, False))
OTHER = FINAL.model_copy(update={"poi_ids": ["door"]})


def state(*targets):
    return State(
        stamp_ns=1, stage="fusion", instance="a", robot="r1", sources=[], pois=[], persons=[], recent_targets=list(targets)
    )


def test_an_update_is_no_answer_and_the_first_final_one_is_kept():
    first = FirstAnswer()
    for message in (None, UPDATE, state(), FINAL, OTHER, state(OTHER)):
        first.hear(message)
    assert first.target == FINAL


def test_an_answer_given_before_we_came_is_found_in_the_state_the_oldest_first():
    first = FirstAnswer()
    first.hear(state(FINAL, OTHER))
    assert first.target == FINAL


def test_the_state_is_asked_for_at_once_and_again_until_there_is_an_answer():
    first = FirstAnswer()
    assert [first.should_ask(now_s) for now_s in (7.0, 7.1, 7.0 + ASK_EVERY_S, 7.1 + ASK_EVERY_S)] == [True, False, True, False]
    first.hear(FINAL)
    assert not first.should_ask(100.0)


@pytest.mark.parametrize(
    ("target", "expected", "said"),
    [
        (None, None, "no final answer"),
        (FINAL, None, ""),
        (FINAL, "vase", ""),
        (OTHER, "vase", "the one answer 'vase'"),
    ],
)
def test_another_answer_than_expected_or_none_is_a_problem(target, expected, said):
    first = FirstAnswer()
    first.hear(target)
    problem = first.problem(expected)
    assert said in problem
    assert bool(problem) == bool(said)


def test_an_expectation_without_an_end_is_refused(capsys):
    assert main(["watch", "--robot", "r1", "--expect", "vase"]) == 1
    assert "--until-answer" in capsys.readouterr().err
