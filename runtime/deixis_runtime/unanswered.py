"""Why no Zenoh router answers at an endpoint, found step by step: the name, the port, what listens there, its certificate."""

from __future__ import annotations

import errno
import os
import socket
import ssl
import time
from contextlib import suppress
from pathlib import Path

from . import certificate_check
from .certificates import Certificates
from .endpoint import OVER_TCP, SOCKET, Endpoint, NotAnEndpoint, read_endpoint
from .finding import Finding

WAIT_S = 2.0
GREETING_WAIT_S = 0.5
START_ROUTER = "start one there with 'deixis run' or 'deixis up --listen ...', or name another with --connect"
SPEAKS_TLS = "name it as tls/..., and the folder of your certificate with --certs or in DEIXIS_CERTS"
GIVE_CERTIFICATES = "name the folder with ca.pem, cert.pem and key.pem of this host in --certs or DEIXIS_CERTS"


def why_unanswered(text: str, certificates: Certificates | None) -> Finding:
    """Why a session could not be opened to this endpoint, as far as can be seen from here."""
    try:
        endpoint = read_endpoint(text)
    except NotAnEndpoint as error:
        return Finding("wrong", str(error), "mend --connect")
    if endpoint.protocol == SOCKET:
        return _why_socket(endpoint.host)
    try:
        addresses = socket.getaddrinfo(endpoint.host, endpoint.port, type=socket.SOCK_STREAM)
    except socket.gaierror as error:
        what = f"the host name '{endpoint.host}' of {text} cannot be resolved ({error.strerror})"
        return Finding("wrong", what, "mend the name, give the address instead, or enter it in DNS or /etc/hosts")
    if endpoint.protocol not in OVER_TCP:
        what = f"no Zenoh router answers at {text} ({addresses[0][4][0]})"
        return Finding("wrong", what, f"{START_ROUTER}; does a firewall keep UDP to port {endpoint.port} away?")
    try:
        connection = socket.create_connection((endpoint.host, endpoint.port), WAIT_S)
    except OSError as error:
        return _why_not_connected(text, endpoint, error)
    with connection:
        return _why_tls(text, endpoint, connection, certificates) if endpoint.protocol == "tls" else _why_plain(text, endpoint)


def who_listens(text: str) -> Finding | None:
    """Who has the port of a plain TCP endpoint where no session is opened; None where nobody does, or that cannot be seen."""
    try:
        endpoint = read_endpoint(text)
        if endpoint.protocol == "tcp":
            socket.create_connection((endpoint.host, endpoint.port), WAIT_S).close()
            return _why_plain(text, endpoint)
    except (NotAnEndpoint, OSError):
        pass  # then Zenoh's own words are all there is
    return None


def _why_socket(path: str) -> Finding:
    if not Path(path).exists():
        return Finding("wrong", f"the socket {path} is not there", START_ROUTER)
    with socket.socket(socket.AF_UNIX) as probe:
        probe.settimeout(WAIT_S)
        try:
            probe.connect(path)
        except PermissionError:
            return Finding(
                "wrong", f"the socket {path} may not be used by this user", "run as the router's user, or join its group"
            )
        except ConnectionRefusedError:
            return Finding("wrong", f"nobody listens on the socket {path}: its router has ended", START_ROUTER)
        except OSError as error:
            return Finding("wrong", f"the socket {path}: {error.strerror or error}", START_ROUTER)
    return Finding("wrong", f"what listens on the socket {path} is not a Zenoh router, or hangs", "restart it, or name another")


def _why_not_connected(text: str, endpoint: Endpoint, error: OSError) -> Finding:
    where = f"{endpoint.host}:{endpoint.port}"
    if isinstance(error, ConnectionRefusedError):
        return Finding("wrong", f"nobody listens at {text}: {where} refuses the connection", START_ROUTER)
    if isinstance(error, TimeoutError):
        advice = "is the host on, and the address right? A firewall that drops packets looks the same"
        return Finding("wrong", f"{text}: {where} does not answer within {WAIT_S:g} s", advice)
    if error.errno in (errno.ENETUNREACH, errno.EHOSTUNREACH):
        advice = "check the address, this host's network and its routes: ip route get " + endpoint.host
        return Finding("wrong", f"{text}: there is no route to {endpoint.host} ({os.strerror(error.errno)})", advice)
    return Finding("wrong", f"{text}: {where} cannot be reached: {error.strerror or error}", START_ROUTER)


def _why_plain(text: str, endpoint: Endpoint) -> Finding:
    """Somebody listens, but the session was not opened."""
    greeting = _greeting(endpoint)
    if greeting:
        return Finding("wrong", f"what listens at {text} is not a Zenoh router: it says '{greeting}'", START_ROUTER)
    spoken = _tls_is_spoken(endpoint)
    if spoken:
        return Finding("wrong", f"what listens at {text} speaks TLS", SPEAKS_TLS)
    if spoken is None:
        advice = (
            "is it stopped or overloaded there? Restart the router; else the port belongs to another program: choose --listen"
        )
        return Finding(
            "wrong", f"what listens at {text} takes the connection and says nothing: a router that hangs, or none", advice
        )
    return Finding("wrong", f"what listens at {text} is not a Zenoh router: the port belongs to another program", START_ROUTER)


def _greeting(endpoint: Endpoint) -> str:
    """What a server says of its own accord, as SSH does; a Zenoh router waits to be spoken to."""
    with suppress(OSError), socket.create_connection((endpoint.host, endpoint.port), WAIT_S) as connection:
        connection.settimeout(GREETING_WAIT_S)
        said = connection.recv(60).decode("ascii", "replace").strip()
        return "".join(letter for letter in said if letter.isprintable())
    return ""


def _tls_is_spoken(endpoint: Endpoint) -> bool | None:
    """Whether a TLS greeting is understood; None where it is not answered at all."""
    try:
        with socket.create_connection((endpoint.host, endpoint.port), WAIT_S) as connection:
            _tls_context(None).wrap_socket(connection).close()
            return True
    except TimeoutError:
        return None
    except ssl.SSLError as error:
        return "alert" in str(error).lower()
    except OSError:
        return False


def _why_tls(text: str, endpoint: Endpoint, connection: socket.socket, certificates: Certificates | None) -> Finding:
    """Go through the handshake as Zenoh does, and see who refuses whom."""
    ours = certificate_check.problem(certificates, time.time()) if certificates is not None else None
    if ours is not None:
        return ours
    connection.settimeout(WAIT_S)
    try:
        with _tls_context(certificates).wrap_socket(connection, server_hostname=endpoint.host) as secure:
            _await_refusal(secure)
    except OSError as error:
        return _why_no_handshake(text, error, certificates)
    if certificates is None:
        return Finding("wrong", f"{text} speaks TLS, and no certificates of ours are known", GIVE_CERTIFICATES)
    return Finding(
        "wrong",
        f"{text} takes our certificate, but no Zenoh session is opened",
        "is it stopped or overloaded there? Restart it",
    )


def _tls_context(certificates: Certificates | None) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    if certificates is not None:
        context.load_verify_locations(certificates.ca)
        context.load_cert_chain(certificates.certificate, certificates.key)
        context.verify_mode, context.check_hostname = ssl.CERT_REQUIRED, True
    return context


def _await_refusal(secure: ssl.SSLSocket) -> None:
    """By TLS 1.3 a server judges our certificate after its own handshake is over: a refusal is what comes next, as an error."""
    with suppress(TimeoutError):
        secure.recv(1)


def _why_no_handshake(text: str, error: OSError, certificates: Certificates | None) -> Finding:
    if isinstance(error, ssl.SSLCertVerificationError) and "mismatch" in error.verify_message:
        what = f"the certificate of {text} is that of another host: {error.verify_message}"
        return Finding("wrong", what, "name it as in its certificate, or have that issued with this --host")
    if isinstance(error, ssl.SSLCertVerificationError):
        advice = "the two hosts need certificates of the same CA, in date; has one been made anew? Are the clocks right?"
        return Finding("wrong", f"the certificate of {text} is refused by us: {error.verify_message}", advice)
    if isinstance(error, TimeoutError):
        return Finding(
            "wrong", f"what listens at {text} does not answer TLS", "name it as tcp/... if it is a router without TLS"
        )
    if isinstance(error, ssl.SSLError):
        return _say_alert(text, error, certificates)
    return Finding("wrong", f"{text}: the connection ends during the TLS handshake: {error.strerror or error}", START_ROUTER)


def _say_alert(text: str, error: ssl.SSLError, certificates: Certificates | None) -> Finding:
    said = str(error.reason or error).lower().replace("_", " ")
    if "alert" not in said:
        return Finding(
            "wrong", f"what listens at {text} does not speak TLS ({said})", "name it as tcp/... if it is such a router"
        )
    if certificates is None or "certificate required" in said:
        return Finding("wrong", f"{text} wants a certificate of us, and we show none ({said})", GIVE_CERTIFICATES)
    advice = "the two hosts need certificates of the same CA, in date: make ours anew with the CA that the other host trusts"
    return Finding("wrong", f"our certificate {certificates.certificate} is refused by {text}: {said}", advice)
