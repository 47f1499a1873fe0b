"""A site's certificate authority: its key, and the certificates of the site's members. Files and time are others' business.

X.509 v3 with keys on the curve P-256 (RFC 5280, RFC 5480): what Zenoh's TLS (rustls) and OpenSSL both take.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
from deixis_runtime.access import ROUTERS, Member

BACKDATED = timedelta(days=1)
"""A certificate holds from before it was made: the clock of a robot may be behind."""
HOST_CHARACTERS = frozenset("abcdefghijklmnopqrstuvwxyz0123456789.-")


class AuthorityError(ValueError):
    """A CA or certificate that cannot be made or read; the text says why."""


@dataclass(frozen=True)
class Pair:
    """A certificate and its private key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    def certificate_pem(self) -> bytes:
        """The certificate as PEM."""
        return self.certificate.public_bytes(serialization.Encoding.PEM)

    def key_pem(self) -> bytes:
        """The key as PEM (PKCS #8), not encrypted."""
        return self.key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )


def make_authority(site: str, now: datetime, lasts: timedelta) -> Pair:
    """A new CA that signs members' certificates only, no further CA."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"Deixis CA {site}"[:64])])
    usage = _usage(key_cert_sign=True, crl_sign=True)
    certificate = (
        _begun(name, name, key, now - BACKDATED, now + lasts)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return Pair(certificate, key)


def issue(authority: Pair, member: Member, hosts: Sequence[str], now: datetime, lasts: timedelta) -> Pair:
    """A new key and certificate of a member, which ends with the CA's at the latest.

    hosts: names and addresses by which others reach the member's router. Raises AuthorityError.
    """
    if hosts and member.role not in ROUTERS:
        raise AuthorityError(f"{member}: a {member.role} is reached by nobody, and so has no --host")
    ends = min(now + lasts, authority.certificate.not_valid_after_utc)
    if ends <= now:
        raise AuthorityError(f"the CA has expired on {ends:%Y-%m-%d}: make another one in another folder")
    begins = max(now - BACKDATED, authority.certificate.not_valid_before_utc)
    key = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, str(member))])
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH, *([ExtendedKeyUsageOID.SERVER_AUTH] if hosts else [])]
    issuer = authority.certificate.subject
    builder = (
        _begun(name, issuer, key, begins, ends)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(digital_signature=True), critical=True)
        # A viewer's certificate must not do for a router's.
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key()), critical=False)
    )
    if hosts:
        builder = builder.add_extension(x509.SubjectAlternativeName([_general_name(host) for host in hosts]), critical=False)
    return Pair(builder.sign(authority.key, hashes.SHA256()), key)


def read_pair(certificate: bytes, key: bytes) -> Pair:
    """A certificate and its key from PEM. Raises AuthorityError."""
    try:
        private = serialization.load_pem_private_key(key, password=None)
    except (ValueError, TypeError) as error:
        raise AuthorityError(f"the key cannot be read: {error}") from None
    if not isinstance(private, ec.EllipticCurvePrivateKey):
        raise AuthorityError("the key is not of the kind that 'deixis certs' makes")
    pair = Pair(read_certificate(certificate), private)
    if pair.certificate.public_key() != private.public_key():
        raise AuthorityError("the key is not that of the certificate")
    return pair


def read_certificate(pem: bytes) -> x509.Certificate:
    """A certificate from PEM. Raises AuthorityError."""
    try:
        return x509.load_pem_x509_certificate(pem)
    except ValueError as error:
        raise AuthorityError(f"the certificate cannot be read: {error}") from None


def is_signed_by(certificate: x509.Certificate, authority: x509.Certificate) -> bool:
    """Whether the CA has signed the certificate."""
    try:
        certificate.verify_directly_issued_by(authority)
    except (ValueError, TypeError, InvalidSignature):
        return False
    return True


def common_name(certificate: x509.Certificate) -> str:
    """The common name; empty where it has none."""
    names = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(names[0].value) if names else ""


def hosts_of(certificate: x509.Certificate) -> list[str]:
    """Names and addresses by which its holder is reached."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [str(name.value) for name in names]


def _begun(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, begins: datetime, ends: datetime
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begins)
        .not_valid_after(ends)
    )


def _usage(**given: bool) -> x509.KeyUsage:
    names = (
        *("digital_signature", "content_commitment", "key_encipherment", "data_encipherment", "key_agreement"),
        *("key_cert_sign", "crl_sign", "encipher_only", "decipher_only"),
    )
    return x509.KeyUsage(**{name: given.get(name, False) for name in names})


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        pass  # a name, then
    labels = host.lower().split(".")
    if len(host) > 253 or not set(host.lower()) <= HOST_CHARACTERS or not all(0 < len(label) < 64 for label in labels):
        raise AuthorityError(f"'{host[:80]}' is neither a host name nor an address")
    return x509.DNSName(host.lower())
