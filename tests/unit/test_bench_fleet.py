"""The benchmark of a fleet: robots that differ, and what counts as hearing another."""

import sys
from pathlib import Path

import pytest
from deixis_schemas import codec, topics
from deixis_schemas.messages import Belief, Target

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def bench(monkeypatch):
    """The benchmarks' folder, as for `python bench/fleet.py`."""
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    yield
    for name in ("fleet", "fleet_player", "fleet_recording", "process_use"):
        sys.modules.pop(name, None)


def target(robot, **changed):
    frame = {"run": robot.first_run, "seq": 1, "stamp_ns": 1, "stage": "fusion", "instance": "x"}
    answer = {"episode_id": "e", "person_id": 1, "final": True, "conflict": 0.0, "reason": "", "started_ns": 1, "ended_ns": 2}
    return Target(**frame | answer | {"latency_ms": 1.0, "poi_ids": robot.answer} | changed)


def test_robots_that_follow_each_other_are_pointed_to_different_pois_and_share_no_name_and_no_run():
    from fleet_recording import fleet

    robots = fleet(4, first_run=5)
    assert [robot.answer for robot in robots] == [["r00.P3"], ["r01.P8"], ["r02.P7"], ["r03.P3"]]
    assert len({robot.first_run for robot in robots}) == 4
    names = [poi["poi_id"] for robot in robots for poi in robot.site()["pois"]]
    assert len(set(names)) == len(names)


def test_a_recorded_message_is_replayed_with_the_time_and_run_of_now():
    from fleet_recording import recorded, replayed

    tracks, _ = recorded("pointing").frames[3]
    again = replayed(tracks, run=7, stamp_ns=9)
    assert (again.run, again.seq, again.stamp_ns, again.tracks) == (7, tracks.seq, 9, tracks.tracks)


def test_an_answer_about_anothers_run_or_with_anothers_poi_is_foreign():
    from fleet_recording import fleet

    one, two = fleet(2, first_run=5)
    assert one.foreign(target(one)) == ""
    assert "run" in one.foreign(target(one, run=two.first_run))
    assert "r01.P8" in one.foreign(target(one, poi_ids=two.answer))
    belief = {"run": 5, "seq": 1, "stamp_ns": 1, "stage": "fusion", "instance": "x"}
    assert "r01.P1" in one.foreign(Belief(**belief, persons=[{"person_id": 1, "credible": ["r01.P1"]}]))


class Sample:
    """What Zenoh hands over, as far as it is looked at."""

    def __init__(self, robot, message):
        self.key_expr = topics.TARGET.key(robot.name)
        self.encoding = codec.encoding_of(Target)
        self.payload = self
        self._packed = codec.encode(message)

    def to_bytes(self):
        return self._packed


def test_what_is_heard_is_held_against_the_robot_on_whose_key_it_came():
    from fleet import faults_of, of_answers, understood
    from fleet_recording import fleet

    robots = fleet(2, first_run=5)
    one, two = robots
    heard = [(1, Sample(one, target(one))), (2, Sample(two, target(two))), (3, Sample(two, target(one)))]
    said = understood(heard, {robot.name: robot for robot in robots})
    figures = of_answers(said, robots, frames=2)
    assert (figures["targets"], figures["right"], figures["foreign"], figures["robots_unanswered"]) == (3, 2, 1, 2)
    assert (figures["unsure"], figures["wrong"]) == (0, 1)
    assert len(faults_of(2, figures)) == 3
    assert faults_of(2, figures | {"wrong": 0, "foreign": 0, "robots_unanswered": 0}) == []
    assert len(faults_of(2, figures | {"wrong": 0, "right": 0, "foreign": 0, "robots_unanswered": 0})) == 1


def test_an_answer_that_names_nothing_or_the_right_one_among_others_is_unsure_and_not_wrong():
    from fleet import of_answers, understood
    from fleet_recording import fleet

    (robot,) = fleet(1, first_run=5)
    named = ([], [*robot.answer, "r00.P1"], robot.answer, ["r00.P1"])
    heard = [(1, Sample(robot, target(robot, poi_ids=poi_ids))) for poi_ids in named]
    figures = of_answers(understood(heard, {robot.name: robot}), [robot], frames=1)
    assert (figures["unsure"], figures["right"], figures["wrong"]) == (2, 1, 1)


@pytest.mark.parametrize("text", ["", "0", "17", "1,x", "1,,2"])
def test_numbers_of_robots_that_are_none_are_refused(text):
    from fleet import numbers

    with pytest.raises(Exception, match="not a list of numbers from 1 to 16"):
        numbers(text)
    assert numbers("1,16") == [1, 16]
