"""A process that has imported what the stages of a host import, and forks them: they share that memory, and start at once.

Imports are most of what a stage holds: thirty megabytes of Python objects, the same in each. Forked from here they are there
once, until somebody writes to them. A process started from nothing needs half a second for them; one that is forked, none.

Zenoh does not survive a fork, so nothing here opens a session; and a process with threads may be forked in the middle of what
they do, so this one refuses its work where an import has started a thread. `launching.ForkServer` starts it and asks it.

A child is forked twice, so that it becomes the supervisor's own (which adopts orphans: PR_SET_CHILD_SUBREAPER). So it
outlives this process, and the supervisor learns of its end as of any child's. It begins when the supervisor, who then knows it,
says so through a pipe that came with the request: an answer that comes too late leaves nobody behind.
"""

from __future__ import annotations

import importlib
import json
import os
import socket
import sys
import traceback
from collections.abc import Callable, Sequence
from typing import Any

from setproctitle import setproctitle

from .memory import settle
from .session import exit_now

EXIT_FAULT = 1
MAX_REQUEST = 1 << 20


def main() -> int:
    """Serve the socket that is standard input: first targets (`module:function`) to import, then requests to fork."""
    asked = socket.socket(fileno=os.dup(0))
    _take_null_input()
    loaded, failed = _preload(json.loads(asked.recv(MAX_REQUEST)))
    threads = len(os.listdir("/proc/self/task"))
    if threads > 1:
        failed["*"] = f"what they import has started {threads - 1} threads"
        loaded = {}
    settle()
    asked.send(json.dumps({"loaded": list(loaded), "failed": failed}).encode())
    while True:
        request, go, _, _ = socket.recv_fds(asked, MAX_REQUEST, 1)
        if not request:
            return 0
        asked.send(json.dumps({"pid": _fork(asked, loaded, json.loads(request), go[0])}).encode())
        os.close(go[0])


def _preload(targets: Sequence[str]) -> tuple[dict[str, Callable[..., int]], dict[str, str]]:
    """The functions by target, and why the others could not be imported: those are started from nothing, and say more."""
    loaded: dict[str, Callable[..., int]] = {}
    failed: dict[str, str] = {}
    for target in targets:
        module, _, function = target.partition(":")
        try:
            loaded[target] = getattr(importlib.import_module(module), function)
        except Exception as error:  # whatever a module does when it is imported must not take the others with it
            failed[target] = f"{type(error).__name__}: {error}"
    return loaded, failed


def _fork(asked: socket.socket, loaded: dict[str, Callable[..., int]], request: dict[str, Any], go: int) -> int:
    """The process number of a new child of our parent, which begins when something comes from the descriptor `go`."""
    reader, writer = os.pipe()
    middle = os.fork()
    if middle == 0:
        child = os.fork()
        if child == 0:
            for descriptor in (reader, writer, asked.detach()):
                os.close(descriptor)
            _become(loaded[request["target"]], request, go)
        os.write(writer, str(child).encode())
        os._exit(0)
    os.close(writer)
    pid = int(os.read(reader, 32))
    os.close(reader)
    os.waitpid(middle, 0)
    return pid


def _become(function: Callable[..., int], request: dict[str, Any], go: int) -> None:
    """Be the process that was asked for; never returns."""
    status: object = EXIT_FAULT
    try:
        if not os.read(go, 1):
            raise SystemExit("the supervisor is gone")
        os.close(go)
        os.setpgid(0, 0)
        sys.argv = request["argv"]
        # `ps` and `top` show the command that was asked for. Before the environment changes, beside which the title lies.
        setproctitle(" ".join([os.path.basename(sys.argv[0]), *sys.argv[1:]]))
        os.environ.clear()
        os.environ.update(request["environment"])
        status = function(sys.argv[request["skipped"] :])
    except SystemExit as error:  # argparse: bad usage
        status = error.code or 0
    except BaseException:
        traceback.print_exc()
    finally:
        exit_now(status if isinstance(status, int) else EXIT_FAULT)


def _take_null_input() -> None:
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    os.close(null)


if __name__ == "__main__":
    raise SystemExit(main())
