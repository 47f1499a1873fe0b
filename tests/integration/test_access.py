"""What each role may do, through real routers on loopback: a robot's and an edge's, joined by mutual TLS.

The test publishes and subscribes as stages and people would. What is denied is silent, so something that is allowed is sent
behind it, and when that has come the rest would have.
"""

import signal
import sys
from contextlib import ExitStack

import pytest
import zenoh
from deixis_runtime.session import client_config
from deixis_schemas import codec
from deixis_schemas.samples import SAMPLES
from parties import Party, until_heard
from rerun_ready import columns, needs_rerun
from running import answers, command, free_port, process, wait_until
from site_made import YEAR, add, holder, make_site

PATIENCE_S = 30.0
ROBOT = "r1"


def key(path, robot=ROBOT):
    return f"deixis/{robot}/{path}"


class Site:
    """Two routers and the parties that link to them."""

    def __init__(self, folder, *, frames_stay=False, robot_options=()):
        self._stack = ExitStack()
        self.folder, self._robot_options = folder, robot_options
        self.site = make_site(folder / "site", frames_stay=frames_stay)
        self.certs = {name: add(self.site, name, *hosts) for name, hosts in MEMBERS.items()}
        self.edge = f"tls/127.0.0.1:{free_port()}"
        self.sockets = {name: f"unixsock-stream/{folder}/{name}.sock" for name in ("robot", "edge")}

    def __enter__(self):
        self._router("edge", self.certs["edge:e1"], "--listen", self.edge)
        self._router("robot", self.certs["robot:r1"], "--connect", self.edge, *self._robot_options)
        log = self.folder / "robot"
        wait_until(lambda: f"linked to {self.edge}" in log.read_text(), "the robot is linked", PATIENCE_S, log)
        return self

    def __exit__(self, *_):
        self._stack.close()

    def _router(self, name, certificates, *options):
        argv = [sys.executable, "-m", "deixis_runtime.router", "--listen", self.sockets[name], *options]
        with holder(certificates):
            self._stack.enter_context(process(argv, self.folder / name))
        wait_until(lambda: answers(self.sockets[name]), f"the router {name}", PATIENCE_S, self.folder / name)

    def party(self, who=None, at=None):
        """A session of a member, at the edge; or of a program `at` a host, through its socket."""
        with holder(None if who is None else self.certs[who]):
            config = client_config(self.edge if at is None else self.sockets[at], shared_memory=False)
            return Party(self._stack.enter_context(zenoh.open(config)))


MEMBERS = {
    "edge:e1": ("127.0.0.1",),
    "robot:r1": (),
    "robot:r2": (),
    "viewer:anna": (),
    "editor:bob": (),
}
FRAME, INFO, TARGET = (key(path) for path in ("camera/frame", "camera/info", "fusion/target"))
PUBLISHED = (
    *("camera/frame", "camera/info", "camera/health", "supervisor/health", "robot/pose"),
    *("tracker/tracks", "tracker/health", "headpose/poses", "gesture/gestures"),
    *("fusion/belief", "fusion/target", "fusion/poi/P1", "fusion/health"),
)
BY_CAMERA = {"camera/frame", "camera/info", "camera/health", "supervisor/health", "robot/pose"}
BY_STAGES = set(PUBLISHED) - BY_CAMERA | {"supervisor/health"}
READABLE = set(PUBLISHED) - {"camera/frame"}
ASKED = ("camera/info", "camera/health", "*/health", "fusion/state", "fusion/poi/P1", "fusion/poi/P1?op=put", "camera/frame")
ANSWERED = {"camera/info", "camera/health", "*/health", "fusion/state"}
EDITS = {"fusion/poi/P1", "fusion/poi/P1?op=put"}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with Site(tmp_path_factory.mktemp("site")) as made:
        yield made


@pytest.fixture(scope="module")
def camera(site):
    """In the camera's place: a program of the robot."""
    return site.party(at="robot")


@pytest.fixture(scope="module")
def stages(site):
    """In the other stages' place: a program of the edge. It answers all that is asked, of each robot."""
    party = site.party(at="edge")
    party.serve("deixis/**")
    return party


def heard_of(listener, sender, last, robot=ROBOT):
    """What the listener hears of all that a robot's system publishes. It surely hears `last`, which is sent behind the rest."""
    until_heard(listener, last, lambda: sender.put(last))
    listener.heard.clear()
    for path in PUBLISHED:
        sender.put(key(path, robot), b"each")
    sender.put(last, b"end")
    wait_until(lambda: (last, b"end") in [(name, payload) for name, _, payload in listener.heard], "the end", PATIENCE_S)
    return {name.removeprefix(f"deixis/{robot}/") for name, _, payload in listener.heard if payload == b"each"}


@pytest.mark.parametrize(
    ("who", "readable"),
    [
        ("edge:e1", set(PUBLISHED)),
        ("robot:r1", READABLE),
        ("robot:r2", set()),
        ("viewer:anna", READABLE),
        ("editor:bob", READABLE),
    ],
)
def test_who_hears_what(site, stages, who, readable):
    reader = site.party(who)
    for path in PUBLISHED:
        reader.listen(key(path))
    reader.listen("deixis/r2/fusion/target")
    assert heard_of(reader, stages, "deixis/r2/fusion/target" if who != "robot:r1" else TARGET) == readable


@needs_rerun
def test_a_viewer_is_shown_all_but_the_picture_and_told_so(site, stages, tmp_path):
    out, log = tmp_path / "out.rrd", tmp_path / "log"
    argv = command(
        "deixis", "view", "--robot", ROBOT, "--connect", site.edge, "--certs", site.certs["viewer:anna"].folder, "--out", out
    )
    samples = {type(message).__name__: message for message in SAMPLES}
    with process(argv, log) as child:

        def told():
            for path, name in (("camera/frame", "Frame"), ("tracker/tracks", "Tracks"), ("fusion/belief", "Belief")):
                sample = samples[name]
                stages.session.put(key(path), codec.encode(sample), encoding=codec.encoding_of(type(sample)))
            return "all is shown but pictures" in log.read_text()

        wait_until(told, "it says that there are no pictures", PATIENCE_S, log)
        child.send_signal(signal.SIGINT)
        assert child.wait(PATIENCE_S) == 0
    found = columns(out)
    assert "/picture/tracks" in found
    assert "/picture" not in found


@pytest.mark.parametrize(
    ("who", "publishes"),
    [
        ("edge:e1", BY_STAGES),
        ("robot:r1", BY_CAMERA),
        ("robot:r2", set()),
        ("viewer:anna", set()),
        ("editor:bob", {"fusion/poi/P1"}),
    ],
)
def test_who_publishes_what(site, stages, who, publishes):
    writer, hearer = site.party(who), site.party(at="edge")
    hearer.listen("deixis/*/**")
    until_heard(hearer, "deixis/r1/fusion/target", lambda: stages.put(TARGET, b"here"))
    for path in PUBLISHED:
        writer.put(key(path))
    # An answer to it shows that the router has dealt with what it sent before.
    asked = "deixis/r2/fusion/state" if who == "robot:r2" else key("fusion/state")
    assert writer.asks(asked) or who == "edge:e1"
    stages.put(TARGET, b"end")
    wait_until(lambda: b"end" in [payload for _, _, payload in hearer.heard], "the end", PATIENCE_S)
    assert {name.removeprefix("deixis/r1/") for name, _, payload in hearer.heard if payload == b"x"} == publishes


@pytest.mark.parametrize(
    ("who", "answered"),
    [
        ("edge:e1", set(ASKED)),
        ("robot:r1", ANSWERED),
        ("robot:r2", set()),
        ("viewer:anna", ANSWERED),
        ("editor:bob", ANSWERED | EDITS),
    ],
)
@pytest.mark.usefixtures("stages")
def test_who_may_ask_what(site, who, answered):
    asker = site.party(who)
    assert {selector for selector in ASKED if asker.asks(key(selector))} == answered


def test_an_editor_may_delete_a_poi_and_a_viewer_may_not(site, stages):
    hearer, viewer, editor = site.party(at="edge"), site.party("viewer:anna"), site.party("editor:bob")
    hearer.listen(key("fusion/poi/*"))
    until_heard(hearer, key("fusion/poi/P0"), lambda: stages.put(key("fusion/poi/P0")))
    viewer.session.delete(key("fusion/poi/P1"))
    assert viewer.asks(key("fusion/state"))
    editor.session.delete(key("fusion/poi/P2"))
    wait_until(lambda: key("fusion/poi/P2") in hearer.names(), "the editor's edit", PATIENCE_S)
    assert key("fusion/poi/P1") not in hearer.names()


def test_liveliness_is_of_ones_own_stages_and_for_all_to_see(site, stages):
    viewer, robot, stranger = (site.party(who) for who in ("viewer:anna", "robot:r1", "robot:r2"))
    other = site.party("viewer:anna")
    robot.live(key("@alive/camera/one"))
    robot.live(key("@alive/fusion/false"))
    stranger.live(key("@alive/camera/false"))
    other.live(key("@alive/camera/false"))
    stages.live(key("@alive/fusion/one"))
    viewer.follow(key("@alive/*/*"))
    expected = {key("@alive/camera/one"), key("@alive/fusion/one")}
    wait_until(lambda: expected <= viewer.names(), "the tokens", PATIENCE_S)
    assert stranger.asks("deixis/r2/fusion/state"), "what it declared before has been dealt with"
    assert other.asks(key("fusion/state"))
    assert viewer.names() == expected


def test_frames_and_answers_cross_the_link_and_edits_of_a_robot_do_not(site, stages, camera):
    edge, robot = site.party(at="edge"), site.party(at="robot")
    edge.listen(key("**"))
    robot.listen(key("fusion/*"))
    until_heard(edge, FRAME, lambda: camera.put(FRAME))
    until_heard(robot, TARGET, lambda: stages.put(TARGET))
    assert robot.asks(key("fusion/state"))
    assert robot.asks(key("fusion/poi/P1?op=put")) == []
    camera.put(key("fusion/poi/P1"), b"false")
    until_heard(edge, INFO, lambda: camera.put(INFO))
    assert b"false" not in [payload for _, _, payload in edge.heard]


@pytest.mark.parametrize("by", ["the site", "the robot"])
def test_where_frames_stay_none_leaves_the_robot(tmp_path, by):
    options = ("--frames-stay",) if by == "the robot" else ()
    with Site(tmp_path, frames_stay=by == "the site", robot_options=options) as site:
        camera, here, there = site.party(at="robot"), site.party(at="robot"), site.party(at="edge")
        member = site.party("edge:e1")
        here.listen(FRAME)
        for party in (there, member):
            party.listen("deixis/**" if party is there else key("**"))
        until_heard(here, FRAME, lambda: camera.put(FRAME))
        for party in (there, member):
            until_heard(party, INFO, lambda: camera.put(INFO))
        for _ in range(10):
            camera.put(FRAME)
        camera.put(INFO, b"end")
        for party in (there, member):
            wait_until(lambda party=party: (b"end") in [p for _, _, p in party.heard], "the end", PATIENCE_S)
            assert FRAME not in party.names()
        # The stages that need frames run on the robot, and so it may send what they publish.
        if by == "the site":
            until_heard(there, key("tracker/tracks"), lambda: camera.put(key("tracker/tracks")))


def test_frames_stay_without_certificates_too(tmp_path):
    endpoint, inside = f"tcp/127.0.0.1:{free_port()}", f"unixsock-stream/{tmp_path}/socket"
    argv = [sys.executable, "-m", "deixis_runtime.router", "--listen", inside, "--listen", endpoint, "--frames-stay"]
    with process(argv, tmp_path / "log"), ExitStack() as stack:
        wait_until(lambda: answers(inside), "the router", PATIENCE_S, tmp_path / "log")
        camera, here, there = (
            Party(stack.enter_context(zenoh.open(client_config(where, shared_memory=False))))
            for where in (inside, inside, endpoint)
        )
        here.listen("deixis/**")
        there.listen("deixis/**")
        until_heard(here, FRAME, lambda: camera.put(FRAME))
        until_heard(there, INFO, lambda: camera.put(INFO))
        assert FRAME not in there.names()


def test_a_name_that_is_off_the_list_is_given_nothing(site, stages):
    outsider = add(site.site, "viewer:outsider", lasts=YEAR)  # issued after the routers began: so not on their lists
    with holder(outsider), ExitStack() as stack:
        party = Party(stack.enter_context(zenoh.open(client_config(site.edge, shared_memory=False))))
        party.listen(TARGET)
        assert party.asks(key("fusion/state")) == []
        viewer = site.party("viewer:anna")
        viewer.listen(TARGET)
        until_heard(viewer, TARGET, lambda: stages.put(TARGET))
        assert party.heard == []
