"""Hears who answers which frame on a stage's key, for tests of hot swaps."""

import os
import signal
import subprocess
import threading
from collections import Counter, defaultdict
from contextlib import contextmanager

from deixis_schemas import codec, topics
from deixis_schemas.messages import FrameId, HeadPoses, Tracks, Voice
from running import command, wait_until


class Listener:
    """Frames given (tracks) and answered (head poses), in their order."""

    def __init__(self, session, robot):
        self._lock = threading.Lock()
        self._session, self._robot = session, robot
        self.given: list[FrameId] = []
        self.answers: list[tuple[FrameId, str]] = []
        self._subscribers = [
            session.declare_subscriber(topics.TRACKS.key(robot), lambda sample: self._store(Tracks, sample)),
            session.declare_subscriber(topics.HEAD_POSES.key(robot), lambda sample: self._store(HeadPoses, sample)),
        ]

    def _store(self, type_, sample):
        message = codec.decode(type_, sample.payload.to_bytes(), str(sample.encoding))
        with self._lock:
            if type_ is Tracks:
                self.given.append(message.frame_id)
            else:
                self.answers.append((message.frame_id, message.instance))

    def by(self, instance):
        """How many frames this process has answered."""
        with self._lock:
            return sum(who == instance for _, who in self.answers)

    def twice(self):
        """Frames answered more than once, with who did."""
        found = defaultdict(list)
        with self._lock:
            for frame, who in self.answers:
                found[frame].append(who)
        return {frame: who for frame, who in found.items() if len(who) > 1}

    def unanswered(self):
        """Frames given and not answered, between the first and the last answer."""
        with self._lock:
            answered = [frame for frame, _ in self.answers if frame in self.given]
            given = self.given[self.given.index(answered[0]) : self.given.index(answered[-1])]
        return [frame for frame in given if frame not in set(answered)]

    def order(self):
        """The processes in the order in which they answered, each once for each time that it began."""
        with self._lock:
            answers = [who for _, who in self.answers]
        return [who for number, who in enumerate(answers) if number == 0 or answers[number - 1] != who]

    def instances(self):
        """How often each has answered."""
        with self._lock:
            return Counter(who for _, who in self.answers)

    def ask(self, instance, selector=""):
        """What a process of headpose says to a get of its voice: a Voice, or its refusal."""
        key = topics.VOICE.key(self._robot, stage="headpose", id=instance)
        for reply in self._session.get(f"{key}{selector}", timeout=3.0):
            if reply.ok is not None:
                return codec.decode(Voice, reply.ok.payload.to_bytes(), str(reply.ok.encoding))
            return reply.err.payload.to_string()
        return None

    def await_state(self, instance, state, timeout_s=30.0):
        """Until this process stands so."""
        return wait_until(
            lambda: isinstance(told := self.ask(instance), Voice) and told.state == state and told,
            f"{instance}: {state}",
            timeout_s,
        )


@contextmanager
def newcomer(log, robot, endpoint, instance):
    """A headpose of ours that stands by, killed at the end."""
    argv = command("deixis-headpose", "--robot", robot, "--connect", endpoint, "--instance", instance, "--lockstep")
    with log.open("ab") as file:
        child = subprocess.Popen(
            argv, stdin=subprocess.DEVNULL, stdout=file, stderr=file, env={**os.environ, "DEIXIS_STAND_BY": "1"}
        )
    try:
        yield child
    finally:
        child.send_signal(signal.SIGKILL)
        child.wait()
