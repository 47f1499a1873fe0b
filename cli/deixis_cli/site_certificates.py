"""The folder of a site's certificates on disk: the CA, one folder for each member, and the list of access.

    DIR/ca.pem  ca.key  access.json
    DIR/edge-e1/ca.pem  cert.pem  key.pem  access.json      what is copied to the host

Nothing is overwritten but what `renew` makes anew, and that only when all of it is there.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from cryptography import x509
from deixis_runtime.access import ROUTERS, AccessError, AccessList, Member, member_of, read_access

from . import authority
from .authority import AuthorityError, Pair
from .options import CommandError

CA, CA_KEY, CERTIFICATE, KEY, ACCESS = "ca.pem", "ca.key", "cert.pem", "key.pem", "access.json"
MAX_PEM_BYTES = 64 << 10


@dataclass(frozen=True)
class Held:
    """One certificate in the folder. member: none for the CA's own."""

    member: Member | None
    folder: Path
    certificate: x509.Certificate
    signed: bool


class SiteFolder:
    """The folder of a site. Its methods raise CommandError, which names the file."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def create(self, now: datetime, lasts: timedelta, *, frames_stay: bool) -> None:
        """Make the CA and an empty list. Refuses where there is a CA already."""
        try:
            self.path.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as error:
            raise CommandError(f"{self.path}: {error.strerror}") from None
        for name in (CA_KEY, CA, ACCESS):
            if (self.path / name).exists():
                raise CommandError(f"{self.path / name} is there already: a CA is never overwritten; name another folder")
        pair = authority.make_authority(self.path.resolve().name, now, lasts)
        _write_new(self.path / CA_KEY, pair.key_pem(), 0o600)
        _write_new(self.path / CA, pair.certificate_pem(), 0o644)
        self._write_list(AccessList(members=(), frames_stay=frames_stay))

    def issue(self, member: Member, hosts: Sequence[str], now: datetime, lasts: timedelta) -> Path:
        """Make a member's folder. Refuses where there is one already, or the edge has no host."""
        listed = self.access()
        if str(member) in listed.members or self.folder(member).exists():
            raise CommandError(f"{member} has a certificate in {self.folder(member)}: 'deixis certs renew' makes another one")
        if member.role == "edge" and not hosts:
            raise CommandError(f"{member}: give the name or address by which robots reach it: --host NAME")
        self._make_folder(member, hosts, now, lasts)
        self._write_list(_with(listed, member))
        return self.folder(member)

    def renew(self, member: Member, now: datetime, lasts: timedelta) -> Path:
        """Make a member's key and certificate anew, for the same hosts."""
        held = self.held(member)
        self._make_folder(member, authority.hosts_of(held.certificate), now, lasts)
        self._write_list(_with(self.access(), member))
        return self.folder(member)

    def revoke(self, member: Member) -> None:
        """Take a member from the list, and remove its folder."""
        listed = self.access()
        if str(member) not in listed.members:
            raise CommandError(f"{member} is not in {self.path / ACCESS}")
        self._write_list(listed.model_copy(update={"members": tuple(m for m in listed.members if m != str(member))}))
        shutil.rmtree(self.folder(member), ignore_errors=False)

    def keep_frames(self, stay: bool) -> None:
        """Say whether frames stay on the robots of this site."""
        self._write_list(self.access().model_copy(update={"frames_stay": stay}))

    def folder(self, member: Member) -> Path:
        """Where a member's files lie."""
        return self.path / f"{member.role}-{member.name}"

    def access(self) -> AccessList:
        """The site's list."""
        try:
            return read_access(self.path / ACCESS)
        except AccessError as error:
            raise CommandError(f"{error}; 'deixis certs init {self.path}' makes a new site") from None

    def members(self) -> list[Member]:
        """All who are on the list, by role and name."""
        return sorted(member for text in self.access().members if (member := member_of(text)) is not None)

    def held(self, member: Member) -> Held:
        """A member's certificate."""
        return _held(member, self.folder(member), self._authority_certificate())

    def all_held(self) -> list[Held]:
        """The CA's certificate, and those of all members."""
        own = self._authority_certificate()
        return [Held(None, self.path, own, signed=True), *(self.held(member) for member in self.members())]

    def _authority_certificate(self) -> x509.Certificate:
        return _read_certificate(self.path / CA)

    def _authority(self) -> Pair:
        try:
            return authority.read_pair(_read(self.path / CA), _read(self.path / CA_KEY))
        except AuthorityError as error:
            raise CommandError(f"{self.path}: {error}") from None

    def _make_folder(self, member: Member, hosts: Sequence[str], now: datetime, lasts: timedelta) -> None:
        try:
            pair = authority.issue(self._authority(), member, hosts, now, lasts)
        except AuthorityError as error:
            raise CommandError(str(error)) from None
        folder, fresh = self.folder(member), self.path / f".{member.role}-{member.name}.new"
        shutil.rmtree(fresh, ignore_errors=True)  # left by one that was killed
        fresh.mkdir(mode=0o700)
        _write_new(fresh / KEY, pair.key_pem(), 0o600)
        _write_new(fresh / CERTIFICATE, pair.certificate_pem(), 0o644)
        _write_new(fresh / CA, _read(self.path / CA), 0o644)
        old = self.path / f".{member.role}-{member.name}.old"
        shutil.rmtree(old, ignore_errors=True)
        if folder.exists():
            folder.rename(old)
        fresh.rename(folder)
        shutil.rmtree(old, ignore_errors=True)

    def _write_list(self, listed: AccessList) -> None:
        """Write the list, and its copies for all hosts with a router."""
        text = (listed.model_dump_json(indent=1) + "\n").encode("utf-8")
        routers = [member for role in ROUTERS for member in listed.of_role(role)]
        for folder in (self.path, *(self.folder(member) for member in routers)):
            fresh = folder / f".{ACCESS}.new"
            try:
                fresh.write_bytes(text)
                fresh.rename(folder / ACCESS)
            except OSError as error:
                raise CommandError(f"{folder / ACCESS}: {error.strerror}") from None


def _with(listed: AccessList, member: Member) -> AccessList:
    if str(member) in listed.members:
        return listed
    return listed.model_copy(update={"members": (*listed.members, str(member))})


def held_on_host(folder: Path) -> list[Held]:
    """The CA's certificate and the host's own in a member's folder. Raises CommandError."""
    own = _read_certificate(folder / CA)
    member = member_of(authority.common_name(_read_certificate(folder / CERTIFICATE)))
    return [Held(None, folder, own, signed=True), _held(member, folder, own)]


def _held(member: Member | None, folder: Path, own: x509.Certificate) -> Held:
    certificate = _read_certificate(folder / CERTIFICATE)
    return Held(member, folder, certificate, authority.is_signed_by(certificate, own))


def _read_certificate(path: Path) -> x509.Certificate:
    try:
        return authority.read_certificate(_read(path))
    except AuthorityError as error:
        raise CommandError(f"{path}: {error}") from None


def _read(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAX_PEM_BYTES)
    except OSError as error:
        raise CommandError(f"{path}: {error.strerror}") from None


def _write_new(path: Path, content: bytes, mode: int) -> None:
    """Write a file that was not there, never readable by more than `mode` says. Raises CommandError."""
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
    except OSError as error:
        raise CommandError(f"{path}: {error.strerror}") from None
