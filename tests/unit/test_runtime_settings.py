"""Settings come from the site file, then from --set, and a wrong one is named."""

import argparse

import pytest
from deixis_runtime.settings import STARTED_BEFORE, ConfigError, checked_name, load_config, parse_options
from pydantic import BaseModel, ConfigDict


class Inner(BaseModel):
    model_config = ConfigDict(extra="forbid")
    yaw_deg: float = 0.0


class Settings(BaseModel):
    model_config = ConfigDict(extra="forbid")
    width: int = 640
    source: str | None = None
    mount: Inner = Inner()


def options(stage, *argv):
    return parse_options(stage, "test", ["--robot", "r1", *argv])


def test_set_overrides_the_site_file(tmp_path):
    site = tmp_path / "site.yaml"
    site.write_text("camera: {width: 320, source: a.mp4}\nsettings: {tracker: {width: 100}}")
    given = options("camera", "--site", str(site), "--set", "width=160", "--set", "mount.yaw_deg=5")
    assert load_config("camera", Settings, given) == Settings(width=160, source="a.mp4", mount=Inner(yaw_deg=5))
    assert load_config("tracker", Settings, options("tracker", "--site", str(site))).width == 100


@pytest.mark.parametrize(
    ("item", "named"), [("colour=red", "colour"), ("width=wide", "width"), ("width", "NAME=VALUE"), ("a=[", "YAML")]
)
def test_a_wrong_setting_is_named(item, named):
    with pytest.raises(ConfigError, match=named):
        load_config("camera", Settings, options("camera", "--set", item))


NO_NAMES = ["", "a/b", "*", "a b", "x" * 65, ".", "..", ".hidden", "-x", "--robot", "a\n", "ä"]


@pytest.mark.parametrize("name", NO_NAMES)
def test_a_name_that_would_break_a_key_or_a_path_is_refused(name):
    with pytest.raises(argparse.ArgumentTypeError):
        checked_name(name)


@pytest.mark.parametrize("name", ["r1", "a.b", "_x", "robot-1", "x" * 64])
def test_a_name_is_taken_as_it_is(name):
    assert checked_name(name) == name


@pytest.mark.parametrize("argv", [["--robot", ".."], ["--robot", "r1", "--instance", ".."]])
def test_neither_a_robot_nor_a_process_is_called_like_the_folder_above(argv, capsys):
    with pytest.raises(SystemExit):
        parse_options("camera", "test", argv)
    assert "'..' is not a name" in capsys.readouterr().err


def test_how_often_it_was_started_before_is_read_from_the_environment(monkeypatch):
    monkeypatch.delenv(STARTED_BEFORE, raising=False)
    assert options("camera").started_before == 0
    monkeypatch.setenv(STARTED_BEFORE, "3")
    assert options("camera").started_before == 3
    assert options("camera", "--lockstep").instance == "lockstep-3"


@pytest.mark.parametrize("text", ["", "-1", "three", "1e3", "9" * 30, "٣"])
def test_a_number_of_starts_that_is_none_is_a_config_error(text, monkeypatch):
    monkeypatch.setenv(STARTED_BEFORE, text)
    with pytest.raises(ConfigError, match=STARTED_BEFORE):
        options("camera")


def test_the_robot_has_no_default(capsys):
    with pytest.raises(SystemExit):
        parse_options("camera", "test", [])
    assert "--robot" in capsys.readouterr().err
