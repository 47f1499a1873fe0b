"""docs/settings.md and docs/commands.md say what the code does."""

import sys

import pytest
from running import ROOT

sys.path.insert(0, str(ROOT / "docs"))

import make_reference


@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="argparse of other Python versions folds its help otherwise")
@pytest.mark.parametrize("name", make_reference.PAGES)
def test_a_page_made_from_the_code_is_up_to_date(name, monkeypatch):
    monkeypatch.setenv("COLUMNS", make_reference.WIDTH)  # the page sets it: it is put back
    made = make_reference.PAGES[name]()
    assert (ROOT / "docs" / name).read_text() == made, "run 'make pages'"


def test_every_setting_is_described():
    rows = [line for line in make_reference.settings_page().splitlines() if line.startswith("| `")]
    assert len(rows) > 100
    assert [row for row in rows if row.endswith("|  |")] == []
