"""Subcommands come from entry points, so that adding one edits no list."""

import re
from pathlib import Path
from types import SimpleNamespace

import deixis_cli
import deixis_runtime
import pytest
from deixis_cli import main as command_line
from deixis_cli import overview

COMMANDS = {"run", "up", "status", "watch", "certs", "doctor", "poi", "record", "replay", "swap"}


def entry(name, register):
    return SimpleNamespace(name=name, load=lambda: register)


def test_the_commands_of_this_distribution_are_registered_as_entry_points(capsys):
    with pytest.raises(SystemExit) as left:
        command_line.main(["--help"])
    assert left.value.code == 0
    shown = capsys.readouterr().out
    assert all(name in shown for name in COMMANDS)


def test_a_command_of_another_distribution_is_found_by_its_entry_point(monkeypatch):
    def register(subparsers):
        parser = subparsers.add_parser("hello")
        parser.add_argument("--status", type=int)
        parser.set_defaults(run=lambda given: given.status)

    monkeypatch.setattr(overview, "entry_points", lambda **_: [entry("hello", register)])
    assert command_line.main(["hello", "--status", "7"]) == 7


def test_a_command_that_cannot_be_loaded_is_said_and_leaves_the_others(monkeypatch, capsys):
    def broken():
        raise ImportError("no module named cv2")

    def register(subparsers):
        subparsers.add_parser("hello").set_defaults(run=lambda _: 0)

    entries = [SimpleNamespace(name="broken", load=broken), entry("hello", register)]
    monkeypatch.setattr(overview, "entry_points", lambda **_: entries)
    assert command_line.main(["hello"]) == 0
    with pytest.raises(SystemExit) as left:
        command_line.main(["broken"])
    assert left.value.code == 2
    assert "'broken' is not available: no module named cv2" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["status", "watch", "up", "poi list"])
def test_the_robot_has_to_be_named(command, capsys):
    with pytest.raises(SystemExit) as left:
        command_line.main(command.split())
    assert left.value.code == 2
    assert "--robot" in capsys.readouterr().err


def test_the_robot_has_to_be_named_unless_this_machine_alone_is_examined(capsys):
    assert command_line.main(["doctor"]) == 1
    assert "--robot NAME is needed to look at a running system; --local looks at this machine alone" in capsys.readouterr().err


@pytest.mark.parametrize(
    "argv",
    [["remove", "a/b"], ["remove", "*"], ["add", "a b", "0", "0", "0"], ["move", "a?x", "0", "0", "0"], ["remove", ".."]],
)
def test_a_poi_id_that_is_no_part_of_a_key_is_refused(argv, capsys):
    with pytest.raises(SystemExit):
        command_line.main(["poi", *argv, "--robot", "r1"])
    assert "is not a name" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("argv", "field"),
    [
        (["a", "nan", "0", "0"], "position_m"),
        (["a", "1e9", "0", "0"], "position_m"),
        (["a", "0", "0", "0", "--extent", "-1"], "extent_m"),
    ],
)
def test_a_poi_with_a_bad_field_is_refused_before_anything_is_sent(argv, field, capsys):
    assert command_line.main(["poi", "add", *argv, "--robot", "r1", "--connect", "tcp/127.0.0.1:1"]) == 1
    assert field in capsys.readouterr().err


def test_every_command_that_is_advised_exists():
    packages = [Path(module.__file__).parent for module in (deixis_cli, deixis_runtime)]
    texts = [path.read_text() for package in packages for path in package.glob("*.py")]
    advised = {name for text in texts for name in re.findall(r"[`':] ?deixis ([a-z][a-z-]*)", text)}
    assert {"up", "run", "doctor", "poi"} <= advised
    assert advised <= COMMANDS


def test_ctrl_c_while_a_command_is_being_loaded_is_no_traceback(monkeypatch):
    def interrupted(_wanted):
        raise KeyboardInterrupt

    monkeypatch.setattr("deixis_cli.main.parser", interrupted)
    assert command_line.main(["swap"]) == 130
