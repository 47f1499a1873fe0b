"""Bytes on the wire: msgpack maps, labelled `application/msgpack;Type/version`, checked on receipt."""

from __future__ import annotations

import json
from typing import Any, TypeVar

import msgpack
from pydantic import ValidationError

from .messages import TYPES, Message

MSGPACK = "application/msgpack"
JSON = "application/json"
MAX_JSON_BYTES = 1 << 20
MAX_LAID_OUT_BYTES = 256 << 10
LINE = 160

T = TypeVar("T", bound=Message)


class CodecError(ValueError):
    """A payload that the contract refuses; the text names the cause."""


class WrongType(CodecError):
    """Labelled as another type, or not labelled at all."""


class WrongVersion(CodecError):
    """The right type in a version that this reader does not speak."""


class Malformed(CodecError):
    """Not msgpack, too large, or a field that breaks its bounds."""


def encoding_of(type_: type[Message]) -> str:
    """The label that payloads of this type carry."""
    return f"{MSGPACK};{type_.__name__}/{type_.VERSION}"


def encode(message: Message) -> bytes:
    """The message as a msgpack map."""
    return pack(message.model_dump())


def pack(content: dict[str, Any]) -> bytes:
    """Plain data as a msgpack map."""
    return bytes(msgpack.packb(content, use_bin_type=True))


def decode(type_: type[T], payload: bytes, encoding: str, *, max_bytes: int = 1 << 20) -> T:
    """Read and validate a payload.

    Raises WrongType, WrongVersion or Malformed, each a CodecError.
    """
    _check_label(type_, encoding)
    return validate(type_, unpack(payload, max_bytes=max_bytes))


def oversize(size: int, max_bytes: int) -> str:
    """That a payload is too large, in words."""
    return f"{size} bytes, more than the {max_bytes} allowed"


def unpack(payload: bytes, *, max_bytes: int = 1 << 20) -> dict[str, Any]:
    """The msgpack map in `payload`, not validated. Raises Malformed."""
    if len(payload) > max_bytes:
        raise Malformed(oversize(len(payload), max_bytes))
    try:
        content = msgpack.unpackb(payload, raw=False)
    except (ValueError, msgpack.UnpackException, RecursionError) as error:
        # Some of msgpack's errors have no text.
        raise Malformed(f"not msgpack: {str(error) or type(error).__name__}") from None
    if not isinstance(content, dict):
        raise Malformed(f"not a map but {type(content).__name__}")
    return content


def decode_json(type_: type[T], text: bytes | str) -> T:
    """Read a message from JSON, as generic clients send it. Raises Malformed."""
    return validate(type_, parse_json(text))


def parse_json(text: bytes | str, *, max_bytes: int = MAX_JSON_BYTES) -> dict[str, Any]:
    """The JSON object in `text`, not validated. Raises Malformed."""
    if len(text) > max_bytes:
        raise Malformed(oversize(len(text), max_bytes))
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Malformed(f"not JSON: {error}") from None
    if not isinstance(content, dict):
        raise Malformed(f"not an object but {type(content).__name__}")
    return content


def encode_json(message: Message) -> bytes:
    """The message as JSON for people and generic clients: binary fields in base64, numbers to six digits after the point.

    What fits a line of a terminal is one line, and the rest is indented; a long message, which nobody reads through, is not.
    """
    plain = message.model_dump_json()
    if len(plain) > MAX_LAID_OUT_BYTES:
        return plain.encode()
    return _laid_out(json.loads(plain)).encode()


def _laid_out(value: Any) -> str:
    if isinstance(value, float):
        return repr(float(f"{value:.6f}" if abs(value) >= 0.1 else f"{value:.6g}"))
    if not isinstance(value, dict | list) or not value:
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, dict):
        marks, parts = "{}", [f"{json.dumps(name)}: {_laid_out(part)}" for name, part in value.items()]
    else:
        marks, parts = "[]", [_laid_out(part) for part in value]
    if sum(len(part) + 2 for part in parts) <= LINE and not any("\n" in part for part in parts):
        return marks[0] + ", ".join(parts) + marks[1]
    inside = ",\n".join(parts).replace("\n", "\n  ")
    return f"{marks[0]}\n  {inside}\n{marks[1]}"


def validate(type_: type[T], content: dict[str, Any]) -> T:
    """The message with this content. Raises Malformed with the field's name."""
    try:
        return type_.model_validate(content)
    except ValidationError as error:
        raise Malformed(say(error)) from None


def decode_any(payload: bytes, encoding: str) -> Message:
    """Read a payload whose label names its type, for tools that watch every key. Raises CodecError."""
    name = encoding.partition(";")[2].partition("/")[0]
    if name not in TYPES:
        raise WrongType(f"encoding '{encoding}' names no type of the contract")
    return decode(TYPES[name], payload, encoding, max_bytes=128 << 20)


def say(error: ValidationError) -> str:
    """A validation error as one line that names each field, at most three of them."""
    lines = []
    for item in error.errors(include_url=False, include_input=False)[:3]:
        field = ".".join(str(part) for part in item["loc"])
        text = "unknown key" if item["type"] == "extra_forbidden" else item["msg"].removeprefix("Value error, ")
        lines.append(f"{field}: {text}" if field else text)
    more = error.error_count() - len(lines)
    return "; ".join(lines) + (f"; and {more} more" if more > 0 else "")


def _check_label(type_: type[Message], encoding: str) -> None:
    base, _, schema = encoding.partition(";")
    name, _, version = schema.partition("/")
    if base != MSGPACK or name != type_.__name__:
        raise WrongType(f"encoding '{encoding[:80]}', expected '{encoding_of(type_)}'")
    if version != str(type_.VERSION):
        raise WrongVersion(f"{name} version '{version[:20]}', this reader speaks {type_.VERSION}")
