"""Standard output for what a command says, and nothing else."""

from __future__ import annotations

import contextlib
import os
import sys

STANDARD_OUTPUT, STANDARD_ERROR = 1, 2


def keep_output_to_ourselves() -> None:
    """Let what others in this process write to standard output go to standard error.

    Zenoh's log goes to standard output, seldom, as when a client joins a stream ("Received Data for unknown expr_id"), and
    broke the JSON that a program was reading there.
    """
    sys.stdout.flush()
    with contextlib.suppress(OSError):  # closed by whoever started us: then there is nothing to keep
        ours = os.dup(STANDARD_OUTPUT)
        line_buffered = 1 if os.isatty(ours) else -1
        sys.stdout = open(ours, "w", buffering=line_buffered, encoding=sys.stdout.encoding, errors=sys.stdout.errors)  # noqa: SIM115
        os.dup2(STANDARD_ERROR, STANDARD_OUTPUT)
