"""What a process gives back to the system, and what it must not."""

import subprocess
import sys

from deixis_runtime.memory import unwritten

SMAPS = """\
7f00-7f10 r--p 00000000 fe:00 11 /usr/lib/libx.so
Rss:                  64 kB
Anonymous:             0 kB
7f10-7f20 r-xp 00001000 fe:00 11 /usr/lib/libx.so
Rss:                  64 kB
Anonymous:             0 kB
7f20-7f30 r--p 00002000 fe:00 11 /usr/lib/libx.so
Rss:                  64 kB
Anonymous:             4 kB
7f30-7f40 rw-p 00003000 fe:00 11 /usr/lib/libx.so
Anonymous:             0 kB
7f40-7f50 r--p 00000000 00:00 0
Anonymous:             0 kB
7f50-7f60 r-xp 00000000 00:00 0                          [vdso]
Anonymous:             0 kB
7f60-7f70 rw-s 00000000 00:17 5 /dev/shm/1.zenoh
Anonymous:             0 kB
7f70-7f80 r--p 00000000 fe:00 12 /usr/lib/a name.so
Anonymous:             0 kB
"""

AS_BEFORE = """
import deixis_headpose.service, deixis_camera.service, numpy as np
from deixis_runtime.memory import let_go_of_libraries
mb = lambda: int(open("/proc/self/statm").read().split()[2]) * 4096 / 1e6  # of files
before = mb()
let_go_of_libraries()
assert mb() < before - 10, (before, mb())
import cv2, sqlite3, ssl
picture = np.arange(64 * 64 * 3, dtype=np.uint8).reshape(64, 64, 3)
print(cv2.resize(picture, (32, 32)).sum(), np.linalg.inv(np.eye(3)).sum())
print(cv2.imdecode(cv2.imencode(".png", picture)[1], 1).sum())
"""


def test_only_areas_of_files_that_were_never_written_are_let_go():
    assert list(unwritten(SMAPS)) == [(0x7F00, 0x7F10), (0x7F10, 0x7F20), (0x7F70, 0x7F80)]


def test_a_process_that_let_its_libraries_go_has_less_and_works_as_before():
    done = subprocess.run([sys.executable, "-c", AS_BEFORE], check=True, capture_output=True, text=True, timeout=120)
    assert len(done.stdout.split()) == 3
