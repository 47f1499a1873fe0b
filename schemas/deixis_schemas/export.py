"""Writes what other languages need of the contract: JSON Schema and golden bytes of every type, and the topic table.

python -m deixis_schemas.export schemas/contract docs/contract.md
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from . import codec
from .contract_page import contract_page
from .messages import TYPES, Message
from .samples import SAMPLES
from .topics import TOPICS

_NOTES = """
Payloads are msgpack maps with the encoding `application/msgpack;Type/version`; binary fields are msgpack `bin`. A get with
`?format=json` is answered in JSON (`application/json`), binary fields in URL-safe base64 (RFC 4648, section 5). Samples of both
are beside this page as `Type.golden.msgpack` and `Type.golden.json`, the JSON Schema as `Type.schema.json`.
"""


def contract_files() -> dict[str, bytes]:
    """Content of every file of the contract folder, by name."""
    files = {"topics.md": topic_table().encode()}
    for name, type_ in TYPES.items():
        files[f"{name}.schema.json"] = json_schema(type_)
    for sample in SAMPLES:
        name = type(sample).__name__
        files[f"{name}.golden.msgpack"] = codec.encode(sample)
        files[f"{name}.golden.json"] = json.dumps(json.loads(codec.encode_json(sample)), indent=1).encode() + b"\n"
    return files


def json_schema(type_: type[Message]) -> bytes:
    """JSON Schema of a type; binary fields are strings in it, raw bytes in msgpack."""
    schema = {"$id": f"{type_.__name__}/{type_.VERSION}", **type_.model_json_schema()}
    return json.dumps(schema, indent=1, sort_keys=True).encode() + b"\n"


def topic_table() -> str:
    """The topic table in Markdown."""
    rows = [
        "| key under `deixis/{robot}/` | type / version | when | delivery | by get | most bytes | oldest |",
        "|---|---|---|---|---|---|---|",
    ]
    for topic in TOPICS:
        rate = f", {topic.rate_hz:g} Hz expected" if topic.rate_hz else ""
        oldest = f"{topic.max_age_s:g} s" if topic.max_age_s else "-"
        rows.append(
            f"| `{topic.path}` | {topic.type.__name__}/{topic.version} | {topic.by.value}{rate} | {topic.delivery.value} "
            f"| {'yes' if topic.queryable else 'no'} | {topic.max_bytes} | {oldest} |"
        )
    return "# Topics\n\nWritten by `make contract`; edit `deixis_schemas/topics.py`.\n\n" + "\n".join(rows) + "\n"


def main() -> None:
    """Write the contract folder."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("page", type=Path, help="the same for people")
    given = parser.parse_args()
    folder: Path = given.folder
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in contract_files().items():
        (folder / name).write_bytes(content)
    given.page.write_text(contract_page(), encoding="utf-8")


if __name__ == "__main__":
    main()
