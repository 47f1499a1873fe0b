"""The phases of an examination in their order, each with the checks that it serves."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from deixis_schemas import topics
from deixis_schemas.messages import Poi

from . import answer_checks, camera_checks, health_checks, payload_checks
from .answer_checks import limit_s
from .examination import SETTLE_S, Examination
from .observation import Phase
from .recording import Recording
from .results import Result, judged
from .subject import STOP_WITHIN_S, Subject

START_WITHIN_S = 20.0
FEW, SOME, MANY = 10, 38, 40
BURSTS = 3
QUICK_S = 1 / 30
WATCH_S = 5.0
QUIET_S = 1.2
POLL_S = 0.05
TOKEN_GONE_WITHIN_S = 4.0
JSON = "format=json"
POI_ID = "check"
LET_DELIVER = "let the camera deliver; over a link, by a certificate (--certs) of somebody who may listen"
AS_JSON = "answer in JSON where the selector asks for it"
STORED = "answer a get with a payload on fusion/poi/{id} with the stored POI, when it is on disk"
NAMED = "answer with an error that names the field"
REMOVED = "answer a get with ?op=delete by removing the POI"


def examine_started(exam: Examination, subject: Subject, recording: Recording) -> list[Result]:
    """All checks, of a stage that we have just started and that is alone with us."""
    results = [_starts(exam, subject)]
    if results[0].outcome == "failed":
        return results
    instances = exam.tokens()
    results.append(_liveliness(exam.stage, instances))
    results += _examine_active(exam, recording, instances) if exam.stage != topics.FRAME.stage else _watch_camera(exam)
    results += _ends(exam, subject)
    return results


def examine_running(exam: Examination, recording: Recording) -> list[Result]:
    """Of a stage that runs already: all but what would end it; beside living stages only what can be seen."""
    instances = exam.tokens()
    results = [_liveliness(exam.stage, instances)]
    if exam.stage == topics.FRAME.stage:
        return results + _watch_camera(exam)
    others = exam.others_alive()
    if not others:
        return results + _examine_active(exam, recording, instances)
    results += _watch(exam, instances)
    text = f"not made while {', '.join(others[:4])} speak: nobody is to be fed from two sides"
    return [*results, Result("garbage, age, backlog, runs", "skipped", text, "start the stage alone, or give --command")]


def _examine_active(exam: Examination, recording: Recording, instances: list[str]) -> list[Result]:
    stage, moments = exam.stage, recording.moments
    exam.speak()
    exam.begin_run()
    with exam.phase("at its own rate") as at_rate:
        exam.feed(at_rate, moments[:SOME])
        time.sleep(SETTLE_S)
    results = answer_checks.check_answers(stage, at_rate)
    if results[0].outcome == "failed" and len(results) == 1:
        return results + _common(exam, instances, alone=True)  # who answers nothing cannot be asked more
    results += _new_run_and_jpeg(exam, recording)
    results += _garbage(exam, recording)
    results += _missing_inputs(exam, recording)
    results += _late_and_many(exam, recording)
    if stage == topics.STATE.stage:
        results += _registry(exam)
    return results + _common(exam, instances, alone=True)


def _new_run_and_jpeg(exam: Examination, recording: Recording) -> list[Result]:
    exam.begin_run()
    looks = topics.FRAME in topics.INPUTS[exam.stage]
    with exam.phase("new run") as phase:
        exam.feed(phase, recording.moments[:FEW], every_s=QUICK_S)
        time.sleep(SETTLE_S)
    results = answer_checks.check_new_run(exam.stage, phase)
    if not looks:
        return results
    with exam.phase("jpeg") as phase:
        exam.feed(phase, recording.moments[FEW : 2 * FEW], every_s=QUICK_S, as_jpeg=True)
        time.sleep(SETTLE_S)
    return results + answer_checks.check_jpeg(exam.stage, phase)


def _garbage(exam: Examination, recording: Recording) -> list[Result]:
    before = list(exam.phases)
    with exam.phase("garbage") as garbage:
        exam.put_garbage_on_inputs()
        time.sleep(QUIET_S)  # for a heartbeat that tells of it
    after = _answers_again(exam, recording)
    results = answer_checks.check_survived("garbage", f"{exam.put_garbage} broken messages", exam.stage, garbage, after)
    return results + health_checks.check_says_rejected(exam.stage, before, [garbage, after], exam.put_garbage)


def _missing_inputs(exam: Examination, recording: Recording) -> list[Result]:
    about_frames = [topic for topic in topics.INPUTS[exam.stage] if topic.max_age_s is not None]
    if len(about_frames) < 2:
        return []
    results = []
    for topic in about_frames:
        with exam.phase(f"without {topic.path}") as without:
            exam.feed(without, recording.moments[:FEW], every_s=QUICK_S, without=topic)
            time.sleep(SETTLE_S)
        after = _answers_again(exam, recording)
        results += answer_checks.check_survived("missing input", f"frames without {topic.path}", exam.stage, without, after)
    return results


def _late_and_many(exam: Examination, recording: Recording) -> list[Result]:
    with exam.phase("silence") as silence:
        time.sleep(QUIET_S + limit_s(exam.stage))
    results = answer_checks.check_silence(exam.stage, silence)
    # As a link that was cut and is mended gives out what it held back: stamped right after those before the silence.
    with exam.phase("late") as late:
        exam.feed(late, recording.moments[:FEW], every_s=0.0, late_s=QUIET_S + limit_s(exam.stage))
        time.sleep(SETTLE_S)
    results += answer_checks.check_old(exam.stage, late)
    return results + _burst(exam, recording)


def _burst(exam: Examination, recording: Recording) -> list[Result]:
    """Tried again where it fails: on a busy machine Zenoh may drop the very last of a burst, before the stage has it."""
    results: list[Result] = []
    for _ in range(BURSTS):
        exam.begin_run()
        with exam.phase("burst") as burst:
            exam.feed(burst, recording.moments[:MANY], every_s=0.0)
            time.sleep(1.0 + SETTLE_S)
        results = answer_checks.check_backlog(exam.stage, burst)
        if results[0].outcome == "passed":
            break
    return results


def _answers_again(exam: Examination, recording: Recording) -> Phase:
    with exam.phase("after") as after:
        exam.feed(after, recording.moments[:FEW], every_s=QUICK_S)
        time.sleep(SETTLE_S)
    return after


def _watch(exam: Examination, instances: list[str]) -> list[Result]:
    with exam.phase("watched") as phase:
        time.sleep(WATCH_S)
    phase.fed = answer_checks.fed_of(phase, exam.stage)
    if not phase.fed:
        path = [topic.path for topic in topics.INPUTS[exam.stage] if topic.max_age_s is not None][-1]
        return [Result("answers", "skipped", f"nothing came on {path} within {WATCH_S:g} s", LET_DELIVER)]
    return answer_checks.check_answers(exam.stage, phase) + _common(exam, instances, alone=False)


def _watch_camera(exam: Examination) -> list[Result]:
    with exam.phase("watched"):
        time.sleep(WATCH_S)
    infos, _ = exam.replies(topics.CAMERA_INFO)
    told = [item for phase in exam.phases for item in phase.heard if item.topic is topics.CAMERA_INFO]
    return camera_checks.check_camera(exam.phases, len(told), len(infos)) + _common(exam, exam.tokens(), alone=False)


def _common(exam: Examination, instances: list[str], *, alone: bool) -> list[Result]:
    """What is checked of all that was heard."""
    replies, refused = exam.health_replies()
    ours = [_of_stage(phase, exam.stage) for phase in exam.phases]
    results = payload_checks.check_payloads(exam.stage, exam.phases if alone else ours)
    results += payload_checks.check_producer(exam.stage, ours, instances[0] if len(instances) == 1 else None)
    return results + health_checks.check_health(exam.stage, ours, replies, refused)


def _of_stage(phase: Phase, stage: str) -> Phase:
    """The phase with what came under the stage's own keys alone."""
    return replace(phase, heard=[item for item in phase.heard if item.key.split("/")[2] == stage])


def _starts(exam: Examination, subject: Subject) -> Result:
    began_s = time.monotonic()
    while time.monotonic() - began_s < START_WITHIN_S:
        if not subject.running():
            text = f"it ended with status {subject.status()}: {subject.last_words() or 'without a word'}"
            return Result("starts", "failed", text, "its command line has to take {robot} and {connect} as given")
        if exam.tokens():
            return Result("starts", "passed", f"is alive after {time.monotonic() - began_s:.1f} s")
        time.sleep(POLL_S)
    token = f"no liveliness token of {exam.stage} stands after {START_WITHIN_S:g} s"
    return Result(
        "starts", "failed", f"it runs, but {token}. Its log: {subject.last_words() or 'empty'}", _token_advice(exam.stage)
    )


def _liveliness(stage: str, instances: list[str]) -> Result:
    said = f"{len(instances)} tokens stand: {', '.join(instances)}"
    if len(instances) > 1:
        return Result("liveliness", "failed", said, "one process of a stage has one token, and a robot one process of a stage")
    wrong = None if instances else "no token stands"
    return judged("liveliness", f"its token stands: {', '.join(instances)}", wrong, _token_advice(stage))


def _token_advice(stage: str) -> str:
    return f"declare {topics.alive_key('{robot}', stage, '{instance}')} when ready to work: its end is then noticed at once"


def _ends(exam: Examination, subject: Subject) -> list[Result]:
    if not subject.running():
        said = f"it ended by itself with status {subject.status()} meanwhile: {subject.last_words() or 'without a word'}"
        return [Result("ends", "failed", said, "mend this first: what else is wrong may come of it")]
    took_s = subject.terminate()
    advice = f"end within {STOP_WITHIN_S:g} s of SIGTERM with status 0: a robot that is shut down waits for nobody"
    if took_s is None:
        return [Result("ends", "failed", f"it runs {STOP_WITHIN_S:g} s after SIGTERM", advice)]
    said = f"ended {took_s:.1f} s after SIGTERM with status {subject.status()}"
    gone = _until(lambda: not exam.tokens(), TOKEN_GONE_WITHIN_S)
    return [
        judged("ends", said, None if subject.status() == 0 else said, advice),
        judged(
            "token gone", "its token is gone with it", None if gone else "its token stands on", "hold one session, and close it"
        ),
    ]


def _registry(exam: Examination) -> list[Result]:
    """What fusion answers to those who ask and edit."""
    states, refused = exam.replies(topics.STATE)
    said = f"{len(states)} answers to a get of fusion/state"
    as_json = exam.json_reply(f"{topics.STATE.key(exam.robot)}?{JSON}")
    stored, why = exam.edit(POI_ID, {"position_m": [1.0, 2.0, 0.5], "name": "of check-stage"})
    kept = any(isinstance(poi, Poi) and poi.poi_id == POI_ID for poi in stored)
    _, named = exam.edit(POI_ID, {"position_m": "nowhere"})
    exam.edit(POI_ID, None)
    left, _ = exam.replies(topics.POI, id=POI_ID)
    return [
        judged("state", said, None if len(states) == 1 else refused or said, "answer gets on fusion/state with one State"),
        judged("state as JSON", f"fusion/state?{JSON} is JSON", None if as_json else f"no JSON comes for ?{JSON}", AS_JSON),
        judged(
            "edit", "an edit is answered with the stored POI", None if kept else f"an edit is not: {why or 'no answer'}", STORED
        ),
        judged(
            "refused edit", f"a broken edit is refused: {named}", None if "position_m" in named else f"is not: {named}", NAMED
        ),
        judged("removal", "a removed POI is gone", "a removed POI is still answered" if left else None, REMOVED),
    ]


def _until(condition: Callable[[], bool], within_s: float) -> bool:
    until_s = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > until_s:
            return False
        time.sleep(POLL_S)
    return True
