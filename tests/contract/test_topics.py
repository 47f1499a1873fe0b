"""The topic table agrees with itself."""

import ast
from pathlib import Path

from deixis_schemas import topics
from deixis_schemas.messages import TYPES

SCHEMAS = Path(__file__).parents[2] / "schemas" / "deixis_schemas"


def test_every_type_has_a_topic_and_every_key_is_found_again():
    assert {topic.type for topic in topics.TOPICS} == set(TYPES.values())
    for topic in topics.TOPICS:
        assert topics.topic_of(topic.key("r1", stage="tracker", id="vase")) == topic


def test_keys_outside_the_contract_have_no_topic():
    for key in ("deixis/r1", "other/r1/camera/frame", "deixis/r1/camera/frame/x", "deixis/r1/@alive/tracker/t"):
        assert topics.topic_of(key) is None


def test_keys_are_those_of_the_design():
    assert topics.FRAME.key("r1") == "deixis/r1/camera/frame"
    assert topics.HEALTH.key("r1", stage="*") == "deixis/r1/*/health"
    assert topics.alive_key("r1", "tracker", "edge-1") == "deixis/r1/@alive/tracker/edge-1"


def test_the_contract_does_not_import_the_transport():
    for path in SCHEMAS.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            assert not any(name.split(".")[0] == "zenoh" for name in names), path
