"""Scoring clip after clip, and what is left of it when somebody stops it."""

import os
import signal
from dataclasses import dataclass
from types import SimpleNamespace

import pytest
from deixis_evaluation.scored_clips import score_each

CLIPS = [SimpleNamespace(name=f"c{number}", truth=SimpleNamespace(frames=[None] * 4)) for number in range(3)]


@dataclass(frozen=True)
class Score:
    name: str
    failure: str | None = None


def score(clip, on_frame):
    for _ in clip.truth.frames:
        on_frame()
    return Score(clip.name)


def test_all_clips_are_scored_in_their_order(capsys):
    scored = score_each(CLIPS, score)
    assert ([item.name for item in scored.scores], scored.left, scored.status()) == (["c0", "c1", "c2"], 0, 0)
    assert "before the end" not in capsys.readouterr().err


def test_a_clip_that_was_not_played_is_said_and_counts(capsys):
    scored = score_each(CLIPS, lambda clip, _: Score(clip.name, "no such file" if clip.name == "c1" else None))
    assert scored.status() == 1
    told = capsys.readouterr().err
    assert "c1: no such file" in told
    assert "1 of 3 clips were not played" in told


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_what_was_scored_before_a_signal_is_kept_and_the_clip_it_came_in_is_not(number, capsys):
    def stopped_in_the_second(clip, on_frame):
        on_frame()
        if clip.name == "c1":
            os.kill(os.getpid(), number)
        return score(clip, on_frame)

    scored = score_each(CLIPS, stopped_in_the_second)
    assert [item.name for item in scored.scores] == ["c0"]
    assert scored.left == 2
    assert scored.status() == 128 + number
    said = f"stopped by {number.name} before the end, after 1 of 3 clips; the figures are those of these"
    assert said in capsys.readouterr().err
