"""The committed contract is what the code says, and old bytes stay readable."""

import json
import re
from pathlib import Path

import jsonschema
import pytest
from deixis_schemas import codec
from deixis_schemas.contract_page import contract_page
from deixis_schemas.export import contract_files
from deixis_schemas.messages import TYPES
from deixis_schemas.samples import SAMPLES
from deixis_schemas.topics import TOPICS

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "schemas" / "contract"
PAGE = ROOT / "docs" / "contract.md"


def test_every_type_has_a_sample():
    assert {type(sample).__name__ for sample in SAMPLES} == set(TYPES)


@pytest.mark.parametrize("name", sorted(contract_files()))
def test_the_committed_file_is_current(name):
    assert (FOLDER / name).read_bytes() == contract_files()[name], "run: make contract"


def test_the_page_for_people_is_current_and_leaves_nothing_out():
    page = PAGE.read_text()
    assert page == contract_page(), "run: make contract"
    for topic in TOPICS:
        assert f"* `{topic.path}`: {topic.silence}" in page
        assert topic.silence
    for type_ in TYPES.values():
        assert all(f"| `{field}` |" in page for field in type_.model_fields)


def test_every_link_within_the_page_leads_somewhere():
    page = PAGE.read_text()
    headings = {line.lstrip("# ").lower().replace("/", "") for line in page.splitlines() if line.startswith("#")}
    assert set(re.findall(r"\(#([^)]+)\)", page)) <= headings


def test_nothing_else_lies_in_the_contract_folder():
    assert {path.name for path in FOLDER.iterdir()} == set(contract_files())


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda sample: type(sample).__name__)
def test_golden_bytes_decode_to_the_sample(sample):
    name = type(sample).__name__
    payload = (FOLDER / f"{name}.golden.msgpack").read_bytes()
    assert codec.decode(type(sample), payload, f"application/msgpack;{name}/{sample.VERSION}") == sample


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda sample: type(sample).__name__)
def test_golden_json_fits_its_schema(sample):
    name = type(sample).__name__
    schema = json.loads((FOLDER / f"{name}.schema.json").read_bytes())
    document = json.loads((FOLDER / f"{name}.golden.json").read_bytes())
    jsonschema.validate(document, schema)
    assert codec.decode_json(type(sample), json.dumps(document)) == sample


def unbounded(schema: object, path: str = "") -> list[str]:
    """Paths of the whole numbers that a schema leaves without a bound."""
    if isinstance(schema, dict):
        loose = schema.get("type") == "integer" and not {"minimum", "maximum"} <= schema.keys()
        inside = [found for name, part in schema.items() for found in unbounded(part, f"{path}/{name}")]
        return [path] * loose + inside
    if isinstance(schema, list):
        return [found for place, part in enumerate(schema) for found in unbounded(part, f"{path}/{place}")]
    return []


def test_no_whole_number_is_without_bounds():
    """A person_id beyond 2^63, which tracks might have and gestures and beliefs might not, ended both stages."""
    for path in sorted(FOLDER.glob("*.schema.json")):
        assert unbounded(json.loads(path.read_text())) == [], path.name
