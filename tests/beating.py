"""Programs that give signs as stages do, for tests of those who hear them."""

# As a stage does: alive several times a second.
BEATS = """
import os, time
from contextlib import suppress
from deixis_runtime.manager import Manager, Unheard
manager = Manager(os.environ)
print("up", os.getpid(), flush=True)
while True:
    with suppress(Unheard):
        manager.tell(time.monotonic())
    time.sleep(0.05)
"""
# The same, and then it waits within the kernel for longer than silence is borne, as on a disk: it lets a child have its turn
# first (CLONE_VFORK). Such a wait, or one for a processor, is no fault of the process.
WAITS = (
    BEATS.replace("while True", "until = time.monotonic() + 1\nwhile time.monotonic() < until")
    + """
import ctypes, platform
clone, vfork, sigchld = {"x86_64": 56, "aarch64": 220}[platform.machine()], 0x4000, 17
if ctypes.PyDLL(None).syscall(clone, vfork | sigchld, 0, 0, 0, 0) == 0:
    time.sleep(2)
    os._exit(0)
manager.tell(time.monotonic())
print("back", os.getpid(), flush=True)
time.sleep(60)
"""
)
