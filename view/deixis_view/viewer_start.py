"""Becomes Rerun's viewer, and has the kernel end it with whoever started it: killed, we could not do so ourselves."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
from pathlib import Path

import rerun_cli

PR_SET_PDEATHSIG = 1


def main() -> None:
    """Never returns. The first argument is the process number of who starts it, the others are the viewer's."""
    parent, arguments = int(sys.argv[1]), sys.argv[2:]
    program = Path(rerun_cli.__file__).parent / "rerun"
    if sys.platform != "linux" or not program.exists():
        os.execv(sys.executable, [sys.executable, "-m", "rerun_cli", *arguments])
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() == parent:  # else it has ended before
        os.execv(program, [str(program), *arguments])


if __name__ == "__main__":
    main()
