"""When a played source is done, and what is kept of one that never is."""

import gc
import sys

from deixis_cli.inbox import Received
from deixis_cli.play import MAX_TARGETS, Playback
from deixis_cli.play_end import GRACE_S, PlayEnd
from deixis_runtime.host import HostOptions
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, Target, Tracks
from deixis_schemas.samples import FRAME, SAMPLES

ALL = ("camera", "tracker", "headpose", "gesture", "fusion")


def camera(state, last_seq=-1, reason=""):
    content = {"stamp_ns": 1, "stage": "camera", "instance": "c", "source": "clip.mp4", "run": FRAME.run}
    return CameraInfo(**content, state=state, reason=reason, last_seq=last_seq)


def frame(seq):
    return FRAME.model_copy(update={"seq": seq})


def tracks(seq):
    return Tracks(stamp_ns=1, stage="tracker", instance="t", run=FRAME.run, seq=seq, width=2, height=2)


def test_a_run_is_over_when_each_stage_has_answered_the_last_frame():
    end = PlayEnd(("camera", "tracker"))
    end.hear(topics.CAMERA_INFO, camera("ended", last_seq=5), 10.0)
    end.hear(topics.FRAME, frame(5), 10.0)
    end.hear(topics.TRACKS, tracks(4), 10.0)
    assert not end.is_over(10.1)
    assert end.unanswered() == ["tracker/tracks"]
    end.hear(topics.TRACKS, tracks(5), 10.2)
    assert end.is_over(10.2)


def test_stages_that_do_not_run_are_not_waited_for():
    end = PlayEnd(("camera",))
    end.hear(topics.FRAME, frame(5), 10.0)
    end.hear(topics.CAMERA_INFO, camera("ended", last_seq=5), 10.0)
    assert end.is_over(10.0)


def test_an_answer_that_never_comes_is_waited_for_a_bounded_time():
    end = PlayEnd(ALL)
    end.hear(topics.CAMERA_INFO, camera("ended", last_seq=5), 10.0)
    end.hear(topics.CAMERA_INFO, camera("ended", last_seq=5), 10.0 + GRACE_S - 0.1)  # repeated, as the camera does
    assert not end.is_over(10.0 + GRACE_S - 0.1)
    assert end.is_over(10.0 + GRACE_S + 0.1)


def test_a_camera_that_streams_again_takes_the_end_back():
    end = PlayEnd(("camera",))
    end.hear(topics.CAMERA_INFO, camera("ended", last_seq=5), 10.0)
    end.hear(topics.CAMERA_INFO, camera("streaming"), 11.0)
    assert not end.is_over(99.0)


def test_a_retrying_camera_is_no_failure_and_a_failed_one_tells_its_reason():
    end = PlayEnd(("camera",))
    end.hear(topics.CAMERA_INFO, camera("retrying", reason="unplugged"), 10.0)
    assert end.failure() is None
    end.hear(topics.CAMERA_INFO, camera("failed", reason="not a video"), 11.0)
    assert end.failure() == "not a video"


def test_of_the_answers_to_a_source_without_an_end_a_thousand_are_kept_and_they_are_small():
    """Kept as objects, they took 35 kB each: 30 MB an hour of a looped clip."""
    answer = next(message for message in SAMPLES if type(message) is Target).model_copy(update={"final": True})
    playback = Playback(HostOptions(robot="r", stages=ALL), None, None)

    def answer_to(number):
        target = answer.model_copy(update={"episode_id": f"e{number}"}, deep=True)
        playback._take(Received(topics.TARGET.key("r"), topics.TARGET, target, number))

    answer_to(0)
    gc.collect()
    before = sys.getallocatedblocks()
    for number in range(1, 2 * MAX_TARGETS):
        answer_to(number)
    gc.collect()
    assert (sys.getallocatedblocks() - before) / MAX_TARGETS < 10
    kept = playback.finish(1.0).targets
    assert [target.episode_id for target in kept] == [f"e{number}" for number in range(MAX_TARGETS, 2 * MAX_TARGETS)]
    assert kept[0] == answer.model_copy(update={"episode_id": f"e{MAX_TARGETS}"})
