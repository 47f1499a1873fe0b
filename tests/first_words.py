"""Prints when a stage is heard for the first time after a start: `python first_words.py ROBOT STAGE ENDPOINT`.

One line for each process of that stage, at its first message of any kind: its number and the monotonic clock, seconds. Runs for
two minutes at most. It hears what any tool of the robot hears, so the time is that of a user.
"""

import sys
import time

import zenoh
from deixis_runtime.session import open_client
from deixis_schemas import codec, topics
from deixis_schemas.messages import Health

LASTS_S = 120.0


def main(robot, stage, endpoint):
    heard = set()

    def note(sample):
        at_s = time.monotonic()
        pid = codec.decode(Health, sample.payload.to_bytes(), str(sample.encoding)).pid
        if pid not in heard:
            heard.add(pid)
            print(pid, at_s, flush=True)

    with open_client(endpoint, shared_memory=False) as session:  # which would be left, for this one is killed
        subscriber = session.declare_subscriber(topics.HEALTH.key(robot, stage=stage), note)
        print("listening", 0, flush=True)
        time.sleep(LASTS_S)
        subscriber.undeclare()


if __name__ == "__main__":
    zenoh.init_log_from_env_or("error")
    main(*sys.argv[1:])
