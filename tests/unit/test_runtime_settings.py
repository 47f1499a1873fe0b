"""Settings come from the site file, then from --set, and a wrong one is named."""

import argparse

import pytest
from deixis_runtime.settings import ConfigError, load_config, parse_options, robot_name
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


@pytest.mark.parametrize("name", ["", "a/b", "*", "a b", "x" * 65])
def test_a_robot_name_that_would_break_a_key_is_refused(name):
    with pytest.raises(argparse.ArgumentTypeError):
        robot_name(name)


def test_the_robot_has_no_default(capsys):
    with pytest.raises(SystemExit):
        parse_options("camera", "test", [])
    assert "--robot" in capsys.readouterr().err
