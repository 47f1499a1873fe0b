"""The folder with this host's certificate, and the environment variable that names it. What it holds: `certificate_check`."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

VARIABLE = "DEIXIS_CERTS"
SOON_DAYS = 30
"""A certificate that expires within so many days is worth a word."""


@dataclass(frozen=True)
class Certificates:
    """A folder that holds `ca.pem`, `cert.pem` and `key.pem`, on a host with a router also `access.json`."""

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

    @property
    def access(self) -> Path:
        """The list of those who may link to the site's routers."""
        return self.folder / "access.json"


def certificates_of(environment: Mapping[str, str] = os.environ) -> Certificates | None:
    """The folder that the environment names; None where it names none."""
    folder = environment.get(VARIABLE)
    return Certificates(Path(folder)) if folder else None


def add_certificates(parser: argparse.ArgumentParser) -> None:
    """--certs, which sets the environment variable: so it holds for the processes that this one starts, too."""
    parser.add_argument(
        "--certs",
        action=_IntoEnvironment,
        metavar="DIR",
        help=f"folder with the certificate of this host or person, as 'deixis certs' makes it (default: ${VARIABLE})",
    )


class _IntoEnvironment(argparse.Action):
    def __call__(
        self,
        _parser: argparse.ArgumentParser,
        _given: argparse.Namespace,
        value: str | Sequence[Any] | None,
        _name: str | None = None,
    ) -> None:
        os.environ[VARIABLE] = str(Path(str(value)).resolve())
