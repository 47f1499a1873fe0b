"""Who hangs, told through whole histories: hours of signs, a supervisor that stood still, and a machine with other work."""

import pytest
from deixis_runtime.watchdog import Patience, Watchdog

STAGES = {"camera": 11, "tracker": 12, "fusion": 13}
TURN_S = 0.05
SIGNS_S = 0.25


class History:
    """Time that passes turn by turn; each process gives a sign four times a second unless it hangs or cannot run."""

    def __init__(self, running=None):
        self.watchdog = Watchdog(Patience())
        self.began_s = self.now_s = 1000.0
        self.running = dict(running or STAGES)
        self.hung = set()
        self.starved = set()
        self.killed = []

    def pass_time(self, seconds):
        """Let it pass; those who are judged to hang are noted as (name, second of the history, reason)."""
        for _ in range(round(seconds / TURN_S)):
            self.now_s += TURN_S
            if round(self.now_s / TURN_S) % round(SIGNS_S / TURN_S) == 0:
                self._beat()
            self._judge()

    def stand_still(self, seconds):
        """Nothing of ours runs, and what the processes said meanwhile is lost."""
        self.now_s += seconds
        self._judge()

    def _beat(self):
        for name, pid in self.running.items():
            if name not in self.hung | self.starved:
                self.watchdog.beat(pid)

    def _judge(self):
        unable_s = {self.running[name]: TURN_S for name in self.starved if name in self.running}
        for name, why in self.watchdog.hanging(self.running, self.now_s, unable_s).items():
            self.killed.append((name, round(self.now_s - self.began_s, 2), why))
            del self.running[name]

    @property
    def names_killed(self):
        return [name for name, _, _ in self.killed]


@pytest.fixture
def history():
    return History()


def test_an_hour_of_signs_kills_nobody(history):
    history.pass_time(3600)
    assert history.killed == []


def test_a_process_that_hangs_is_found_within_a_second_with_the_reason(history):
    history.pass_time(60)
    history.hung = {"tracker"}
    history.pass_time(5)
    ((name, at_s, why),) = history.killed
    assert name == "tracker"
    assert 60.5 < at_s < 61.0
    assert why == "gave no sign that its loop runs for 0.8 s"


@pytest.mark.parametrize("seconds", [0.5, 3.0, 60.0, 3600.0])
def test_a_supervisor_that_stood_still_kills_no_healthy_process_whenever_it_began(history, seconds):
    for turn in range(60):
        history.pass_time(1 + turn * TURN_S)
        history.stand_still(seconds)
    history.pass_time(2)
    assert history.killed == []


def test_a_supervisor_that_stands_still_again_and_again_finds_a_hung_process_all_the_same(history):
    history.pass_time(10)
    history.hung = {"fusion"}
    for _ in range(3):
        history.stand_still(5.0)
        history.pass_time(SIGNS_S)
    assert history.names_killed == ["fusion"]


def test_a_process_that_hung_during_a_standstill_is_found_after_it(history):
    history.pass_time(10)
    history.hung = {"camera"}
    history.stand_still(3600.0)
    assert history.killed == []
    history.pass_time(1)
    assert history.names_killed == ["camera"]


def test_a_process_that_other_work_keeps_from_running_is_not_taken_for_hung(history):
    history.pass_time(10)
    history.starved = {"tracker"}
    history.pass_time(9)
    history.starved = set()
    history.pass_time(60)
    assert history.killed == []


def test_forgiveness_ends(history):
    history.pass_time(10)
    history.starved = {"tracker"}
    history.pass_time(12)
    assert history.names_killed == ["tracker"]


def test_a_process_that_comes_and_goes_for_want_of_the_processor_for_an_hour_is_spared(history):
    for _ in range(360):
        history.starved = {"tracker"}
        history.pass_time(5)
        history.starved = set()
        history.pass_time(5)
    assert history.killed == []


def test_only_who_is_silent_for_long_is_looked_at(history):
    history.pass_time(10)
    assert history.watchdog.suspects() == []
    history.hung = {"tracker"}
    history.pass_time(0.7)
    assert history.watchdog.suspects() == [STAGES["tracker"]]


def test_a_process_that_never_gives_a_sign_is_killed_after_ten_seconds_and_so_is_its_successor():
    history = History({"tracker": 12})
    history.hung = {"tracker"}
    history.pass_time(9)
    assert history.killed == []
    history.pass_time(2)
    assert history.killed[0][2] == "gave no sign that its loop runs within 10 s"
    history.running["tracker"] = 22
    history.pass_time(9)
    assert len(history.killed) == 1
    history.pass_time(2)
    assert history.names_killed == ["tracker", "tracker"]


def test_a_process_that_was_started_again_has_the_time_of_a_fresh_start(history):
    history.pass_time(10)
    history.hung = {"tracker"}
    history.pass_time(2)
    history.running["tracker"] = 99
    history.pass_time(9)  # it loads for long
    history.hung = set()
    history.pass_time(60)
    assert history.names_killed == ["tracker"]


def test_what_is_remembered_does_not_grow_with_restarts(history):
    for pid in range(100, 300):
        history.running["tracker"] = pid
        history.pass_time(1)
    assert len(history.watchdog._silences) == len(STAGES)


def test_a_sign_of_a_stranger_is_forgotten(history):
    history.watchdog.beat(4711)
    history.pass_time(1)
    assert 4711 not in history.watchdog._silences
