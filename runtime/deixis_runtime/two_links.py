"""Two connections to another host's router in place of one, so that answers do not queue behind frames."""

from __future__ import annotations

FRAMES = "prio=5-7"
THE_REST = "prio=1-4"
# What is in the socket's buffer has no priority any more, and none of it is dropped: it is old when it arrives. 64 kB are 65 ms
# at 8 Mbit/s, and with 20 ms each way they still carry 13 Mbit/s.
BUFFER = "so_sndbuf=65536"
PROTOCOLS = ("tcp/", "tls/")


def without_settings(endpoints: list[str]) -> list[str]:
    """The addresses among the endpoints, each once: for people, who gave one."""
    return list(dict.fromkeys(endpoint.partition("#")[0].partition("?")[0] for endpoint in endpoints))


def two_links(endpoint: str) -> list[str]:
    """The endpoints to connect to in place of this one; itself where it has priorities already, or its protocol no streams.

    Both routers must allow two links (`transport/unicast/max_links`).
    """
    address, _, settings = endpoint.partition("#")
    base, _, metadata = address.partition("?")
    if not endpoint.startswith(PROTOCOLS) or "prio=" in metadata:
        return [endpoint]
    if "so_sndbuf=" not in settings:
        settings = ";".join(part for part in (settings, BUFFER) if part)
    return [f"{base}?{';'.join(part for part in (metadata, range_) if part)}#{settings}" for range_ in (THE_REST, FRAMES)]
