"""Who hangs, told through whole histories: an hour of beats, lost links, and a supervisor that stood still."""

import pytest
from deixis_runtime.watchdog import Patience, Watchdog

STAGES = {"camera": 11, "tracker": 12, "fusion": 13}
TURN_S = 0.1


class History:
    """Time that passes turn by turn; each stage beats once a second unless it hangs, and beats are heard over the link."""

    def __init__(self, stages=None):
        self.watchdog = Watchdog(Patience())
        self.now_s = 1000.0
        self.running = dict(stages or STAGES)
        self.link = "router-1"
        self.hung = set()
        self.killed = []
        self._counts = {}

    def pass_time(self, seconds, link="router-1"):
        """Let it pass; those who are judged to hang are noted as (name, second of the history, reason)."""
        self.link = link
        for _ in range(round(seconds / TURN_S)):
            self.now_s += TURN_S
            if self.link and round(self.now_s / TURN_S) % 10 == 0:
                self._beat()
            self._judge()

    def stand_still(self, seconds):
        """Nothing of ours runs; what was sent meanwhile is lost, as over a link whose lease ran out."""
        self.now_s += seconds
        self._judge()

    def start_again(self, name, pid):
        self.running[name] = pid
        self.hung.discard(name)

    def _beat(self):
        for name, pid in self.running.items():
            if name not in self.hung:
                self._counts[pid] = self._counts.get(pid, 0) + 1
                self.watchdog.beat(pid, self._counts[pid], self.now_s)

    def _judge(self):
        for name, why in self.watchdog.hanging(self.running, self.link, self.now_s).items():
            self.killed.append((name, round(self.now_s - 1000.0, 1), why))
            del self.running[name]

    @property
    def names_killed(self):
        return [name for name, _, _ in self.killed]


@pytest.fixture
def history():
    return History()


def test_an_hour_with_router_crashes_kills_no_healthy_stage(history):
    for crash in range(12):
        history.pass_time(295, link=f"router-{crash}")
        history.pass_time(5, link=None)
    assert history.killed == []


def test_a_router_that_is_replaced_between_two_looks_is_a_new_link(history):
    history.pass_time(100, link="router-1")
    history.link = "router-2"
    history.stand_still(2.9)  # too short to count by itself
    history.hung = set(STAGES)
    history.pass_time(29, link="router-2")  # stages look for the router again
    history.hung = set()
    history.pass_time(60, link="router-2")
    assert history.killed == []


@pytest.mark.parametrize("seconds", [3.1, 60.0, 3600.0])
def test_a_supervisor_that_stood_still_kills_no_healthy_stage(history, seconds):
    history.pass_time(120)
    for _ in range(5):
        history.stand_still(seconds)
        history.pass_time(120)
    assert history.killed == []


def test_a_stage_that_hangs_is_killed_after_six_seconds(history):
    history.pass_time(100)
    history.hung = {"tracker"}
    history.pass_time(20)
    ((name, at_s, why),) = history.killed
    assert name == "tracker"
    assert 105 < at_s < 107.5
    assert "no heartbeat for 6 s" in why


def test_a_stage_that_hung_while_the_link_was_down_is_killed_once_it_had_the_time_of_a_fresh_start(history):
    history.pass_time(100)
    history.hung = {"tracker"}
    history.pass_time(4)
    history.pass_time(60, link=None)
    assert history.killed == []
    history.pass_time(29)
    assert history.killed == []
    history.pass_time(5)
    assert history.names_killed == ["tracker"]
    assert "within 30 s" in history.killed[0][2]


def test_a_stage_that_hangs_after_the_link_came_back_and_it_beat_again_is_killed_after_six_seconds(history):
    history.pass_time(100)
    history.pass_time(5, link=None)
    history.pass_time(10)
    history.hung = {"fusion"}
    history.pass_time(8)
    assert history.names_killed == ["fusion"]


def test_a_stage_that_never_beats_is_killed_after_thirty_seconds_and_so_is_its_successor():
    history = History({"tracker": 12})
    history.hung = {"tracker"}
    history.pass_time(29)
    assert history.killed == []
    history.pass_time(2)
    history.running["tracker"] = 22
    history.pass_time(29)
    assert len(history.killed) == 1
    history.pass_time(2)
    assert history.names_killed == ["tracker", "tracker"]


def test_a_stage_that_was_started_again_has_the_time_of_a_fresh_start(history):
    history.pass_time(100)
    history.hung = {"tracker"}
    history.pass_time(10)
    assert history.names_killed == ["tracker"]
    history.running["tracker"] = 99
    history.pass_time(25)  # it loads for long
    history.hung = set()
    history.pass_time(60)
    assert history.names_killed == ["tracker"]


def test_a_link_that_flaps_costs_no_healthy_stage_and_does_not_save_a_hung_one(history):
    history.pass_time(50)
    history.hung = {"camera"}
    for _ in range(30):
        history.pass_time(5)
        history.pass_time(1, link=None)
    assert history.killed == []  # while it flaps, silence says nothing
    history.pass_time(31)
    assert history.names_killed == ["camera"]


def test_a_count_that_does_not_advance_is_no_heartbeat(history):
    history.pass_time(10)
    for turn in range(80):
        history.watchdog.beat(12, 10, 1010.0 + turn * TURN_S)
    history.hung = {"tracker"}
    history.pass_time(8)
    assert history.names_killed == ["tracker"]


def test_what_is_remembered_does_not_grow_with_restarts(history):
    for pid in range(100, 300):
        history.start_again("tracker", pid)
        history.pass_time(1)
    assert len(history.watchdog._beats) <= len(STAGES)
    assert len(history.watchdog._awaited_s) <= len(STAGES)
