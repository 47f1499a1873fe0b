"""What a host's certificate says and whether it holds, by the standard library alone: a robot needs no other.

The `ssl` module reads no certificate from a file, but that of a peer. So ours is shown to ourselves, in a handshake in memory;
that also proves that its key fits and that the CA has signed it.
"""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .access import EDITORS, Member, member_of
from .certificates import SOON_DAYS, Certificates
from .clock_watch import say_seconds
from .finding import Finding

DAY_S = 86_400
# X509_V_FLAG_NO_CHECK_TIME of OpenSSL: an expired certificate has to be read to say so.
NO_CHECK_TIME = ssl.VerifyFlags(0x200000)
RENEW = "'deixis certs renew' makes another one"
MOST_STEPS = 20


class CertificateError(ValueError):
    """Files of certificates that cannot be used; the text is one sentence that names the file."""


@dataclass(frozen=True)
class Certificate:
    """What a certificate says. It holds from `begins_s` to `ends_s` (Unix seconds), as the CA's own."""

    file: Path
    common_name: str
    hosts: tuple[str, ...]
    begins_s: float
    ends_s: float

    @property
    def member(self) -> Member | None:
        """Who has it; None for one that `deixis certs` has not made."""
        return member_of(self.common_name)


def read(certificates: Certificates) -> Certificate:
    """The certificate in a folder, its key and its CA checked, its dates not. Raises CertificateError."""
    for path in (certificates.ca, certificates.certificate, certificates.key):
        try:
            path.read_bytes()
        except FileNotFoundError:
            raise CertificateError(f"{path} is not there") from None
        except OSError as error:
            raise CertificateError(f"{path} cannot be read: {error.strerror or error}") from None
    if certificates.key.stat().st_mode & 0o007:
        raise CertificateError(f"{certificates.key} may be read by everybody on this host: chmod o= {certificates.key}")
    judge = _context(ssl.PROTOCOL_TLS_SERVER, certificates)
    judge.verify_mode = ssl.CERT_REQUIRED
    judge.verify_flags |= NO_CHECK_TIME
    holder = _context(ssl.PROTOCOL_TLS_CLIENT, certificates)
    holder.check_hostname, holder.verify_mode = False, ssl.CERT_NONE
    authority = judge.get_ca_certs()
    if not authority:
        raise CertificateError(f"{certificates.ca} holds no certificate of a CA")
    shown = _shown(holder, judge, certificates)
    ends = [ssl.cert_time_to_seconds(item["notAfter"]) for item in (*authority, shown)]
    names = [value for part in shown.get("subject", ()) for name, value in part if name == "commonName"]
    hosts = tuple(value for _, value in shown.get("subjectAltName", ()))
    begins_s = float(ssl.cert_time_to_seconds(shown["notBefore"]))
    return Certificate(certificates.certificate, names[0] if names else "", hosts, begins_s, float(min(ends)))


def standing(certificate: Certificate, now_s: float) -> Finding:
    """How the dates of a certificate stand at `now_s` (Unix seconds): ok, a note where they end soon, wrong outside them."""
    whose = f"the certificate {certificate.common_name} in {certificate.file}"
    if now_s >= certificate.ends_s:
        return Finding("wrong", f"{whose} has expired {say_seconds(now_s - certificate.ends_s)} ago", RENEW)
    if now_s < certificate.begins_s:
        ahead = say_seconds(certificate.begins_s - now_s)
        return Finding("wrong", f"{whose} is not valid yet, for another {ahead}", "is the clock of this host right?")
    left_s = certificate.ends_s - now_s
    soon = left_s < SOON_DAYS * DAY_S
    return Finding("note" if soon else "ok", f"{whose} expires in {say_seconds(left_s)}", RENEW if soon else "")


def problem(certificates: Certificates, now_s: float) -> Finding | None:
    """Why a folder cannot be used now; None where nothing is against it."""
    found = examine(certificates, now_s)
    return found if found.level == "wrong" else None


def examine(certificates: Certificates, now_s: float) -> Finding:
    """How the certificate in a folder stands at `now_s`."""
    try:
        return standing(read(certificates), now_s)
    except CertificateError as error:
        return Finding("wrong", str(error), "make it anew with 'deixis certs', or name another folder in DEIXIS_CERTS")


def who_may_not_edit(certificates: Certificates | None) -> Member | None:
    """Whose certificate this is, where access control means it not to edit POIs. Without one we are of the host itself."""
    member = whose(certificates)
    return member if member is not None and member.role not in EDITORS else None


def whose(certificates: Certificates | None) -> Member | None:
    """Whose certificate this is; None without one, or where it is no member's or cannot be read."""
    if certificates is None:
        return None
    try:
        return read(certificates).member
    except CertificateError:
        return None  # said where the folder itself is examined


def _context(protocol: int, certificates: Certificates) -> ssl.SSLContext:
    context = ssl.SSLContext(protocol)
    try:
        context.load_verify_locations(certificates.ca)
    except ssl.SSLError:
        raise CertificateError(f"{certificates.ca} holds no certificate") from None
    try:
        # Without a password of ours, that of an encrypted key would be asked for at the terminal.
        context.load_cert_chain(certificates.certificate, certificates.key, password="")
    except ssl.SSLError as error:
        if "mismatch" in str(error.reason).lower():
            raise CertificateError(f"{certificates.key} is not the key of {certificates.certificate}") from None
        raise CertificateError(f"{certificates.certificate} or its key {certificates.key} is damaged") from None
    return context


def _shown(holder: ssl.SSLContext, judge: ssl.SSLContext, certificates: Certificates) -> dict[str, Any]:
    """What the judge sees of the holder's certificate. Raises CertificateError where it is refused."""
    there, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    client = holder.wrap_bio(back, there)
    server = judge.wrap_bio(there, back, server_side=True)
    waiting = [client, server]
    for _ in range(MOST_STEPS):
        for side in tuple(waiting):
            try:
                side.do_handshake()
                waiting.remove(side)
            except ssl.SSLWantReadError:
                pass  # it waits for the other side
            except ssl.SSLCertVerificationError as error:
                why = f"{certificates.certificate} is not of the CA in {certificates.ca} ({error.verify_message})"
                raise CertificateError(why) from None
            except ssl.SSLError as error:
                raise CertificateError(f"{certificates.certificate} cannot be used: {error.reason or error}") from None
        if not waiting:
            return dict(server.getpeercert() or {})
    raise CertificateError(f"{certificates.certificate} cannot be used: the TLS handshake does not end")
