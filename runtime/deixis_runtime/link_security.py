"""How a router's links are guarded: mutual TLS and access control by a folder of certificates; no listener open by accident."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import zenoh

from .access import AccessError, AccessList, read_access
from .access_control import access_control, frames_stay_here
from .certificates import Certificates
from .endpoint import faces_network, is_guarded
from .tls import tls_settings


class SecurityError(ValueError):
    """A router that must not start so; the text is one sentence that says why and what to do."""


@dataclass(frozen=True)
class LinkSecurity:
    """What a router is told of security.

    insecure: listeners that face the network without TLS are meant. frames_stay: frames do not leave this host.
    """

    certificates: Certificates | None = None
    insecure: bool = False
    frames_stay: bool = False


def secure(config: zenoh.Config, security: LinkSecurity, *, guarded: bool = False) -> None:
    """Put TLS and access control into a router's configuration. Raises SecurityError.

    guarded: it will be told of endpoints by TLS beside those in its configuration.
    """
    listen, connect = (endpoints(config, side) for side in ("listen", "connect"))
    mutual = security.certificates is not None or _value(config, "transport/link/tls/enable_mtls") is True
    if not security.insecure:
        refuse_open(listen, mutual=mutual)
    if security.certificates is not None:
        _check(security.certificates, listen)
        for name, value in tls_settings(security.certificates).items():
            config.insert_json5(f"transport/link/tls/{name}", json.dumps(value))
    listed = _listed(security, guarded or any(is_guarded(endpoint) for endpoint in (*listen, *connect)))
    stay = security.frames_stay or (listed is not None and listed.frames_stay)
    if (_value(config, "access_control") or {}).get("enabled"):  # who writes rules means them
        if stay:
            raise SecurityError("frames are to stay on the robot, but the Zenoh configuration has an access_control of its own")
        return
    if listed is not None:
        rules = access_control(listed.model_copy(update={"frames_stay": stay}))
        config.insert_json5("access_control", json.dumps(rules))
    elif stay:
        config.insert_json5("access_control", json.dumps(frames_stay_here()))


def refuse_open(listen: Sequence[str], *, mutual: bool) -> None:
    """Raise SecurityError where a listener faces the network without TLS, or with TLS that asks for no certificate."""
    for endpoint in listen:
        if faces_network(endpoint) and not (mutual and is_guarded(endpoint)):
            address = endpoint.partition("/")[2]
            raise SecurityError(
                f"refusing to listen on {endpoint}: whoever reaches it could see the pictures and change the answers; make "
                f"certificates with 'deixis certs' and listen on tls/{address} with --certs DIR, or say --insecure"
            )


def cautions(listen: Sequence[str], connect: Sequence[str]) -> list[str]:
    """What is to be said of endpoints that are used without TLS."""
    opened = [endpoint for endpoint in listen if faces_network(endpoint) and not is_guarded(endpoint)]
    clear = [endpoint for endpoint in connect if faces_network(endpoint) and not is_guarded(endpoint)]
    said = []
    if opened:
        said.append(f"insecure: whoever reaches {', '.join(opened)} may see and change everything")
    if clear:
        said.append(f"no TLS to {', '.join(clear)}: frames go there in clear, whoever it is")
    return said


def endpoints(config: zenoh.Config, side: str) -> list[str]:
    """The endpoints of a configuration, of `listen` or `connect`."""
    found = _value(config, f"{side}/endpoints")
    return [str(item) for item in found] if isinstance(found, list) else []


def _listed(security: LinkSecurity, guarded: bool) -> AccessList | None:
    """The list of access of a router with links by certificates; None for one without."""
    if security.certificates is None or not guarded:
        return None
    try:
        return read_access(security.certificates.access)
    except AccessError as error:
        raise SecurityError(f"{error}: a router needs the list of those who may link; copy it from the site's folder") from None


def _check(certificates: Certificates, listen: Sequence[str]) -> None:
    # Here, for a router without certificates needs no `ssl`, and neither do stages.
    from .certificate_check import CertificateError, read  # noqa: PLC0415

    try:
        certificate = read(certificates)
    except CertificateError as error:
        raise SecurityError(f"{error}; 'deixis certs' makes what is needed") from None
    reached = [endpoint for endpoint in listen if is_guarded(endpoint)]
    if reached and not certificate.hosts:
        raise SecurityError(
            f"refusing to listen on {reached[0]}: {certificate.file} ({certificate.common_name}) names no host by which others "
            "reach it; issue it with --host NAME"
        )


def _value(config: zenoh.Config, path: str) -> Any:
    try:
        return json.loads(config.get_json(path))
    except zenoh.ZError:  # not set
        return None
