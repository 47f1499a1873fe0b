"""Every stage, given what it was given, answers the shipped clips as it did: within the tolerances of `differences.py`."""

from pathlib import Path

import pytest
from deixis_evaluation.clips import load_clips
from deixis_evaluation.differences import differences
from deixis_evaluation.references import HOW_TO_RENEW, read_reference, replay_given
from deixis_evaluation.replay import REPLAYS
from deixis_schemas import topics

CLIPS = {clip.name: clip for clip in load_clips(Path(__file__).parents[2] / "examples" / "clips")}
REFERENCES = Path(__file__).parent / "references"


@pytest.mark.parametrize("stage", REPLAYS)
@pytest.mark.parametrize("name", CLIPS)
def test_a_stage_answers_a_clip_as_its_reference_does(name: str, stage: str) -> None:
    found = differences(stage, read_reference(REFERENCES, name, stage), replay_given(CLIPS[name], stage, REFERENCES))
    assert not found, "\n".join([f"clip {name}", *map(str, found), HOW_TO_RENEW])


def test_every_clip_has_a_reference_for_every_stage_behind_the_camera() -> None:
    assert tuple(REPLAYS) == topics.STAGES[1:]
    wanted = {f"{name}.{stage}.xz" for name in CLIPS for stage in REPLAYS}
    assert {path.name for path in REFERENCES.iterdir()} == wanted
