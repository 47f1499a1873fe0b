"""A gesture stage that keeps the contract, or breaks it in one way: for tests of who is to notice.

python broken_stage.py --robot R --connect ENDPOINT [--defect NAME]
"""

import argparse
import signal
import sys
import time
from collections import deque

import zenoh
from deixis_runtime.session import client_config
from deixis_schemas import Producer, codec, topics
from deixis_schemas.messages import Gestures, Health, InputHealth

DEFECTS = (
    *(
        "none",
        "no_label",
        "broken_field",
        "twice",
        "dies_of_garbage",
        "works_off_a_queue",
        "answers_the_old",
        "ignores_sigterm",
    ),
    *("ends_at_once", "chatters", "crashes"),
)
MAX_AGE_NS = 1_000_000_000


class Stage:
    """Answers each tracks with the gestures of nobody."""

    def __init__(self, session, robot, defect):
        self.session, self.robot, self.defect = session, robot, defect
        self.producer = Producer("gesture", "broken-1")
        self.tracks = deque(maxlen=None if defect == "works_off_a_queue" else 1)
        self.beats = self.rejected = 0
        self.stopping = False

    def put(self, topic, message, **changes):
        label = codec.encoding_of(type(message)) if self.defect != "no_label" else None
        payload = codec.pack({**message.model_dump(), **changes})
        self.session.put(topic.key(self.robot, stage="gesture"), payload, encoding=label)

    def answer(self, sample):
        try:
            tracks = codec.decode(topics.TRACKS.type, sample.payload.to_bytes(), str(sample.encoding))
        except codec.CodecError:
            if self.defect == "dies_of_garbage":
                raise
            self.rejected += 1
            return
        # By the clocks of one machine; ours do without that.
        if time.time_ns() - tracks.stamp_ns > MAX_AGE_NS and self.defect not in ("answers_the_old", "chatters"):
            return
        if self.defect == "works_off_a_queue":
            time.sleep(0.06)
        if self.defect == "crashes":
            raise ValueError("there is no model for this hand")
        found = Gestures.derive(tracks, self.producer, gestures=[])
        self.put(topics.GESTURES, found, **({"gestures": [{"person_id": "one"}]} if self.defect == "broken_field" else {}))
        if self.defect == "twice":
            self.put(topics.GESTURES, found)

    def health(self):
        heard = InputHealth(key=topics.TRACKS.key(self.robot), received=1, rejected=self.rejected)
        figures = dict.fromkeys(("pid", "uptime_s", "cpu_s", "rss_mb", "step_ms_p50", "step_ms_max"), 1)
        said = {
            "stamp_ns": time.time_ns(),
            "count": self.beats,
            "state": "ok",
            "host": "here",
            "inputs": [heard],
            "outputs": [],
        }
        return Health(**self.producer._asdict(), **figures, **said)

    def work(self):
        due_s, last = 0.0, None
        while not self.stopping:
            if self.tracks:
                last = self.tracks.popleft()
                self.answer(last)
            if time.monotonic() >= due_s:
                due_s = time.monotonic() + 1.0
                self.beats += 1
                self.put(topics.HEALTH, self.health())
                if self.defect == "chatters" and last is not None:
                    self.answer(last)
            time.sleep(0.002)


def main():
    """Work until told to stop."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", required=True)
    parser.add_argument("--connect", required=True)
    parser.add_argument("--defect", choices=DEFECTS, default="none")
    given = parser.parse_args()
    if given.defect == "ends_at_once":
        sys.exit("no model file")
    with zenoh.open(client_config(given.connect, shared_memory=False)) as session:
        stage = Stage(session, given.robot, given.defect)
        signal.signal(signal.SIGTERM, lambda *_: setattr(stage, "stopping", given.defect != "ignores_sigterm"))
        key = topics.HEALTH.key(given.robot, stage="gesture")

        def answer(query):
            query.reply(key, codec.encode(stage.health()), encoding=codec.encoding_of(Health))

        declared = [
            session.declare_subscriber(topics.TRACKS.key(given.robot), stage.tracks.append),
            session.declare_queryable(key, answer),
            session.liveliness().declare_token(topics.alive_key(given.robot, *stage.producer)),
        ]
        stage.work()
        del declared


if __name__ == "__main__":
    main()
