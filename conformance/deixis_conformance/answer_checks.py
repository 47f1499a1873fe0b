"""What a stage answers to frames: which, when, by which names, and when it should not. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import quantiles

from deixis_schemas import topics
from deixis_schemas.messages import FrameId, OfFrame

from .observation import Answer, Fed, Phase, answers, decoded, outputs_of
from .results import Result, judged

ENOUGH_ANSWERED = 0.5
"""Share of frames: a slow stage may leave frames out, but has to keep up with half of fifteen a second."""

SUBSCRIBED = "is it subscribed to the keys of this robot? Does its log say why?"
ANSWER_ALL = "answer every frame that you work on, also with an empty list, within {limit:g} s"
NAME_FRAME = "repeat `run` and `seq` of the frame that is answered"
REPEAT_STAMP = "repeat `stamp_ns` of the frame: it is when the picture was taken, not when the answer was made"
ANSWER_ONCE = "one answer for a frame: fusion takes the first and drops the rest"
BEGIN_ANEW = "another `run` is a camera that began again, also where `seq` is smaller: forget, and answer"
READ_JPEG = "read `encoding`: on one host frames are bgr8 or mono8, over a link the camera sends jpeg"
GO_ON = "count and report what is wrong, and go on with the next message"
DROP_OLD = "drop what is older than the topic allows ({limit:g} s): a link that was cut gives out what it held back"
NEWEST = "keep the newest of each input only (zenoh: RingChannel(1), or a slot that the callback overwrites)"
NOTHING_ELSE = "answer each frame once, and nothing else"


def check_answers(stage: str, phase: Phase) -> list[Result]:
    """Whether the frames of a phase were answered, in time, each once, by their own names."""
    found = answers(stage, phase)
    if not found:
        paths, long_s = _paths(stage), phase.ended_s - phase.began_s
        wrong = f"nothing on {paths} about {len(phase.fed)} frames within {long_s:.1f} s"
        return [Result("answers", "failed", wrong, SUBSCRIBED)]
    return [
        _check_share(stage, phase, found),
        judged("frame", "each answer names a frame that was there", _stranger(phase, found), NAME_FRAME),
        judged("stamp", "each answer repeats the stamp of its frame", _wrong_stamp(phase, found), REPEAT_STAMP),
        judged("once", "each frame is answered once", _twice(found), ANSWER_ONCE),
    ]


def check_new_run(stage: str, phase: Phase) -> list[Result]:
    """Whether the stage goes on when the camera begins anew."""
    runs = {item.frame_id.run for item in phase.fed}
    good = any(answer.message.run in runs for answer in answers(stage, phase))
    wrong = None if good else "answers nothing when the camera begins anew"
    return [judged("new run", "answers frames of a new run", wrong, BEGIN_ANEW)]


def check_jpeg(stage: str, phase: Phase) -> list[Result]:
    """Whether JPEG frames are answered."""
    wrong = None if answers(stage, phase) else "answers no frame that is a JPEG"
    return [judged("jpeg", "answers frames that are JPEGs", wrong, READ_JPEG)]


def check_survived(name: str, what: str, stage: str, phase: Phase, after: Phase) -> list[Result]:
    """Whether the stage lives and answers after something was done to it in `phase`."""
    wrong = None
    if not (phase.running and after.running):
        wrong = f"its process ends on {what}"
    elif not answers(stage, after):
        wrong = f"answers nothing any more after {what}"
    return [judged(name, f"answers as before after {what}", wrong, GO_ON)]


def check_old(stage: str, phase: Phase) -> list[Result]:
    """Whether frames that come far too late are left alone. `phase.fed` are those."""
    late = {item.frame_id for item in phase.fed}
    answered = {answer.message.frame_id for answer in answers(stage, phase)} & late
    limit = limit_s(stage)
    wrong = f"answers {len(answered)} of {len(late)} frames that came too late" if answered else None
    return [judged("age", f"leaves alone what is older than {limit:g} s", wrong, DROP_OLD.format(limit=limit))]


def check_backlog(stage: str, phase: Phase) -> list[Result]:
    """Whether the newest of a burst of frames is answered soon, and not after all those before it."""
    found, last = answers(stage, phase), phase.fed[-1]
    took_s = next((answer.at_s - last.at_s for answer in found if answer.message.frame_id == last.frame_id), None)
    many = f"the last of {len(phase.fed)} frames at once"
    if took_s is None:
        return [Result("backlog", "failed", f"does not answer {many}", NEWEST)]
    said = f"answers {many} after {max(0.0, took_s) * 1e3:.0f} ms ({len({a.message.frame_id for a in found})} answered)"
    return [judged("backlog", said, said if took_s > limit_s(stage) else None, NEWEST)]


def check_silence(stage: str, phase: Phase) -> list[Result]:
    """Whether the stage is quiet where nothing is fed."""
    found = answers(stage, phase)
    wrong = f"{len(found)} answers while nothing was fed" if found else None
    return [judged("silence", "says nothing of frames that are not there", wrong, NOTHING_ELSE)]


def limit_s(stage: str) -> float:
    """How old an input of the stage may be at most, seconds."""
    return max(topic.max_age_s or 0.0 for topic in topics.INPUTS[stage])


def fed_of(phase: Phase, stage: str) -> list[Fed]:
    """Of a stage in a running system: the frames that others spoke of in this phase, by the last of its inputs to come."""
    inputs = [topic for topic in topics.INPUTS[stage] if topic.max_age_s is not None]
    good, _ = decoded([item for item in phase.heard if inputs and item.topic is inputs[-1]])
    return [Fed(message.frame_id, message.stamp_ns, item.at_s) for item, message in good if isinstance(message, OfFrame)]


def _check_share(stage: str, phase: Phase, found: Sequence[Answer]) -> Result:
    at_s = {item.frame_id: item.at_s for item in phase.fed}
    took_s = [answer.at_s - at_s[answer.message.frame_id] for answer in found if answer.message.frame_id in at_s]
    share = len({answer.message.frame_id for answer in found} & at_s.keys()) / max(1, len(at_s))
    p95_s = quantiles(took_s, n=20)[-1] if len(took_s) > 1 else sum(took_s)
    limit = min(topic.max_age_s or float("inf") for topic in outputs_of(stage))
    said = f"{share:.0%} of {len(at_s)} frames answered on {_paths(stage)}, 95 % of them within {max(0.0, p95_s) * 1e3:.0f} ms"
    good = share >= ENOUGH_ANSWERED and p95_s <= limit
    return judged("answers", said, None if good else said, ANSWER_ALL.format(limit=limit))


def _stranger(phase: Phase, found: Sequence[Answer]) -> str | None:
    there = {item.frame_id for item in phase.fed}
    first = phase.fed[0].frame_id
    # What was on its way to the stage when the phase began is no stranger.
    answered = [answer.message.frame_id for answer in found]
    known = {frame for frame in answered if frame.run == first.run and frame.seq < first.seq}
    stranger = next((frame for frame in answered if frame not in there | known), None)
    return None if stranger is None else f"answers {_say(stranger)}, which was not there"


def _wrong_stamp(phase: Phase, found: Sequence[Answer]) -> str | None:
    stamps = {item.frame_id: item.stamp_ns for item in phase.fed}
    for message in (answer.message for answer in found):
        captured_ns = stamps.get(message.frame_id, message.stamp_ns)
        if message.stamp_ns != captured_ns:
            return f"{_say(message.frame_id)} was captured at {captured_ns}, its answer says {message.stamp_ns}"
    return None


def _twice(found: Sequence[Answer]) -> str | None:
    counts = Counter((answer.topic.path, answer.message.frame_id) for answer in found)
    twice = [frame_id for (_, frame_id), count in counts.items() if count > 1]
    return f"{len(twice)} frames are answered more than once, the first {_say(twice[0])}" if twice else None


def _paths(stage: str) -> str:
    return ", ".join(topic.path for topic in outputs_of(stage))


def _say(frame_id: FrameId) -> str:
    return f"frame {frame_id.seq} of run {frame_id.run}"
