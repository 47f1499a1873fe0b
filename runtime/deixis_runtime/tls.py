"""The settings of Zenoh's TLS, of clients and routers alike."""

from __future__ import annotations

from typing import Any

from .certificates import Certificates


def tls_settings(certificates: Certificates) -> dict[str, Any]:
    """The settings `transport/link/tls` of a session with these certificates: mutual TLS."""
    own, key = str(certificates.certificate), str(certificates.key)
    return {
        "root_ca_certificate": str(certificates.ca),
        "listen_certificate": own,
        "listen_private_key": key,
        "connect_certificate": own,
        "connect_private_key": key,
        "enable_mtls": True,
        # Zenoh looks at dates when a link begins, and a link may last for months.
        "close_link_on_expiration": True,
    }
