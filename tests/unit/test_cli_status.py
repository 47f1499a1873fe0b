"""What `deixis status` says of stages, and of those that are not ours."""

import pytest
from deixis_cli.status import document, print_system, remarks
from deixis_cli.system import StageProcess, System
from deixis_schemas.messages import Health, InputHealth

GUEST = StageProcess("headpose", "swap-7", True, None)


def beside(guest, producers):
    """A system of that guest and a fusion that hears these producers of head poses."""
    heard = InputHealth(key="deixis/r1/headpose/poses", producers=producers, age_s=0.1)
    health = Health(
        stamp_ns=1, stage="fusion", instance="a", count=9, state="ok", pid=1, host="edge", uptime_s=60, cpu_s=6, rss_mb=50,
        inputs=[heard],
    )  # fmt: skip
    return System("r1", [guest, StageProcess("fusion", "a", True, health)])


def states(system):
    return {stage["stage"]: stage["state"] for stage in document(system, "tcp/127.0.0.1:7447")["stages"]}


def test_a_stage_of_ones_own_that_is_heard_is_not_called_hung(capsys):
    system = beside(GUEST, ["headpose/swap-7"])
    assert states(system) == {"headpose": "heard", "fusion": "ok"}
    assert "headpose: its messages are heard, but it answers no get of its health" in remarks(system)
    print_system(system)
    assert "hung" not in capsys.readouterr().out


@pytest.mark.parametrize("producers", [[], ["headpose/other"]])
def test_a_process_that_neither_answers_nor_is_heard_is_called_hung(producers):
    system = beside(GUEST, producers)
    assert states(system)["headpose"] == "hung"
    assert "headpose: its process is alive but gives no answer: hung or stopped" in remarks(system)


def supervisor(host, state="ok", reason="", notes=()):
    health = Health(
        stamp_ns=1, stage="supervisor", instance=host, count=9, state=state, reason=reason, pid=1, host=host, uptime_s=60,
        cpu_s=6, rss_mb=50, notes=list(notes),
    )  # fmt: skip
    return StageProcess("supervisor", host, True, health)


def test_what_supervisors_have_done_and_given_up_is_shown_and_one_on_each_host_is_no_double(capsys):
    note, reason = "fusion: started again 2 times; the last end, 12 s ago: killed by SIGKILL", "gesture is given up: ..."
    supervisors = [supervisor("robot", notes=[note]), supervisor("edge", "degraded", reason)]
    system = System("r1", beside(GUEST, ["headpose/swap-7"]).processes, supervisors=supervisors)
    assert f"supervisor: {note}" in remarks(system)
    assert f"supervisor: degraded: {reason}" in remarks(system)
    assert system.doubled() == []
    assert [(item["instance"], item["state"]) for item in document(system, "x")["supervisors"]] == [
        ("robot", "ok"),
        ("edge", "degraded"),
    ]
    print_system(system)
    assert capsys.readouterr().out.count("supervisor ") >= 2
