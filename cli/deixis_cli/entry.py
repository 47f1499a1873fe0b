"""The console script: imports nothing of weight before it must, so that help is quick and Ctrl-C leaves no traceback.

Imports take a second or more on a busy machine. What Ctrl-C interrupts in them may be reported as anything, and a
KeyboardInterrupt may be swallowed there: so it ends the process at once, which has begun nothing yet. Python's own start,
before this module, is beyond us.
"""

from __future__ import annotations

import os
import signal
import sys

INTERRUPTED = 130


def command() -> None:
    """Run the command line. Never returns: exit status as `main`'s."""
    before = signal.getsignal(signal.SIGINT)
    if before is signal.default_int_handler:  # it may be ignored, as in a shell's background, and stays so
        signal.signal(signal.SIGINT, _leave)
    from . import overview  # noqa: PLC0415 - it is all about imports, of which these are the first

    if overview.is_enough(sys.argv[1:]):
        overview.show(sys.argv[1:])
    from . import main  # noqa: PLC0415

    signal.signal(signal.SIGINT, before)
    main.command()


def _leave(_number: int, _frame: object) -> None:
    os._exit(INTERRUPTED)
