"""Zenoh endpoints as text: their parts, and whether others on the network reach them."""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass

SOCKET = "unixsock-stream"
OVER_TCP = ("tcp", "tls", "ws")
PROTOCOLS = (*OVER_TCP, "quic", "udp", SOCKET)
GUARDED = ("tls", "quic")
WITHIN_HOST = (SOCKET, "unixpipe")


@dataclass(frozen=True)
class Endpoint:
    """A Zenoh endpoint, taken apart. `host` is a path where `protocol` is that of a Unix socket, and `port` is 0."""

    protocol: str
    host: str
    port: int


class NotAnEndpoint(ValueError):
    """A text that is no endpoint; says what is missing."""


def read_endpoint(text: str, *, least_port: int = 1) -> Endpoint:
    """The parts of `PROTOCOL/HOST:PORT` (metadata and settings behind `?` and `#` left out). Raises NotAnEndpoint.

    `least_port` is 0 for who listens: there it means any port that is free.
    """
    protocol, slash, rest = text.partition("/")
    if not slash or protocol not in PROTOCOLS:
        raise NotAnEndpoint(f"'{text}' is not an endpoint: it has to begin with {', '.join(f'{name}/' for name in PROTOCOLS)}")
    address = _address(rest)
    if protocol == SOCKET:
        return Endpoint(protocol, address, 0)
    host, colon, port = address.rpartition(":")
    if not colon or not host or not port.isdigit() or not least_port <= int(port) < 65536:
        raise NotAnEndpoint(f"'{text}' is not an endpoint: behind {protocol}/ it needs HOST:PORT, as in {protocol}/edge:7447")
    return Endpoint(protocol, host.strip("[]"), int(port))


def is_guarded(text: str) -> bool:
    """Whether a link to or from this endpoint is by TLS."""
    return _protocol(text) in GUARDED


def faces_network(text: str) -> bool:
    """Whether others than programs of this host come by this endpoint. A name other than localhost may lead anywhere."""
    if _protocol(text) in WITHIN_HOST:
        return False
    host = _address(text.partition("/")[2]).rpartition(":")[0].strip("[]")
    try:
        return not ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host != "localhost"


def _protocol(text: str) -> str:
    return text.partition("/")[0]


def _address(rest: str) -> str:
    return rest.partition("#")[0].partition("?")[0]
