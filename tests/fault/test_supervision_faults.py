"""Processes that are killed, stopped or doubled while a person points: who is started again, who is left in peace, what stays.

One system for all, in lockstep, so that a busy machine plays slowly and drops nothing; the last tests end systems of their own,
which play live, for only then the stages share memory.
"""

import ctypes
import json
import os
import signal
import subprocess
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from deixis_runtime.procfs import stat_fields
from deixis_runtime.session import open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import Gestures, Target
from private_shm import PrivateShm, missing_for_private_shm
from running import (
    SITE,
    SMALL_CLIP,
    SMALL_POINTED_AT,
    answers,
    child_called,
    children,
    command,
    free_port,
    process,
    wait_until,
)

pytestmark = pytest.mark.skipif(bool(missing_for_private_shm()), reason=missing_for_private_shm())

PR_SET_CHILD_SUBREAPER = 36
ROUTER = "router"
EVERYBODY = (ROUTER, *topics.STAGES)
AGAIN_S = 90.0  # other tests run beside these


class Running:
    """A running `deixis up`, its log, and what it says."""

    def __init__(self, child, log, robot, endpoint, place, session):
        self.child, self.log, self.robot, self.endpoint, self.place = child, log, robot, endpoint, place
        self.session = session
        self.phase = ""
        self.targets = []
        self.answered = 0
        self._lock = threading.Lock()
        self._declared = [
            session.declare_subscriber(topics.GESTURES.key(robot), self._hear_gestures),
            session.declare_subscriber(topics.TARGET.key(robot), self._hear_target),
            session.declare_subscriber(topics.BELIEF.key(robot), self._hear_belief),
        ]

    def _hear_gestures(self, sample):
        gestures = codec.decode(Gestures, sample.payload.to_bytes(), str(sample.encoding)).gestures
        self.phase = gestures[0].phase if gestures else ""

    def _hear_target(self, sample):
        target = codec.decode(Target, sample.payload.to_bytes(), str(sample.encoding))
        if target.final:
            with self._lock:
                self.targets.append(target.poi_ids)

    def _hear_belief(self, _sample):
        self.answered += 1

    def pids(self):
        """Process numbers by name, of those who run now."""
        words = {name: "deixis_runtime.router" if name == ROUTER else f"deixis-{name}" for name in EVERYBODY}
        return {name: child_called(self.child.pid, word) for name, word in words.items()}

    def status(self, *options):
        """What `deixis status` says."""
        argv = command("deixis", "status", "--robot", self.robot, "--connect", self.endpoint, *options)
        return subprocess.run(argv, capture_output=True, text=True, timeout=60, check=True).stdout

    def health(self, stage):
        """What the stage answers; empty while it does not."""
        key = topics.HEALTH.key(self.robot, stage=stage)
        answers = [reply.ok for reply in self.session.get(f"{key}?format=json", timeout=1.0)]
        return next((json.loads(answer.payload.to_bytes()) for answer in answers if answer is not None), {})

    def wait(self, condition, what, timeout_s=AGAIN_S):
        return wait_until(condition, what, timeout_s, self.log)

    def wait_until_others_than(self, before, *names):
        """Until these run as other processes than before, and answer."""
        for name in names:
            self.wait(lambda name=name: self.pids()[name] not in (None, before[name]), f"another {name}")
        for name in names:
            if name != ROUTER:
                self.wait(lambda name=name: self.health(name).get("pid") == self.pids()[name], f"{name} answers")

    def wait_until_frames_are_answered(self):
        """Until frames pass all stages again."""
        before = self.answered
        self.wait(lambda: self.answered > before + 3, "frames are answered")

    def wait_for_the_answer(self):
        """Until a pointing is answered rightly that ends from now on."""
        with self._lock:
            self.targets.clear()
        self.wait(lambda: [SMALL_POINTED_AT] in self.targets, "the answer")


@contextmanager
def running(folder, robot, place, *more):
    """`deixis up` of all stages on the small clip, again and again; entered when gestures come."""
    endpoint, log = f"tcp/127.0.0.1:{free_port()}", folder / "log"
    options = ["--robot", robot, "--listen", endpoint, "--site", SITE, "--registry", folder / "pois.sqlite"]
    argv = command("deixis", "up", *options, "--set", f"camera.source={SMALL_CLIP}", "--set", "camera.loop=true", *more)
    with process(place.command(argv), log) as child:
        wait_until(lambda: child.poll() is not None or answers(endpoint), "a router", 30, log)
        with open_client(endpoint, shared_memory=False) as session:
            it = Running(child, log, robot, endpoint, place, session)
            it.wait(lambda: it.phase, "gestures")
            yield it


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """Where all systems of this module run."""
    with PrivateShm(tmp_path_factory.mktemp("place")) as it:
        yield it


@pytest.fixture(scope="module")
def up(tmp_path_factory, place):
    """One system for the tests that leave it running."""
    # A frame that is lost with a process is not waited for as long as a busy stage is otherwise.
    lockstep = ["--lockstep", "--set", "camera.lockstep_timeout_s=1"]
    with running(tmp_path_factory.mktemp("up"), "faults", place, *lockstep) as it:
        yield it


def runs(pid):
    """Whether a process is there and not a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def stands(pid):
    """Whether all threads of a process are stopped."""
    return all(path.read_text().rpartition(")")[2].split()[0] == "T" for path in Path(f"/proc/{pid}/task").glob("*/stat"))


@pytest.mark.parametrize("stage", topics.STAGES)
def test_a_stage_killed_in_a_stroke_is_started_again_and_the_answer_still_comes(up, stage):
    before = up.pids()
    up.wait(lambda: up.phase == "stroke", "a stroke")
    os.kill(before[stage], signal.SIGKILL)
    up.wait_until_others_than(before, stage)
    up.wait_for_the_answer()
    assert {name for name, pid in up.pids().items() if pid != before[name]} == {stage}
    assert f"{stage} ended (killed by SIGKILL); starting it again at once" in up.log.read_text()


def test_all_that_are_stopped_for_a_moment_and_continued_are_left_in_peace(up):
    before = up.pids()
    for pid in before.values():
        os.kill(pid, signal.SIGSTOP)
    time.sleep(0.4)
    for pid in before.values():
        os.kill(pid, signal.SIGCONT)
    up.wait_until_frames_are_answered()
    assert up.pids() == before


def test_a_router_that_hangs_is_replaced_and_no_stage_is_though_their_puts_wait_for_it(up):
    before = up.pids()
    os.kill(before[ROUTER], signal.SIGSTOP)
    up.wait_until_others_than(before, ROUTER)
    up.wait_until_frames_are_answered()
    assert up.pids() == before | {ROUTER: up.pids()[ROUTER]}
    assert "router gave no sign that its loop runs for 0.8 s; killing it" in up.log.read_text()


def test_a_router_that_is_killed_after_a_minute_is_replaced_and_no_stage_with_it(up):
    before = up.pids()
    # By then nothing that its start has made, a lease, an allowance or a count of restarts, still stands.
    wait_until(lambda: age_s(before[ROUTER]) > 60.0, "the router has run for a minute", 90)
    os.kill(before[ROUTER], signal.SIGKILL)
    up.wait_until_others_than(before, ROUTER)
    up.wait_until_frames_are_answered()
    assert up.pids() == before | {ROUTER: up.pids()[ROUTER]}


def age_s(pid):
    """How long a process has run."""
    ticks = int(stat_fields(Path(f"/proc/{pid}/stat").read_text())[19])
    return time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")


def test_a_supervisor_that_is_stopped_for_five_seconds_harms_nobody(up):
    before = up.pids()
    up.child.send_signal(signal.SIGSTOP)
    time.sleep(5.0)
    up.child.send_signal(signal.SIGCONT)
    up.wait_until_frames_are_answered()
    assert up.pids() == before


def test_stages_that_hang_all_at_once_are_all_replaced_and_status_shows_how_often_and_why(up):
    before = up.pids()
    for stage in topics.STAGES:
        os.kill(before[stage], signal.SIGSTOP)
    up.wait_until_others_than(before, *topics.STAGES)
    up.wait_until_frames_are_answered()
    assert not any(map(runs, (before[stage] for stage in topics.STAGES)))
    said, supervisor = up.status(), up.health(topics.SUPERVISOR)
    assert supervisor["state"] == "ok"
    for stage in topics.STAGES:
        assert supervisor["counters"][f"restarts_{stage}"] >= 1
        assert f"supervisor: {stage}: started again" in said
    assert said.count("gave no sign that its loop runs for 0.8 s") == len(topics.STAGES)


def test_a_second_stage_of_the_same_name_is_reported_by_both_and_by_status(up):
    argv = command("deixis-gesture", "--robot", up.robot, "--connect", up.endpoint)
    with process(up.place.command(argv), up.log) as second:
        said = f"is gesture of robot {up.robot}, too: what both publish is mixed; stop one of them"
        up.wait(lambda: up.log.read_text().count(said) == 2, "both say so")
        assert any("stage gesture has 2 producers" in line for line in json.loads(up.status("--json"))["doubled"])
        assert second.poll() is None
    up.wait(lambda: not any("too: what both" in note for note in up.health("gesture").get("notes", [])), "it is taken back")


@pytest.fixture
def live(tmp_path, robot):
    """A system that the test may end, alone in its place."""
    with PrivateShm(tmp_path) as place, running(tmp_path, robot, place) as it:
        yield it


def test_sigterm_ends_all_within_two_seconds_and_leaves_nothing_even_of_those_that_were_killed_or_hang(live):
    before = live.pids()
    os.kill(before["camera"], signal.SIGKILL)
    os.kill(before["fusion"], signal.SIGKILL)
    live.wait_until_others_than(before, "camera", "fusion")
    pids = live.pids()
    assert len(live.place.shared_memory()) > len(pids), "there is much to be left"
    strange = Path(f"/proc/{live.child.pid}/root/dev/shm/4711.zenoh")
    strange.touch()
    os.kill(pids["headpose"], signal.SIGSTOP)
    began_s = time.monotonic()
    live.child.send_signal(signal.SIGTERM)
    assert live.child.wait(10) == 0
    assert time.monotonic() - began_s < 2.0 * patience_of_this_machine()
    assert not any(map(runs, pids.values()))
    assert live.place.shared_memory() == {strange.name}, "what was never ours"
    assert live.place.temporary_files() == set()


def test_a_killed_supervisor_leaves_no_process_and_nothing_else_though_a_stage_and_the_router_are_stopped(live):
    before = live.pids()
    os.kill(before["fusion"], signal.SIGKILL)
    live.wait_until_others_than(before, "fusion")
    now = live.pids()
    pids = {*now.values(), *children(live.child.pid)}
    live.child.send_signal(signal.SIGSTOP)  # or it would find them
    os.kill(now["headpose"], signal.SIGSTOP)
    os.kill(now[ROUTER], signal.SIGSTOP)
    # As below a program that adopts orphans, like some container's first process: there the kernel does not continue those
    # that stand by itself.
    assert ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0
    # They are continued when their parent ends; a signal sent just before may still be on its way.
    live.wait(lambda: stands(now["headpose"]) and stands(now[ROUTER]), "both stand")
    live.child.kill()
    wait_until(lambda: not any(map(runs, pids)), "all children are gone", 5, live.log)
    assert live.place.shared_memory() == set()
    assert live.place.temporary_files() == set()


def patience_of_this_machine():
    """How much slower than alone things are here: tests run beside others."""
    return max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1))
