"""Decoder plug-in for the third-party `zenoh-cli`, found by it under the entry-point group `zenoh_cli.codecs.decoders`.

`zenoh get -s 'deixis/demo/fusion/state' --decoder deixis` then prints each message as one line of JSON.
"""

from __future__ import annotations

import base64
import json
from typing import Any

from . import codec
from .messages import Frame
from .topics import topic_of


def decode(key: object, payload: bytes) -> str:
    """One line of JSON for a payload under a key of Deixis; a deleted key's empty payload is `null`.

    Fields this reader does not know are kept; of a frame the image is left out, and other binary fields are base64. `key` is
    whatever prints as the key: zenoh-cli passes a KeyExpr, which is not named here, for this package never imports Zenoh.
    Raises codec.CodecError naming key and field; zenoh-cli shows it and goes on.
    """
    topic = topic_of(str(key))
    if topic is None:
        raise codec.WrongType(f"{key}: not a key of the contract")
    if not payload:
        return "null"
    try:
        # No msgpack map starts with '{' (that byte is the integer 123): by it a POI put as JSON is known.
        if payload.lstrip()[:1] == b"{":
            codec.decode_json(topic.type, payload)
            return json.dumps(json.loads(payload), ensure_ascii=False)
        content = codec.unpack(payload, max_bytes=topic.max_bytes)
        codec.validate(topic.type, content)
    except codec.CodecError as error:
        raise codec.Malformed(f"{key}: {error}") from None
    if topic.type is Frame:
        content["data"] = f"<{len(content['data'])} bytes left out>"
    return json.dumps(_printable(content), ensure_ascii=False)


def _printable(value: Any) -> Any:
    """The value with binary in base64, and what JSON cannot say (in fields we do not know) as text."""
    if isinstance(value, dict):
        return {str(name): _printable(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_printable(item) for item in value]
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    return value if value is None or isinstance(value, str | int | float | bool) else str(value)
