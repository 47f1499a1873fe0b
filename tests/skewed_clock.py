"""Starts a stage as it is on a host whose clock is off: `python tests/skewed_clock.py FILE deixis_camera.service ARGUMENTS`.

FILE holds how far the clock is ahead, seconds, and is read again when it changes: so a running stage's clock is set.
"""

import importlib
import sys
import threading
import time
from pathlib import Path

LOOK_EVERY_S = 0.02


class SkewedClock:
    """Replaces `time.time_ns` and `time.time` of this process."""

    def __init__(self, file):
        self._file = file
        self._true_ns = time.time_ns
        self._ahead_ns = self._read()
        threading.Thread(target=self._follow, daemon=True).start()
        time.time_ns = lambda: self._true_ns() + self._ahead_ns
        time.time = lambda: time.time_ns() / 1e9

    def _read(self):
        return round(float(self._file.read_text()) * 1e9)

    def _follow(self):
        while True:
            time.sleep(LOOK_EVERY_S)
            self._ahead_ns = self._read()


if __name__ == "__main__":
    SkewedClock(Path(sys.argv[1]))
    stage = importlib.import_module(sys.argv[2])
    sys.exit(stage.main(sys.argv[3:]))
