"""Every `deixis` command on the pages is one: its words and options are those that the code has today."""

import re
import shlex

import pytest
from deixis_cli.main import parser
from own_environment import own_environment
from page_commands import PAGES, SHELL, blocks
from running import ROOT

INLINE = re.compile(r"`((?:\.venv/bin/)?deixis [a-z][^`]*)`")
NAMES = {"deixis", ".venv/bin/deixis"}
# What a reader is to put in, and what stands for "and so on".
PLACEHOLDERS = ("...", "[", "|", "…")
ENDS = {"&", "&&", "||", ";", ">", "2>", "#", "do"}


def commands_on(page):
    """Each command with its words, as a shell would read them, and whether it stands in a sentence."""
    for block in (text for language, text in blocks(page) if language == SHELL):
        for line in re.sub(r"\\\n\s*", " ", block).splitlines():
            yield from ((False, words) for words in commands_in(line))
    for inline in INLINE.findall(page.read_text()):
        yield from ((True, words) for words in commands_in(" ".join(inline.split())))


def commands_in(line):
    try:
        words = shlex.split(line, comments=True)
    except ValueError:  # the middle of a text over several lines
        return
    while words:
        begin = next((place for place, word in enumerate(words) if word in NAMES), None)
        if begin is None:
            return
        end = next(
            (place for place in range(begin, len(words)) if words[place].rstrip(";") != words[place] or words[place] in ENDS),
            None,
        )
        found = words[begin + 1 : end if end is None or words[end] in ENDS else end + 1]
        if found and not any(sign in word for word in found for sign in PLACEHOLDERS):
            yield [word.rstrip(";") for word in found]
        words = [] if end is None else words[end + 1 :]


def is_whole(words):
    """Whether it is meant to be typed: `deixis eval` in a sentence is but a name."""
    return len(words) > 1 and any(word.startswith("-") or "." in word for word in words[1:])


FOUND = sorted(
    {
        (page.relative_to(ROOT).as_posix(), in_sentence, *words)
        for page in PAGES
        for in_sentence, words in commands_on(page)
        if is_whole(words)
    }
)
# A sentence names an option without all that goes with it.
SHORTENED = ("the following arguments are required", "expected one argument")


def test_there_are_many():
    assert len(FOUND) > 120


@pytest.mark.parametrize("found", FOUND, ids=lambda found: f"{found[0]}: {' '.join(found[2:])}"[:120])
def test_a_command_of_a_page_is_understood(found, capsys):
    page, in_sentence, name, *arguments = found
    why = refusal(name, arguments, capsys)
    if not (in_sentence and any(text in why for text in SHORTENED)):
        assert why == "", f"{page}: deixis {name} {' '.join(arguments)}"


def refusal(name, arguments, capsys):
    """What is wrong with a command line; empty where it is understood."""
    try:
        with own_environment():
            parser(name).parse_args([name, *arguments])
    except SystemExit as error:
        return capsys.readouterr().err if error.code else ""
    return ""
