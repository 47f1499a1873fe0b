"""What docs/write-your-own-stage.md quotes stands in the files that it quotes from."""

import re

import pytest
from running import ROOT

PAGE = (ROOT / "docs" / "write-your-own-stage.md").read_text()
PYTHON = (ROOT / "examples" / "own_gesture.py").read_text()
RUST = "".join(path.read_text() for path in sorted((ROOT / "guests" / "gesture_rust" / "src").glob("*.rs")))
QUOTES = re.findall(r"^( *)```(python|rust)\n(.*?)^ *```$", PAGE, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize(("indent", "language", "text"), QUOTES)
def test_a_quote_is_word_for_word(indent, language, text):
    quoted = re.sub(f"^{indent}", "", text, flags=re.MULTILINE)
    assert quoted in {"python": PYTHON, "rust": RUST}[language]


def test_both_languages_are_quoted():
    assert {language for _, language, _ in QUOTES} == {"python", "rust"}


def test_the_stage_of_forty_lines_has_about_so_many():
    code = [line for line in PYTHON.splitlines() if line.strip() and not line.strip().startswith(('"""', "from ", "import "))]
    assert len(code) <= 40
