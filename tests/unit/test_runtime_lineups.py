"""Which guest stands in the place of which stage, and what is said of one that is not installed."""

import pytest
from deixis_cli.options import CommandError, read_lineup
from deixis_runtime.host import Host, HostOptions
from deixis_runtime.lineups import CLASSIC, FOLDER, LINEUPS, LineupError, guest_command, guests_of
from deixis_schemas import topics


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A folder in which every guest of the table is installed."""
    monkeypatch.setenv(FOLDER, str(tmp_path))
    for lineup in LINEUPS.values():
        for stage, guest in lineup.items():
            command = guest_command(stage, guest)
            command.parent.mkdir(parents=True, exist_ok=True)
            command.touch(mode=0o755)
    return tmp_path


def test_every_guest_of_the_table_is_for_a_stage_that_there_is():
    assert LINEUPS[CLASSIC] == {}
    assert {stage for lineup in LINEUPS.values() for stage in lineup} <= set(topics.STAGES)


def test_a_lineup_that_is_not_known_names_those_that_are():
    with pytest.raises(LineupError, match=r"no line-up 'mediapip'; known: classic, mediapipe"):
        guests_of("mediapip")


def test_a_guest_that_is_not_installed_is_named_with_what_to_do(tmp_path, monkeypatch):
    monkeypatch.setenv(FOLDER, str(tmp_path))
    assert guests_of(CLASSIC) == {}
    with pytest.raises(
        CommandError, match=r"guest headpose_mediapipe is not installed \('.*/deixis-headpose-mediapipe'\); 'make guests'"
    ):
        read_lineup("mediapipe-headpose")


def test_a_host_starts_the_guest_in_the_place_of_the_stage_and_forks_the_others(installed):
    options = HostOptions(
        robot="r", stages=topics.STAGES, guests=guests_of("mediapipe-headpose"), sets={"headpose": ("reach_deg=50",)}
    )
    with Host(options) as host:
        (*_, ours), guests = host._stage_command("gesture")[:1], host._stage_command("headpose")
        forked = {item.target for item in host.forkables()}
    assert ours.endswith("/deixis-gesture")
    assert guests[0] == str(installed / "mediapipe" / "bin" / "deixis-headpose-mediapipe")
    assert guests[-2:] == ["--set", "reach_deg=50"]
    assert "deixis_headpose.service:main" not in forked
    assert "deixis_gesture.service:main" in forked
