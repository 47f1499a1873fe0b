"""The committed contract is what the code says, and old bytes stay readable."""

import json
from pathlib import Path

import jsonschema
import pytest
from deixis_schemas import codec
from deixis_schemas.export import contract_files
from deixis_schemas.messages import TYPES
from deixis_schemas.samples import SAMPLES

FOLDER = Path(__file__).parents[2] / "schemas" / "contract"


def test_every_type_has_a_sample():
    assert {type(sample).__name__ for sample in SAMPLES} == set(TYPES)


@pytest.mark.parametrize("name", sorted(contract_files()))
def test_the_committed_file_is_current(name):
    assert (FOLDER / name).read_bytes() == contract_files()[name], "run: python -m deixis_schemas.export schemas/contract"


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
