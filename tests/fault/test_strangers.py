"""Strangers at an edge's router on loopback: without a certificate of the site, in date, nobody gets in; and doctor says why.

A stranger does not run our commands, so each tries with settings of Zenoh's own, too.
"""

import json
import sys
from contextlib import ExitStack
from datetime import timedelta

import pytest
import zenoh
from deixis_cli.doctor import examine
from deixis_runtime.session import Unreachable, client_config, open_client
from deixis_runtime.tls import tls_settings
from deixis_runtime.unanswered import why_unanswered
from running import answers, command, free_port, get_one, process, wait_until
from site_made import add, holder, make_site

PATIENCE_S = 30.0
GIVE_UP_MS = 700
PUT = "deixis/r1/camera/frame"


class Edge:
    """A router with the certificate of an edge, a program of its host that listens to all, and who comes to it."""

    def __init__(self, folder, certificates, stack):
        self.endpoint = f"tls/127.0.0.1:{free_port()}"
        self.inside = inside = f"unixsock-stream/{folder}/socket"
        argv = [sys.executable, "-m", "deixis_runtime.router", "--listen", inside, "--listen", self.endpoint]
        with holder(certificates):
            stack.enter_context(process(argv, folder / "log"))
        wait_until(lambda: answers(inside), "the router", PATIENCE_S, folder / "log")
        self.session = stack.enter_context(zenoh.open(client_config(inside, shared_memory=False)))
        self.heard = []
        self._subscriber = self.session.declare_subscriber("**", lambda sample: self.heard.append(sample.payload.to_bytes()))

    def takes(self, certificates):
        """Whether a robot with this certificate is heard."""
        with holder(certificates), open_client(self.endpoint, shared_memory=False) as session:
            wait_until(lambda: session.put(PUT, b"robot") or b"robot" in self.heard, "the robot is heard", PATIENCE_S)
        return True


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    return make_site(tmp_path_factory.mktemp("strangers") / "site")


@pytest.fixture(scope="module")
def robot(site):
    return add(site, "robot:r1")


@pytest.fixture(scope="module")
def edge(site, robot, tmp_path_factory):
    certificates = add(site, "edge:e1", "127.0.0.1")
    with ExitStack() as stack:
        made = Edge(tmp_path_factory.mktemp("edge"), certificates, stack)
        assert made.takes(robot)
        yield made


@pytest.fixture(scope="module")
def other(tmp_path_factory):
    """Another site, whose CA the edge does not know."""
    return make_site(tmp_path_factory.mktemp("other") / "site")


def open_as_stranger(endpoint, **settings):
    """Open a session with Zenoh's own settings `transport/link/tls`, and put. Raises zenoh.ZError where it is refused."""
    config = zenoh.Config()
    for path, value in {
        "mode": "client",
        "scouting/multicast/enabled": False,
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": GIVE_UP_MS,
        "connect/exit_on_failure": True,
        "transport/shared_memory/enabled": False,
        **{f"transport/link/tls/{name}": value for name, value in settings.items()},
    }.items():
        config.insert_json5(path, json.dumps(value))
    with zenoh.open(config) as session:
        session.put(PUT, b"stranger")


def doctor(endpoint, certificates):
    """What doctor says of the endpoint to the holder of these certificates."""
    with holder(certificates):
        (found,) = examine(endpoint, "r1")
    assert found.level == "wrong"
    return f"{found.what}; {found.advice}"


def why(endpoint, certificates):
    """What doctor would say, without trying first to open a session."""
    return why_unanswered(endpoint, certificates).what


def refused(edge, robot, endpoint=None, **settings):
    """That a stranger is refused, and that a member is served all the same."""
    with pytest.raises(zenoh.ZError):
        open_as_stranger(endpoint or edge.endpoint, **settings)
    edge.heard.clear()
    assert edge.takes(robot)
    return b"stranger" not in edge.heard


def test_a_stranger_without_a_certificate_is_refused(edge, robot, site):
    assert refused(edge, robot, root_ca_certificate=str(site.path / "ca.pem"))
    assert refused(edge, robot, root_ca_certificate=str(site.path / "ca.pem"), enable_mtls=False, verify_name_on_connect=False)
    with holder(None), pytest.raises(Unreachable, match=r"TLS needs a certificate: .*--certs"), open_client(edge.endpoint):
        pass
    assert "DEIXIS_CERTS" in doctor(edge.endpoint, None)


def test_a_stranger_who_speaks_no_tls_is_refused(edge, robot):
    plain = edge.endpoint.replace("tls/", "tcp/")
    assert refused(edge, robot, plain)
    with holder(None), pytest.raises(Unreachable, match="speaks TLS"), open_client(plain, shared_memory=False):
        pass
    assert f"what listens at {plain} speaks TLS" in doctor(plain, None)


def test_a_stranger_with_a_certificate_of_another_ca_is_refused(edge, robot, other, site):
    theirs = add(other, "robot:r1")
    knows_the_ca = tls_settings(theirs) | {"root_ca_certificate": str(site.path / "ca.pem")}
    assert refused(edge, robot, **knows_the_ca)
    assert refused(edge, robot, **tls_settings(theirs))
    said = doctor(edge.endpoint, theirs)
    assert f"the certificate of {edge.endpoint} is refused by us" in said
    assert "certificates of the same CA" in said


def test_a_stranger_with_an_expired_certificate_is_refused(edge, robot, site):
    expired = add(site, "robot:late", made_days_ago=9, lasts=timedelta(days=8))
    assert refused(edge, robot, **tls_settings(expired))
    said = doctor(edge.endpoint, expired)
    assert "the certificate robot:late" in said
    assert "has expired 24 h 0 min ago" in said
    assert "deixis certs renew" in said


def test_a_link_ends_when_the_certificate_of_the_other_side_does(edge, site):
    short = add(site, "viewer:short", lasts=timedelta(seconds=4))
    with holder(short), open_client(edge.endpoint, shared_memory=False) as session:
        assert session.info.routers_zid()
        wait_until(lambda: not session.info.routers_zid(), "the link ends", PATIENCE_S)


def test_an_edge_of_another_ca_is_not_taken_for_ours(other, robot, tmp_path):
    with ExitStack() as stack:
        impostor = Edge(tmp_path, add(other, "edge:e1", "127.0.0.1"), stack)
        with pytest.raises(zenoh.ZError):
            open_as_stranger(impostor.endpoint, **tls_settings(robot))
        assert impostor.heard == []
        assert "is refused by us: unable to get local issuer certificate" in why(impostor.endpoint, robot)


def test_a_certificate_of_another_host_is_not_taken_for_the_edge(site, robot, tmp_path):
    with ExitStack() as stack:
        elsewhere = Edge(tmp_path, add(site, "edge:e2", "10.0.0.2"), stack)
        with pytest.raises(zenoh.ZError):
            open_as_stranger(elsewhere.endpoint, **tls_settings(robot))
        assert "is that of another host: IP address mismatch" in why(elsewhere.endpoint, robot)


def test_a_viewer_cannot_stand_in_for_the_edge(site, robot, tmp_path):
    viewer = add(site, "viewer:anna")
    endpoint = f"tls/127.0.0.1:{free_port()}"
    settings = tmp_path / "router.json5"
    settings.write_text(json.dumps({"mode": "router", "transport": {"link": {"tls": tls_settings(viewer)}}}))
    argv = [sys.executable, "-m", "deixis_runtime.router", "--config", settings, "--listen", endpoint]
    with holder(None), process(argv, tmp_path / "log"):
        wait_until(lambda: "listening" in (tmp_path / "log").read_text(), "the router", PATIENCE_S, tmp_path / "log")
        with pytest.raises(zenoh.ZError):
            open_as_stranger(endpoint, **(tls_settings(robot) | {"verify_name_on_connect": False}))
        assert "purpose" in why(endpoint, robot)


def test_doctor_asks_whether_a_member_who_is_given_nothing_is_on_the_list(edge, site):
    unlisted = add(site, "viewer:unlisted")  # the router has read the list before
    said = doctor_of_silence(edge.endpoint, unlisted)
    assert "no stage of robot 'r1' is alive or answers" in said
    assert "is viewer:unlisted on the list of that router (access.json)?" in said


def doctor_of_silence(endpoint, certificates):
    with holder(certificates):
        answered, silence = examine(endpoint, "r1")
    assert answered.level == "ok"
    return f"{silence.what}; {silence.advice}"


def test_a_robots_router_says_why_it_is_refused(edge, site, tmp_path):
    expired = add(site, "robot:old", made_days_ago=9, lasts=timedelta(days=8))
    inside = f"unixsock-stream/{tmp_path}/s"
    argv = [sys.executable, "-m", "deixis_runtime.router", "--listen", inside, "--connect", edge.endpoint]
    with holder(expired), process(argv, tmp_path / "log"):
        log = tmp_path / "log"
        wait_until(lambda: "ERROR the certificate robot:old" in log.read_text(), "the reason", PATIENCE_S, log)
        assert f"no link yet to {edge.endpoint}" in log.read_text()


def test_a_stage_shows_in_its_health_that_the_certificate_of_its_host_expires_soon(edge, site, tmp_path):
    soon = add(site, "edge:soon", "127.0.0.1", lasts=timedelta(days=9))
    argv = command("deixis-gesture", "--robot", "soon", "--connect", edge.inside)
    with holder(soon), process(argv, tmp_path / "log"), open_client(edge.inside, shared_memory=False) as session:

        def note():
            health = get_one(session, "deixis/soon/gesture/health") or {}
            return next((said for said in health.get("notes", []) if said.startswith("the certificate edge:soon in ")), None)

        said = wait_until(note, "a note in health", PATIENCE_S, tmp_path / "log")
    assert "expires in 8 days" in said or "expires in 9 days" in said
    assert "WARNING the certificate edge:soon" in (tmp_path / "log").read_text()
