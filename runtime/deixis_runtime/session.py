"""Opening and closing Zenoh sessions: explicit endpoints, no scouting, bounded waits."""

from __future__ import annotations

import contextlib
import json
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import zenoh

from .certificates import VARIABLE, certificates_of
from .endpoint import NotAnEndpoint, is_guarded, read_endpoint
from .finding import Finding
from .leftovers import let_go
from .tls import tls_settings

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
CONNECT_TIMEOUT_MS = 2000
# A router that ended is back within half a second; Zenoh's own pauses between two tries are one second, two and four.
RETRY = {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 1.5}
CLOSE_TIMEOUT_S = 3.0
# A session that publishes a message of this size or more lays out 16 MB of shared memory for such. Below it shared memory is no
# faster; Zenoh's own limit of 3 kB made a stage pay for a busy room's contours.
SHARED_FROM_BYTES = 65_536


class Unreachable(ConnectionError):
    """No router answers at the endpoint; the text names it. why: what was found by looking into it, if that was done."""

    def __init__(self, text: str, why: Finding | None = None) -> None:
        super().__init__(text)
        self.why = why


def base_config(mode: str, file: Path | None = None) -> zenoh.Config:
    """A Zenoh configuration with what every session of ours has in common. Raises Unreachable for a bad `file`."""
    try:
        config = zenoh.Config.from_file(str(file)) if file else zenoh.Config()
    except zenoh.ZError as error:
        raise Unreachable(f"Zenoh configuration {file}: {first_line(error)}") from None
    config.insert_json5("mode", json.dumps(mode))
    # Multicast scouting fails in containers, on Wi-Fi and on fresh interfaces, and lets robots find each other by accident.
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    return config


def client_config(endpoint: str, *, shared_memory: bool = True) -> zenoh.Config:
    """Configuration of a client of the router at `endpoint`, with the certificates that the environment names."""
    config = base_config("client")
    config.insert_json5("transport/shared_memory/enabled", json.dumps(shared_memory))
    config.insert_json5("transport/shared_memory/transport_optimization/message_size_threshold", str(SHARED_FROM_BYTES))
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("connect/timeout_ms", json.dumps(CONNECT_TIMEOUT_MS))
    config.insert_json5("connect/exit_on_failure", "true")
    config.insert_json5("connect/retry", json.dumps(RETRY))
    certificates = certificates_of()
    if certificates is not None and is_guarded(endpoint):
        put_settings(config, {f"transport/link/tls/{name}": value for name, value in tls_settings(certificates).items()})
    return config


@contextmanager
def open_client(endpoint: str, *, shared_memory: bool = True) -> Iterator[zenoh.Session]:
    """A client session, closed at the end within a bounded time.

    A process that opens several sessions in turn goes without shared memory: each would leave 16 MB of it behind.

    Raises Unreachable when no router answers. An uncaught exception with callbacks declared would leave a process that
    never exits, so sessions are opened here and nowhere else.
    """
    zenoh.init_log_from_env_or("error")
    if is_guarded(endpoint) and certificates_of() is None:
        raise Unreachable(f"{endpoint}: TLS needs a certificate: name the folder of yours with --certs or in {VARIABLE}")
    try:
        session = zenoh.open(client_config(endpoint, shared_memory=shared_memory))
    except zenoh.ZError as error:
        raise _unreachable(endpoint, first_line(error)) from None
    try:
        yield session
    finally:
        close(session)


def _unreachable(endpoint: str, said: str) -> Unreachable:
    """Zenoh says only that the time is over where a certificate is refused, or what has the port is no such router."""
    # Here, for it needs `ssl`, and a session that opens does not.
    from .unanswered import who_listens, why_unanswered  # noqa: PLC0415

    try:
        read_endpoint(endpoint)
    except NotAnEndpoint as error:
        return Unreachable(str(error))
    why = why_unanswered(endpoint, certificates_of()) if is_guarded(endpoint) else who_listens(endpoint)
    if why is None:
        advice = "start one with 'deixis run' or 'deixis up', or name another with --connect"
        return Unreachable(f"no Zenoh router answers at {endpoint} ({said}); {advice}")
    return Unreachable(f"no session with {endpoint}: {why.what}{f'; {why.advice}' if why.advice else ''}", why)


def close(session: zenoh.Session) -> None:
    """Close a session; on a cut link Zenoh takes 10 s and raises, so this waits a bounded time only."""

    def work() -> None:
        with contextlib.suppress(zenoh.ZError):  # the link is gone already: there is nobody to say good-bye to
            session.close()  # type: ignore[no-untyped-call]

    thread = threading.Thread(target=work, daemon=True, name="zenoh-close")
    thread.start()
    thread.join(CLOSE_TIMEOUT_S)


def exit_now(status: int) -> None:
    """Leave the process at once, after flushing: Rust threads of a session that would not close keep it alive otherwise.

    What this process is the last to hold of Zenoh's shared memory goes with it.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):  # nobody reads any more, as in `deixis watch | head`
            stream.flush()
    with contextlib.suppress(OSError):  # there is no /proc: then there is none of this to remove
        let_go()
    os._exit(status)


def first_line(error: BaseException) -> str:
    """The text of a Zenoh error without the place in its source."""
    text = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
    return text.split(" at /")[0].strip(" !")


def put_settings(config: zenoh.Config, settings: dict[str, Any]) -> None:
    """Insert values under their paths into a configuration."""
    for path, value in settings.items():
        config.insert_json5(path, json.dumps(value))
