"""JSON Schema in words, for the pages that are made from types."""

from __future__ import annotations

import json
from typing import Any


def what(content: dict[str, Any]) -> str:
    """The kind of a value, with its bounds."""
    if "$ref" in content:
        return link(content["$ref"].rsplit("/", 1)[-1])
    if "anyOf" in content:
        return " or ".join(what(option) for option in content["anyOf"])
    if "enum" in content:
        return ", ".join(f"`{value}`" for value in content["enum"])
    return _array(content) if content.get("type") == "array" else _plain(content)


def _plain(content: dict[str, Any]) -> str:
    if isinstance(content.get("additionalProperties"), dict):
        return f"map of text to {what(content['additionalProperties'])}"
    kind = str(content.get("type", "any"))
    kind = {"null": "none", "string": "text", "object": "map"}.get(kind, kind)
    return ("bytes" if content.get("format") in ("binary", "base64url") else kind) + _bounds(content)


def _array(content: dict[str, Any]) -> str:
    if "prefixItems" in content:
        inside = [what(item) for item in content["prefixItems"]]
        return f"[{', '.join(inside)}]" if len(set(inside)) > 1 else f"{len(inside)} of: {inside[0]}"
    most = f", {content['maxItems']} at most" if "maxItems" in content else ""
    return f"list of {what(content.get('items', {}))}{most}"


def _bounds(content: dict[str, Any]) -> str:
    words = {
        "minimum": "from {}", "exclusiveMinimum": "above {}", "maximum": "to {}", "exclusiveMaximum": "below {}",
        "minLength": "{} long at least", "maxLength": "{} long at most", "pattern": "`{}`",
    }  # fmt: skip
    said = [text.format(_number(content[key])) for key, text in words.items() if key in content]
    return f" ({' '.join(said)})" if said else ""


def _number(value: object) -> str:
    if isinstance(value, int | float) and not isinstance(value, bool):
        return "2^63 - 1" if value == 2**63 - 1 else f"{value:g}"
    return str(value).replace("|", "\\|")


def default_of(content: dict[str, Any]) -> str:
    """What a field is where it is left out."""
    if "default" not in content:
        return "empty" if content.get("type") in ("array", "object") else "all defaults"
    value = content["default"]
    if value is None:
        return "none"
    return f"`{json.dumps(value)}`" if value != "" else "empty"


def link(heading: str) -> str:
    """A link to a heading of the same page, by the heading's own words."""
    return f"[{heading}](#{_anchor(heading)})"


def _anchor(heading: str) -> str:
    """As GitHub and mkdocs make them of a heading."""
    return heading.lower().replace("/", "")
