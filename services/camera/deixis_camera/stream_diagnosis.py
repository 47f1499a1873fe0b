"""Why a URL gives no video, in words: asks the server once more, by itself."""

from __future__ import annotations

import base64
import http.client
import socket
import ssl
from urllib.parse import SplitResult, unquote

PORTS = {"http": 80, "https": 443, "rtsp": 554, "rtsps": 322}
PROBE_TIMEOUT_S = 2.0


def why_no_stream(parts: SplitResult) -> str:
    """Why a URL gives no video, to follow its name in a sentence: asks the server once more, with a short time limit."""
    host, port = parts.hostname or "", parts.port or PORTS[parts.scheme]
    try:
        status = _ask_http(parts, host, port) if parts.scheme.startswith("http") else _ask_rtsp(parts, host, port)
    except socket.gaierror:
        return f"is not reached: the name '{host}' is not known"
    except ConnectionRefusedError:
        return f"is not reached: nothing listens at {host}:{port} (connection refused)"
    except TimeoutError:
        return f"does not answer: no answer from {host}:{port} within {PROBE_TIMEOUT_S:g} s"
    except ssl.SSLCertVerificationError as error:
        return f"is not trusted: {error.verify_message}"
    except (OSError, http.client.HTTPException, ValueError) as error:
        return f"is not reached at {host}:{port}: {_plain(error)}"
    return _say(status, parts)


def _say(status: int, parts: SplitResult) -> str:
    if status in (401, 403):
        return f"is refused by the server ({status}): " + (
            "wrong user or password" if parts.username else "it asks for a password"
        )
    if status == 404:
        return "is not there: the server knows no such path (404)"
    if status >= 400:
        return f"is refused by the server (status {status})"
    return "is answered by the server, but what it sends is not a video"


def _ask_http(parts: SplitResult, host: str, port: int) -> int:
    """Status of a GET. Raises OSError or http.client.HTTPException."""
    kind = http.client.HTTPSConnection if parts.scheme == "https" else http.client.HTTPConnection
    connection = kind(host, port, timeout=PROBE_TIMEOUT_S)
    try:
        target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
        connection.request("GET", target, headers=_basic_authorisation(parts))
        return connection.getresponse().status
    finally:
        connection.close()


def _ask_rtsp(parts: SplitResult, host: str, port: int) -> int:
    """Status of a DESCRIBE (RFC 2326, 10.2). Raises OSError, or ValueError where the answer is not RTSP."""
    with socket.create_connection((host, port), timeout=PROBE_TIMEOUT_S) as plain:
        connection: socket.socket = plain
        if parts.scheme == "rtsps":
            connection = ssl.create_default_context().wrap_socket(plain, server_hostname=host)
        headers = "".join(f"{name}: {value}\r\n" for name, value in _basic_authorisation(parts).items())
        url = f"{parts.scheme}://{host}:{port}{parts.path}" + (f"?{parts.query}" if parts.query else "")
        connection.sendall(f"DESCRIBE {url} RTSP/1.0\r\nCSeq: 1\r\n{headers}\r\n".encode())
        answer = connection.recv(256).split()
    if len(answer) < 2 or not answer[0].startswith(b"RTSP/") or not answer[1].isdigit():
        raise ValueError("what answers there does not speak RTSP")
    return int(answer[1])


def _basic_authorisation(parts: SplitResult) -> dict[str, str]:
    if not parts.username:
        return {}
    pair = f"{unquote(parts.username)}:{unquote(parts.password or '')}".encode()
    return {"Authorization": "Basic " + base64.b64encode(pair).decode()}


def _plain(error: Exception) -> str:
    # Only what carries no URL: the texts of http.client's exceptions quote the request.
    if isinstance(error, OSError):
        return error.strerror or type(error).__name__
    return str(error) if type(error) is ValueError else f"unintelligible answer ({type(error).__name__})"
