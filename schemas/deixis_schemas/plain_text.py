"""Text that people write and others read in terminals and logs: one line, with nothing in it that steers what shows it.

An escape sequence in a POI's name clears the terminal of whoever lists POIs, a line break forges a line of a log, and a
bidirectional override makes a name look like another one.
"""

from __future__ import annotations

import unicodedata

# Control characters, lone surrogates, and separators of lines and paragraphs.
STEERING_CATEGORIES = ("Cc", "Cs", "Zl", "Zp")
# Embeddings, overrides and isolates; the plain marks of direction, which names in Hebrew or Arabic have, are none of these.
BIDIRECTIONAL = frozenset("\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")


def steers(character: str) -> bool:
    """Whether a character is no part of a text but changes how all of it is shown."""
    return character in BIDIRECTIONAL or unicodedata.category(character) in STEERING_CATEGORIES


def plain(text: str) -> str:
    """The text. Raises ValueError that names the first character which is not plain, and where it stands."""
    if text.isprintable():
        return text
    for place, character in enumerate(text, 1):
        if steers(character):
            raise ValueError(
                f"character {place} is the control character U+{ord(character):04X}; one line of plain text is wanted"
            )
    return text


def shown(text: str) -> str:
    """The text with such characters as their code points: for messages that quote what was sent."""
    return "".join(f"<U+{ord(character):04X}>" if steers(character) else character for character in text)


def cleaned(text: str) -> str:
    """The text with spaces for such characters."""
    return "".join(" " if steers(character) else character for character in text)
