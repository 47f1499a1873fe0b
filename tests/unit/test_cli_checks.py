"""What doctor finds wrong, and with which advice."""

import pytest
from deixis_cli.checks import Listening, findings
from deixis_cli.gets import Refusal
from deixis_cli.system import StageProcess, System
from deixis_runtime.clock_offset import Offset
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, ClockHealth, Health, InputHealth, OutputHealth, State

CLEAN = Listening(frozenset(topics.STAGES), edits_reach_fusion=True)


def health(stage, **changes):
    outputs = [
        OutputHealth(key=f"deixis/r1/{topic.path}", published=300, rate_hz=30)
        for topic in topics.TOPICS
        if topic.stage == stage
    ]
    content = {"stamp_ns": 1, "stage": stage, "instance": "a", "count": 9, "state": "ok", "pid": 1, "host": "edge"}
    return Health(**{**content, "uptime_s": 60, "cpu_s": 6, "rss_mb": 50, "outputs": outputs, **changes})


def process(stage, instance="a", alive=True, clock_ahead_s=0.0, **changes):
    clock = Offset(round(clock_ahead_s * 1e9), 2_000_000)
    return StageProcess(stage, instance, alive, health(stage, **changes), 10.0, clock)


def camera(**changes):
    return CameraInfo(
        **{"stamp_ns": 1, "stage": "camera", "instance": "a", "state": "streaming", "source": "0", "rate_hz": 30} | changes
    )


def state(pois=3, **changes):
    content = {"stamp_ns": 1, "stage": "fusion", "instance": "a", "robot": "r1", "sources": [], "pois": [], "persons": []}
    return State(**{**content, "pois_total": pois, **changes})


def system(**changes):
    processes = {stage: [process(stage)] for stage in topics.STAGES} | changes.pop("processes", {})
    flat = [item for stage in processes.values() for item in stage]
    return System("r1", flat, **({"camera": camera(), "state": state()} | changes))


def wrong(system, listening=CLEAN):
    return [finding.what for finding in findings(system, listening) if finding.level == "wrong"]


def test_a_healthy_system_has_nothing_wrong():
    assert wrong(system()) == []


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"processes": {"headpose": []}}, "headpose: no process of it is alive"),
        ({"processes": {"gesture": [StageProcess("gesture", "a", True, None)]}}, "gesture/a: alive but gives no answer"),
        ({"processes": {"fusion": [process("fusion", state="degraded", reason="late")]}}, "fusion: degraded: late"),
        ({"processes": {"tracker": [process("tracker", who) for who in "ab"]}}, "stage tracker has 2 producers"),
        ({"processes": {"camera": [process("camera", clock_ahead_s=-7.0)]}}, "the clock of host edge is 7.0 s behind ours"),
        ({"camera": camera(state="retrying", reason="it is not there")}, "camera: retrying: it is not there"),
        ({"camera": camera(rate_hz=60)}, "tracker/tracks: 30.0/s, expected 60/s"),
        ({"state": state(pois=0)}, "there are no points of interest"),
        ({"state": None}, "fusion/state: a get is not answered"),
    ],
)  # fmt: skip
def test_each_fault_is_named(changed, said):
    assert any(what.startswith(said) for what in wrong(system(**changed)))


def test_inputs_that_are_silent_or_refused_are_named():
    inputs = [
        InputHealth(key="deixis/r1/camera/frame", received=5, age_s=9.0),
        InputHealth(key="deixis/r1/tracker/tracks", rejected=3, last_error="Tracks version '2'", age_s=0.1),
    ]
    said = wrong(system(processes={"headpose": [process("headpose", inputs=inputs)]}))
    assert said == [
        "headpose has heard no camera/frame for 9 s, but camera says that it published 300 of them, 30/s now",
        "headpose refused 3 of tracker/tracks: Tracks version '2'",
    ]


def test_two_producers_of_a_key_are_noticed_by_those_who_hear_them():
    heard = [InputHealth(key="deixis/r1/headpose/poses", producers=["headpose/a", "mediapipe/z"], age_s=0.1)]
    said = wrong(system(processes={"fusion": [process("fusion", inputs=heard)]}))
    assert said == ["key deixis/r1/headpose/poses has 2 producers: headpose/a, mediapipe/z"]


def test_a_stand_in_that_is_heard_takes_the_place_of_a_missing_stage():
    heard = [InputHealth(key="deixis/r1/headpose/poses", producers=["headpose/mine"], age_s=0.1)]
    assert wrong(system(processes={"headpose": [], "fusion": [process("fusion", inputs=heard)]})) == []


def test_a_guest_that_is_heard_but_gives_no_health_does_not_hang():
    heard = [InputHealth(key="deixis/r1/headpose/poses", producers=["headpose/mine"], age_s=0.1)]
    guest = StageProcess("headpose", "mine", True, None)
    assert wrong(system(processes={"headpose": [guest], "fusion": [process("fusion", inputs=heard)]})) == []


def test_denied_subscriptions_and_denied_edits_are_told_from_silence():
    said = wrong(system(), Listening(frozenset(topics.STAGES) - {"camera"}, edits_reach_fusion=False))
    assert said == [
        "camera: health is answered to a get but not heard by listening",
        "fusion/poi: an edit by get does not reach fusion",
    ]


def test_a_stage_that_has_just_started_is_not_blamed_for_its_rate():
    silent = [InputHealth(key="deixis/r1/camera/frame")]
    young = process("tracker", uptime_s=1.0, outputs=[], inputs=silent)
    assert wrong(system(processes={"tracker": [young]})) == []


def test_rates_are_not_judged_in_lockstep_or_when_the_camera_has_ended():
    slow = {"tracker": [process("tracker", outputs=[])]}
    assert wrong(system(processes=slow, camera=camera(lockstep=True))) == []
    assert wrong(system(processes=slow, camera=camera(state="ended", reason="played to its end"))) == []
    assert wrong(system(processes=slow)) == ["tracker/tracks: 0.0/s, expected 30/s"]


def test_a_slow_stage_is_blamed_and_not_those_behind_it():
    def at(stage, rate_hz, **inputs):
        outputs = [OutputHealth(key=f"deixis/r1/{path}", rate_hz=rate_hz) for path in ("tracker/tracks", "gesture/gestures")]
        heard = [InputHealth(key=f"deixis/r1/{path.replace('_', '/')}", rate_hz=hz, age_s=0.1) for path, hz in inputs.items()]
        return [process(stage, outputs=outputs, inputs=heard, step_ms_p50=99)]

    slow = {"tracker": at("tracker", 9, camera_frame=30), "gesture": at("gesture", 9, tracker_tracks=9.5)}
    assert wrong(system(processes=slow)) == ["tracker/tracks: 9.0/s, expected 30/s"]


def test_an_edit_that_is_denied_is_as_meant_for_who_may_not_edit():
    listening = Listening(CLEAN.healths, edits_reach_fusion=False, may_edit=False)
    assert wrong(system(), listening) == []
    assert [f.advice for f in findings(system(), listening) if "do not reach fusion" in f.what] == [
        "as meant: our certificate is not an editor's"
    ]


def test_what_all_stages_of_a_host_show_is_said_once():
    note = "the certificate edge:e1 in /c/cert.pem expires in 3 days"
    shown = system(processes={stage: [process(stage, notes=[note])] for stage in ("fusion", "gesture")})
    assert [f.what for f in findings(shown, CLEAN) if note in f.what] == [f"fusion, gesture: {note}"] or [
        f.what for f in findings(shown, CLEAN) if note in f.what
    ] == [f"gesture, fusion: {note}"]


def found(system, start, listening=CLEAN):
    """The findings that begin so."""
    return [finding for finding in findings(system, listening) if finding.what.startswith(start)]


def test_a_key_that_the_link_keeps_is_named_with_both_its_ends():
    silent = [InputHealth(key="deixis/r1/camera/frame")]
    processes = {"camera": [process("camera", host="robot")], "tracker": [process("tracker", inputs=silent)]}
    (kept,) = found(system(processes=processes), "tracker has heard no camera/frame ever")
    assert "camera says that it published 300 of them, 30/s now" in kept.what
    assert kept.advice.startswith("the link from robot to edge or its access control keeps camera/frame")


def test_frames_that_all_come_too_late_are_not_called_denied():
    late = [InputHealth(key="deixis/r1/camera/frame", received=90, too_old=90, rate_hz=12)]
    (said,) = found(system(processes={"tracker": [process("tracker", inputs=late)]}), "tracker has heard no camera/frame")
    assert "young enough" in said.what
    assert "link is too slow" in said.advice


def test_topics_that_are_kept_from_us_are_named_and_only_what_tools_need_is_wrong():
    listening = Listening(CLEAN.healths, True, paths={"tracker/tracks": False, "headpose/poses": True, "fusion/belief": False})
    said = {finding.what: finding.level for finding in findings(system(), listening) if "we hear none" in finding.what}
    assert said == {
        "tracker/tracks: tracker publishes 30/s of it, and we hear none": "note",
        "fusion/belief: fusion publishes 30/s of it, and we hear none": "wrong",
    }


def test_what_nobody_publishes_is_not_called_kept_from_us():
    listening = Listening(CLEAN.healths, True, paths={"fusion/belief": False})
    assert wrong(system(processes={"fusion": [process("fusion", outputs=[], uptime_s=1)]}), listening) == []


def test_two_versions_of_a_message_are_called_that():
    heard = [
        InputHealth(key="deixis/r1/camera/frame", rejected=3, last_error="Frame version '1', this reader speaks 2", age_s=0.1)
    ]
    (said,) = found(system(processes={"tracker": [process("tracker", inputs=heard)]}), "tracker refused 3 of camera/frame")
    assert said.advice.startswith("two versions of the contract meet: install the same version")
    heard = [InputHealth(key="deixis/r1/camera/frame", rejected=3, last_error="data: 3 bytes, but ...", age_s=0.1)]
    (said,) = found(system(processes={"tracker": [process("tracker", inputs=heard)]}), "tracker refused 3 of camera/frame")
    assert "breaks the contract" in said.advice


def test_hosts_with_different_releases_are_named():
    old = process("camera", host="robot", versions={"deixis-schemas": "0.1.0", "eclipse-zenoh": "1.9.0"})
    new = process("tracker", versions={"deixis-schemas": "0.2.0", "eclipse-zenoh": "1.10.2"})
    ours = {"deixis-schemas": "0.2.0", "eclipse-zenoh": "1.10.2"}
    seen = system(processes={"camera": [old], "tracker": [new]}, ours=ours)
    assert wrong(seen) == ["versions of Deixis differ: 0.1.0: camera on robot; 0.2.0: this command, tracker on edge"]
    (zenoh,) = found(seen, "versions of eclipse-zenoh differ")
    assert zenoh.level == "note"


def test_a_health_that_cannot_be_read_is_named():
    refused = [Refusal("deixis/r1/camera/health", "Health version '2', this reader speaks 1")]
    said = wrong(system(refused=refused))
    assert said == ["deixis/r1/camera/health: its health cannot be read: Health version '2', this reader speaks 1"]


@pytest.mark.parametrize(("ahead_s", "way"), [(180.0, "3 min 0 s ahead of"), (-0.5, "0.5 s behind")])
def test_clocks_of_two_hosts_are_named_as_the_stages_see_them(ahead_s, way):
    clocks = [ClockHealth(stage="camera", host="robot", ahead_s=ahead_s, uncertain_s=0.002)]
    said = wrong(system(processes={"fusion": [process("fusion", clocks=clocks)]}))
    assert said == [f"the clock of host robot (camera) is {way} that of host edge (fusion)"]


def test_a_difference_that_the_round_trip_may_explain_is_not_called_one():
    clocks = [ClockHealth(stage="camera", host="robot", ahead_s=0.9, uncertain_s=0.8)]
    assert wrong(system(processes={"fusion": [process("fusion", clocks=clocks)]})) == []
