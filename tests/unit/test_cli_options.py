"""Options that several commands share."""

import argparse
from types import SimpleNamespace

import pytest
import yaml
from deixis_cli.options import CommandError, add_host, add_robot, host_options, quoted, read_site, seconds, stage_settings
from deixis_runtime import host
from deixis_runtime.host import HostFailed
from deixis_runtime.session import Unreachable, open_client
from hypothesis import given
from hypothesis import strategies as st


def options(*argv, **more):
    parser = argparse.ArgumentParser()
    add_robot(parser, default="r1")
    add_host(parser)
    return host_options(parser.parse_args(argv), **more)


# What YAML takes as it stands between quotation marks; file names hold hardly anything else.
PRINTABLE = st.characters(
    min_codepoint=32, max_codepoint=0xD7FF, exclude_categories=("Cc", "Zl", "Zp"), exclude_characters="\ufeff"
)


@given(st.text(PRINTABLE, max_size=80))
def test_a_quoted_text_is_read_back_by_yaml_as_it_was(text):
    assert yaml.safe_load(quoted(text)) == text


def test_settings_are_sorted_by_stage_and_keep_their_order():
    assert stage_settings(["camera.source=0", "tracker.a.b=1=2", "camera.encoding=jpeg"]) == {
        "camera": ("source=0", "encoding=jpeg"),
        "tracker": ("a.b=1=2",),
    }


@pytest.mark.parametrize("item", ["", "camera", "camera.source", "source=0", ".x=1", "camera.=1", "=1"])
def test_a_setting_without_stage_name_or_value_is_refused(item):
    with pytest.raises(CommandError, match=r"STAGE\.NAME=VALUE"):
        stage_settings([item])


def test_settings_given_by_the_user_come_after_those_of_the_command():
    given = options("--only", "camera", "--set", "camera.source=1", source={"source": "0"})
    assert given.sets["camera"] == ("source=0", "source=1")


def test_stages_are_chosen_by_name_and_by_exclusion():
    assert options("--only", "camera,fusion").stages == ("camera", "fusion")
    assert options("--except", "headpose", "--except", "gesture").stages == ("camera", "tracker", "fusion")


def test_an_unknown_stage_is_named_with_those_that_there_are():
    with pytest.raises(HostFailed, match=r"'camra'.*camera"):
        options("--only", "camra")


def test_a_setting_for_a_stage_that_does_not_start_is_refused():
    with pytest.raises(CommandError, match="'tracker'"):
        options("--only", "camera", "--set", "tracker.x=1")


def test_a_registry_for_a_fusion_that_does_not_start_is_refused():
    with pytest.raises(CommandError, match="--registry is for fusion, which is not started here"):
        options("--only", "camera", "--registry", "pois.sqlite")


def test_a_site_with_settings_of_an_unknown_stage_is_refused_with_file_and_field(tmp_path):
    site = tmp_path / "site.yaml"
    site.write_text("settings: {traker: {x: 1}}")
    with pytest.raises(CommandError, match=r"site\.yaml: settings\.traker"):
        read_site(site)
    with pytest.raises(CommandError, match=r"nowhere\.yaml: No such file"):
        read_site(tmp_path / "nowhere.yaml")


def installed(monkeypatch, *names):
    entries = [SimpleNamespace(name=name) for name in names]
    monkeypatch.setattr(host, "entry_points", lambda **_: entries)


def test_a_stage_that_is_installed_is_started_and_may_have_settings_with_no_list_edited(tmp_path, monkeypatch):
    installed(monkeypatch, "gaze", "fusion", "tracker", "headpose", "camera", "gesture")
    given = options("--set", "gaze.x=1")
    assert given.stages == ("camera", "tracker", "headpose", "gesture", "fusion", "gaze")
    assert given.sets["gaze"] == ("x=1",)
    assert options("--only", "gaze,camera").stages == ("camera", "gaze")
    assert "gaze" not in options("--except", "gaze").stages
    site = tmp_path / "site.yaml"
    site.write_text("settings: {gaze: {x: 1}}")
    assert read_site(site).settings == {"gaze": {"x": 1}}


def test_what_is_not_installed_is_not_started_and_said(tmp_path, monkeypatch, caplog):
    installed(monkeypatch, "camera")
    assert options().stages == ("camera",)
    assert "not installed here and so not started: fusion, gesture, headpose, tracker" in caplog.text
    assert options("--except", "fusion").stages == ("camera",)
    with pytest.raises(HostFailed, match="'fusion' is not installed here"):
        options("--only", "fusion")
    site = tmp_path / "site.yaml"
    site.write_text("settings: {fusion: {rules: paper}}")  # one site file serves robot and edge
    read_site(site)
    site.write_text("settings: {gaze: {x: 1}}")
    with pytest.raises(CommandError, match=r"settings\.gaze: there is no such stage \(camera, tracker"):
        read_site(site)


@pytest.mark.parametrize("text", ["0", "-1", "nan", "inf", "1e999", "soon", ""])
def test_a_time_that_is_none_is_refused(text):
    with pytest.raises(argparse.ArgumentTypeError, match="no number of seconds"):
        seconds(text)
    assert seconds("0.5") == 0.5


def test_a_slip_in_an_endpoint_is_named_before_anything_starts():
    for text in ("nonsense", "", "http://here:80", "tcp/here", "tcp/here:99999"):
        with pytest.raises(CommandError, match=f"--listen: '{text}' is not an endpoint"):
            options("--listen", text)
        with pytest.raises(Unreachable, match=f"^'{text}' is not an endpoint"), open_client(text):
            pass
    assert options("--listen", "tcp/127.0.0.1:0").listen == ("tcp/127.0.0.1:0",)
