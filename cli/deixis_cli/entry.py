"""The console script: imports nothing of weight before it must, so that help is quick and Ctrl-C leaves no traceback.

Imports take a second or more on a busy machine. What Ctrl-C interrupts in them may be reported as anything, and a
KeyboardInterrupt may be swallowed there: so it ends the process at once, which has begun nothing yet.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

INTERRUPTED = 130


def command() -> None:
    """Run the command line. Never returns: exit status as `main`'s."""
    with _leaving_at_once():
        from . import overview  # noqa: PLC0415 - imports are what it is about

        if overview.is_enough(sys.argv[1:]):
            overview.show(sys.argv[1:])
        from . import main  # noqa: PLC0415
    main.command()


@contextmanager
def _leaving_at_once() -> Iterator[None]:
    """While entered, Ctrl-C ends the process; where it is ignored, as in a shell's background, it stays so."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _leave(_number: int, _frame: FrameType | None) -> None:
    os._exit(INTERRUPTED)
