"""A stock zenohd with the settings that `deixis certs zenohd` writes: mutual TLS and the roles, as our router has them."""

from contextlib import ExitStack

import pytest
import zenoh
from deixis_cli import main as command_line
from deixis_runtime.session import Unreachable, client_config, open_client
from parties import PATIENCE_S, Party, until_heard
from running import ROOT, answers, free_port, process, wait_until
from site_made import add, holder, make_site
from stock_zenohd import WHY_NO_ZENOHD, ZENOHD

FRAME, TARGET = "deixis/r1/camera/frame", "deixis/r1/fusion/target"


@pytest.fixture
def settings(tmp_path, capsys):
    """Folders of members, and the settings of the edge in a file."""
    site = make_site(tmp_path / "site")
    members = {name: add(site, name, *hosts) for name, hosts in (("edge:e1", ["127.0.0.1"]), ("viewer:anna", []))}
    argv = ["certs", "zenohd", str(members["edge:e1"].folder), "--config", str(ROOT / "config" / "edge.json5")]
    assert command_line.main(argv) == 0
    (tmp_path / "edge.json").write_text(capsys.readouterr().out)
    return members, tmp_path / "edge.json"


def test_the_settings_are_complete_and_name_no_more_than_what_is_set(settings):
    members, file = settings
    config = zenoh.Config.from_file(str(file))
    assert str(members["edge:e1"].key) in config.get_json("transport/link/tls/listen_private_key")
    assert config.get_json("access_control/default_permission") == '"deny"'
    assert config.get_json("transport/unicast/max_links") == "2"
    assert "null" not in file.read_text()


def test_a_folder_without_a_list_makes_no_settings(settings, capsys):
    members, _ = settings
    assert command_line.main(["certs", "zenohd", str(members["viewer:anna"].folder)]) == 1
    assert "a router needs the list of those who may link" in capsys.readouterr().err


@pytest.mark.skipif(ZENOHD is None, reason=WHY_NO_ZENOHD)
def test_zenohd_keeps_to_the_roles(settings, tmp_path):
    members, file = settings
    endpoint, inside = f"tls/127.0.0.1:{free_port()}", f"unixsock-stream/{tmp_path}/socket"
    with process([ZENOHD, "-c", file, "-l", inside, "-l", endpoint], tmp_path / "log"), ExitStack() as stack:
        wait_until(lambda: answers(inside), "zenohd", PATIENCE_S, tmp_path / "log")
        stages = Party(stack.enter_context(zenoh.open(client_config(inside, shared_memory=False))))
        with holder(members["viewer:anna"]):
            viewer = Party(stack.enter_context(zenoh.open(client_config(endpoint, shared_memory=False))))
        viewer.listen(FRAME)
        viewer.listen(TARGET)
        until_heard(viewer, TARGET, lambda: (stages.put(FRAME), stages.put(TARGET)))
        assert FRAME not in viewer.names()
        with holder(None), pytest.raises(Unreachable), open_client(endpoint.replace("tls/", "tcp/"), shared_memory=False):
            pass
