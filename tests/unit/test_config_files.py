"""The Zenoh settings and the site that ship load as they are."""

import json
import re
import subprocess

import pytest
from deixis_runtime.environment import ENVIRONMENT
from deixis_runtime.router import router_config
from deixis_runtime.site import load_site
from deixis_runtime.two_links import two_links
from running import ROOT
from stock_zenohd import WHY_NO_ZENOHD, ZENOHD

SETTINGS = sorted((ROOT / "config").glob("*.json5"))
SITES = sorted((ROOT / "config" / "sites").glob("*.yaml"))


@pytest.mark.parametrize("path", SETTINGS, ids=lambda path: path.name)
def test_our_router_takes_the_settings_and_the_endpoints_of_the_command_line(path):
    config = router_config(["tcp/127.0.0.1:1"], ["tcp/127.0.0.1:2"], path)
    assert json.loads(config.get_json("mode")) == "router"
    assert json.loads(config.get_json("transport/link/tx/lease")) == 2000
    assert json.loads(config.get_json("scouting/multicast/enabled")) is False
    assert json.loads(config.get_json("transport/shared_memory/transport_optimization/enabled")) is False
    assert json.loads(config.get_json("listen/endpoints")) == ["tcp/127.0.0.1:1"]
    links = json.loads(config.get_json("transport/unicast/max_links"))
    endpoints = ["tcp/127.0.0.1:2"] if links == 1 else two_links("tcp/127.0.0.1:2")
    assert json.loads(config.get_json("connect/endpoints")) == endpoints


@pytest.mark.skipif(ZENOHD is None, reason=WHY_NO_ZENOHD)
@pytest.mark.parametrize("path", SETTINGS, ids=lambda path: path.name)
def test_zenohd_takes_the_settings(path, free_port):
    argv = [ZENOHD, "-c", path, "-l", f"tcp/127.0.0.1:{free_port}"]
    with pytest.raises(subprocess.TimeoutExpired):  # it goes on running
        subprocess.run(argv, check=True, timeout=2)


@pytest.mark.parametrize("path", SITES, ids=lambda path: path.name)
def test_the_example_sites_load(path):
    site = load_site(path)
    assert site.pois
    assert site.walls


@pytest.mark.parametrize("path", ["Dockerfile", "systemd/deixis@.service"])
def test_all_ways_of_starting_a_stage_set_the_same_environment(path):
    text = (ROOT / path).read_text()
    for name, value in ENVIRONMENT.items():
        assert re.search(rf"(^| |=){name}={value}( |$)", text, re.MULTILINE), name
