"""Two connections to another host's router in place of one."""

import json

import pytest
from deixis_runtime.router import router_config
from deixis_runtime.two_links import two_links, without_settings


@pytest.mark.parametrize(
    ("endpoint", "links"),
    [
        ("tcp/edge:7447", ["tcp/edge:7447?prio=1-4#so_sndbuf=65536", "tcp/edge:7447?prio=5-7#so_sndbuf=65536"]),
        ("tls/edge:7447", ["tls/edge:7447?prio=1-4#so_sndbuf=65536", "tls/edge:7447?prio=5-7#so_sndbuf=65536"]),
        (
            "tcp/edge:7447?rel=1#iface=wlan0",
            [
                "tcp/edge:7447?rel=1;prio=1-4#iface=wlan0;so_sndbuf=65536",
                "tcp/edge:7447?rel=1;prio=5-7#iface=wlan0;so_sndbuf=65536",
            ],
        ),
        ("tcp/edge:7447#so_sndbuf=9000", ["tcp/edge:7447?prio=1-4#so_sndbuf=9000", "tcp/edge:7447?prio=5-7#so_sndbuf=9000"]),
        ("tcp/edge:7447?prio=0-7", ["tcp/edge:7447?prio=0-7"]),
        ("unixsock-stream//run/deixis/router.sock", ["unixsock-stream//run/deixis/router.sock"]),
        ("quic/edge:7447", ["quic/edge:7447"]),
    ],
)
def test_answers_get_a_connection_beside_that_of_the_frames(endpoint, links):
    assert two_links(endpoint) == links


def test_people_are_told_of_the_one_address_that_they_gave():
    assert without_settings([*two_links("tls/edge:7447"), "tcp/other:1"]) == ["tls/edge:7447", "tcp/other:1"]


def test_who_allows_one_link_only_makes_one(tmp_path):
    file = tmp_path / "one.json5"
    file.write_text("{ transport: { unicast: { max_links: 1 } } }")
    config = router_config([], ["tcp/edge:7447"], file)
    assert json.loads(config.get_json("connect/endpoints")) == ["tcp/edge:7447"]
