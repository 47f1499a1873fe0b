"""What a router makes of its endpoints and its folder of certificates: TLS, access control, or a refusal in one sentence."""

import json
import shutil

import pytest
import zenoh
from deixis_runtime.access import AccessList
from deixis_runtime.access_control import access_control, frames_stay_here
from deixis_runtime.certificates import Certificates
from deixis_runtime.endpoint import faces_network, is_guarded
from deixis_runtime.link_security import LinkSecurity, SecurityError, cautions
from deixis_runtime.router import router_config
from site_made import add, make_site

LOCAL = (
    "unixsock-stream//run/deixis/router.sock",
    "tcp/127.0.0.1:7447",
    "tcp/[::1]:7447",
    "tcp/localhost:7447",
    "ws/127.3.2.1:1",
)
OPEN = ("tcp/0.0.0.0:7447", "tcp/[::]:7447", "tcp/10.0.0.2:7447", "udp/192.168.1.2:1", "ws/0.0.0.0:1", "tcp/edge:7447#iface=lo")


@pytest.fixture(scope="module")
def certs(tmp_path_factory):
    site = make_site(tmp_path_factory.mktemp("security") / "site")
    return {name: add(site, name, *hosts) for name, hosts in (("edge:e1", ["10.0.0.2"]), ("robot:r1", []), ("viewer:v", []))}


def value(config, path):
    return json.loads(config.get_json(path))


def test_what_faces_the_network():
    assert not [endpoint for endpoint in LOCAL if faces_network(endpoint)]
    assert [endpoint for endpoint in OPEN if not faces_network(endpoint)] == []
    assert [endpoint for endpoint in (*LOCAL, *OPEN) if is_guarded(endpoint)] == []
    assert is_guarded("tls/10.0.0.2:7447#so_sndbuf=65536")
    assert is_guarded("quic/10.0.0.2:7447")


@pytest.mark.parametrize("endpoint", OPEN)
def test_a_listener_that_faces_the_network_without_tls_is_refused_unless_insecure_is_said(endpoint):
    with pytest.raises(SecurityError) as refused:
        router_config([LOCAL[0], endpoint], [])
    said = str(refused.value)
    assert said.startswith(f"refusing to listen on {endpoint}: ")
    assert "'deixis certs'" in said
    assert "--insecure" in said
    assert "\n" not in said
    config = router_config([LOCAL[0], endpoint], [], security=LinkSecurity(insecure=True))
    assert value(config, "listen/endpoints") == [LOCAL[0], endpoint]


def test_listeners_for_this_host_need_no_more():
    config = router_config(list(LOCAL), ["tcp/10.0.0.2:7447"])
    assert value(config, "access_control/enabled") is False


def test_tls_that_asks_for_no_certificate_is_refused_too(tmp_path):
    with pytest.raises(SecurityError, match="refusing to listen on tls/"):
        router_config(["tls/0.0.0.0:7447"], [])
    own = tmp_path / "own.json5"
    own.write_text('{mode: "router", listen: {endpoints: []}, transport: {link: {tls: {enable_mtls: true}}}}')
    router_config(["tls/0.0.0.0:7447"], [], own)
    own.write_text('{mode: "router", listen: {endpoints: ["tcp/0.0.0.0:7447"]}}')
    with pytest.raises(SecurityError, match="refusing to listen on tcp/"):
        router_config([], [], own)


def test_a_folder_of_certificates_becomes_mutual_tls_and_access_control(certs):
    edge = certs["edge:e1"]
    config = router_config(["tls/0.0.0.0:7447"], [], security=LinkSecurity(edge))
    tls = value(config, "transport/link/tls")
    assert tls["root_ca_certificate"] == str(edge.folder / "ca.pem")
    assert tls["listen_certificate"] == tls["connect_certificate"] == str(edge.folder / "cert.pem")
    assert tls["listen_private_key"] == tls["connect_private_key"] == str(edge.folder / "key.pem")
    assert tls["enable_mtls"] is True
    assert tls["close_link_on_expiration"] is True
    access = value(config, "access_control")
    assert (access["enabled"], access["default_permission"]) == (True, "deny")
    robot = router_config([LOCAL[0]], ["tls/10.0.0.2:7447"], security=LinkSecurity(certs["robot:r1"]))
    assert value(robot, "access_control/enabled") is True
    apart = router_config([LOCAL[0]], [], security=LinkSecurity(certs["viewer:v"]))
    assert value(apart, "access_control/enabled") is False, "no other host, no list needed"


def test_what_a_router_lacks_is_named(certs, tmp_path):
    edge = Certificates(tmp_path / "edge")
    shutil.copytree(certs["edge:e1"].folder, edge.folder)
    edge.access.unlink()
    with pytest.raises(SecurityError, match=r"access.json: No such file .*: a router needs the list"):
        router_config(["tls/0.0.0.0:7447"], [], security=LinkSecurity(edge))
    edge.key.unlink()
    with pytest.raises(SecurityError, match=r"key.pem is not there"):
        router_config(["tls/0.0.0.0:7447"], [], security=LinkSecurity(edge))
    with pytest.raises(SecurityError, match=r"robot:r1\) names no host by which others reach it"):
        router_config(["tls/0.0.0.0:7447"], [], security=LinkSecurity(certs["robot:r1"]))


def test_rules_of_ones_own_stay_as_they_are(certs, tmp_path):
    own = tmp_path / "own.json5"
    own.write_text(f'{{mode: "router", listen: {{endpoints: []}}, access_control: {json.dumps(frames_stay_here())}}}')
    config = router_config(["tls/0.0.0.0:7447"], [], own, LinkSecurity(certs["edge:e1"]))
    assert value(config, "access_control/default_permission") == "allow"
    with pytest.raises(SecurityError, match="but the Zenoh configuration has an access_control of its own"):
        router_config([LOCAL[0]], [], own, LinkSecurity(frames_stay=True))


def test_a_link_in_clear_is_said():
    assert cautions(LOCAL, ["tls/edge:7447", "tcp/127.0.0.1:1"]) == []
    opened, clear = cautions(["tcp/0.0.0.0:7447"], ["tcp/edge:7447"])
    assert "tcp/0.0.0.0:7447" in opened
    assert "tcp/edge:7447" in clear


MEMBERS = ("edge:e1", "robot:r1", "robot:r2", "viewer:anna", "viewer:otto", "editor:bob")


def allowed(rules, who, flow, message):
    return {
        key
        for rule in rules["rules"]
        if rule["id"].rsplit(" ", 1)[0] == who and flow in rule["flows"] and message in rule["messages"]
        for key in rule["key_exprs"]
    }


def test_names_are_written_out_for_zenoh_knows_no_patterns_of_them():
    rules = access_control(AccessList(members=MEMBERS))
    subjects = {subject["id"]: subject for subject in rules["subjects"]}
    assert subjects["viewer"]["cert_common_names"] == ["viewer:anna", "viewer:otto"]
    assert subjects["robot:r1"]["cert_common_names"] == ["robot:r1"]
    assert all("cert_common_names" in subject or "link_protocols" in subject for subject in subjects.values()), (
        "none is open to all"
    )
    assert {policy["id"] for policy in rules["policies"]} == {"local", "robot:r1", "robot:r2", "edge", "viewer", "editor"}
    assert {rule["permission"] for rule in rules["rules"]} == {"allow"}


@pytest.mark.parametrize("who", ["viewer", "editor", "robot:r1"])
def test_a_swap_is_ordered_by_nobody_who_comes_by_a_link_but_the_edge(who):
    rules = access_control(AccessList(members=MEMBERS))
    voices = zenoh.KeyExpr("deixis/r1/headpose/voice/one")
    asked = [zenoh.KeyExpr(key) for key in allowed(rules, who, "ingress", "query")]
    assert asked
    assert not [key for key in asked if key.intersects(voices)]
    assert [key for key in allowed(rules, "edge", "ingress", "query") if zenoh.KeyExpr(key).includes(voices)]
    assert [key for key in allowed(rules, "local", "ingress", "query") if zenoh.KeyExpr(key).includes(voices)]


def test_a_role_that_nobody_has_gets_no_rules():
    rules = access_control(AccessList(members=("edge:e1",)))
    assert {policy["id"] for policy in rules["policies"]} == {"local", "edge"}
    assert access_control(AccessList(members=()))["policies"][0]["subjects"] == ["local socket", "local tcp"]


def test_a_robot_publishes_as_its_own_camera_alone():
    rules = access_control(AccessList(members=MEMBERS))
    assert allowed(rules, "robot:r1", "ingress", "put") == {
        *("deixis/r1/camera/frame", "deixis/r1/camera/info", "deixis/r1/camera/health", "deixis/r1/robot/pose"),
        "deixis/r1/supervisor/health",
    }
    assert "deixis/r2/camera/frame" in allowed(rules, "robot:r2", "ingress", "put")
    assert not [key for key in allowed(rules, "edge", "ingress", "put") if "camera" in key]
    assert allowed(rules, "viewer", "ingress", "put") == set()
    assert allowed(rules, "editor", "ingress", "put") == {"deixis/*/fusion/poi/**"}


@pytest.mark.parametrize("stay", [False, True])
def test_frames_go_to_the_edge_alone_and_where_they_stay_to_nobody(stay):
    rules = access_control(AccessList(members=MEMBERS, frames_stay=stay))
    frames = {"deixis/*/camera/frame", "deixis/r1/camera/frame"}
    given = {who: allowed(rules, who, "egress", "put") & frames for who in ("edge", "robot:r1", "viewer", "editor")}
    assert given == {"edge": set() if stay else {"deixis/*/camera/frame"}, "robot:r1": set(), "viewer": set(), "editor": set()}
    sent = allowed(rules, "robot:r1", "ingress", "put")
    assert bool(sent & frames) is not stay
    assert ("deixis/r1/tracker/tracks" in sent) is stay
    assert not {"**", "deixis/**"} & allowed(rules, "edge", "egress", "put")
