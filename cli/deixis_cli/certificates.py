"""The folder with this host's certificate: whether what a router and its clients need of it is there."""

from __future__ import annotations

import os
import ssl
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

VARIABLE = "DEIXIS_CERTS"


@dataclass(frozen=True)
class Certificates:
    """A folder that holds `ca.pem`, `cert.pem` and `key.pem`."""

    folder: Path

    @property
    def ca(self) -> Path:
        """The certificate of the site's CA."""
        return self.folder / "ca.pem"

    @property
    def certificate(self) -> Path:
        """The certificate of this host."""
        return self.folder / "cert.pem"

    @property
    def key(self) -> Path:
        """The key of this host's certificate."""
        return self.folder / "key.pem"

    def problem(self) -> str | None:
        """Why the folder cannot be used, in one sentence that names the file; None where nothing is against it."""
        for path in (self.ca, self.certificate, self.key):
            try:
                path.read_bytes()
            except FileNotFoundError:
                return f"{path} is not there"
            except OSError as error:
                return f"{path} cannot be read: {error.strerror or error}"
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        try:
            context.load_verify_locations(self.ca)
        except ssl.SSLError:
            return f"{self.ca} holds no certificate"
        try:
            context.load_cert_chain(self.certificate, self.key)
        except ssl.SSLError as error:
            mismatch = "mismatch" in str(error.reason).lower()
            return (
                f"{self.key} is not the key of {self.certificate}"
                if mismatch
                else f"{self.certificate} and its key are damaged"
            )
        if self.key.stat().st_mode & 0o007:
            return f"{self.key} may be read by everybody on this host"
        return None


def certificates_of(environment: Mapping[str, str] = os.environ) -> Certificates | None:
    """The folder that the environment names; None where it names none."""
    folder = environment.get(VARIABLE)
    return Certificates(Path(folder)) if folder else None
