"""Certificates of a site made for a test, with any dates."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

from deixis_cli.site_certificates import SiteFolder
from deixis_runtime.access import member_of
from deixis_runtime.certificates import VARIABLE, Certificates

LONG = timedelta(days=3650)
YEAR = timedelta(days=365)


def make_site(folder: Path, *, frames_stay: bool = False) -> SiteFolder:
    """A site in a new folder whose CA is older than any certificate of a test. Members are added by `add`."""
    site = SiteFolder(folder)
    site.create(datetime.now(UTC) - timedelta(days=100), LONG, frames_stay=frames_stay)
    return site


def add(site: SiteFolder, name: str, *hosts: str, made_days_ago: float = 0, lasts: timedelta = YEAR) -> Certificates:
    """Make a member's certificate, and give its folder."""
    member = member_of(name)
    assert member is not None, name
    made = datetime.now(UTC).replace(microsecond=0) - timedelta(days=made_days_ago)
    return Certificates(site.issue(member, hosts, made, lasts))


@contextmanager
def holder(certificates: Certificates | None) -> Iterator[None]:
    """As one who has this folder of certificates; none for a program of the host itself."""
    before = os.environ.pop(VARIABLE, None)
    if certificates is not None:
        os.environ[VARIABLE] = str(certificates.folder)
    try:
        yield
    finally:
        os.environ.pop(VARIABLE, None)
        if before is not None:
            os.environ[VARIABLE] = before
