"""`deixis calibrate site` as somebody goes through it, at a terminal: stands where told, points at what is asked for, and the
stages say what they see of it, over a real router.
"""

import os
import pty
import re
import subprocess
import sys
import threading
from contextlib import contextmanager, suppress
from dataclasses import replace

import numpy as np
import pytest
from deixis_calibration.site_labels import load_labels
from deixis_cli.main import main
from deixis_runtime.session import open_client
from deixis_runtime.site import load_site
from deixis_schemas import codec, topics
from pointing_people import SPOTS, camera_info, messages_of, pointing, write_site
from running import answers, command, free_port, process, wait_until

ESCAPES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\x07")
ASKED = re.compile(r"Stand at spot (?P<spot>\w)|Point at (?P<poi>\w+),|(?P<held>thank you)|(?P<given_up>no pointing was held)")
PACE_S = 0.01
"""Of frames whose stamps are a tenth of a second apart: the session goes ten times as fast as life."""
PATIENCE_S = 120.0
TOPICS = {topic.type: topic for topic in (topics.TRACKS, topics.HEAD_POSES, topics.GESTURES)}
STANDS = [word for x, y in SPOTS.values() for word in ("--stand", f"{x},{y}")]


@pytest.fixture(scope="module")
def endpoint(tmp_path_factory):
    """A router's."""
    listening = f"tcp/127.0.0.1:{free_port()}"
    log = tmp_path_factory.mktemp("router") / "log"
    with process([sys.executable, "-m", "deixis_runtime.router", "--listen", listening], log):
        wait_until(lambda: answers(listening), "a router", PATIENCE_S, log)
        yield listening


class Person:
    """Stands where told and points at what is asked for, and the stages tell of it, frame by frame, until the end."""

    def __init__(self, session, robot):
        self._session, self._robot = session, robot
        self._rng = np.random.default_rng(1)
        self.spot, self._seen = "A", None
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._live)
        self.look_at(None)

    def look_at(self, poi):
        """Point at it; at nothing, stand idle."""
        self._seen = replace(pointing(self._rng, self.spot, poi or "P1"), **({} if poi else {"gesture": None}))

    def __enter__(self):
        payload, encoding = codec.encode(camera_info()), codec.encoding_of(type(camera_info()))
        key = topics.CAMERA_INFO.key(self._robot)
        self._info = self._session.declare_queryable(key, lambda query: query.reply(key, payload, encoding=encoding))
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ends.set()
        self._thread.join()
        self._info.undeclare()

    def _live(self):
        seq = 0
        while not self._ends.wait(PACE_S):
            for message in messages_of(self._seen, seq):
                key, encoding = TOPICS[type(message)].key(self._robot), codec.encoding_of(type(message))
                self._session.put(key, codec.encode(message), encoding=encoding)
            seq += 1


class Terminal:
    """A terminal in which a command runs, with what it has shown."""

    def __init__(self, argv):
        ours, theirs = pty.openpty()
        # Its own controlling terminal, whose Ctrl-C is an interrupt.
        self.child = subprocess.Popen(
            ["setsid", "--ctty", *argv], stdin=theirs, stdout=theirs, stderr=theirs,
            env={**os.environ, "COLUMNS": "150", "TERM": "xterm"},
        )  # fmt: skip
        os.close(theirs)
        self._ours, self._said = ours, ""
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    @property
    def text(self):
        return ESCAPES.sub("", self._said).replace("\r", "\n")

    def asked(self, done):
        """What it asks for and says next, after so many times; nothing once it has ended."""

        def found():
            return list(ASKED.finditer(self.text))[done:]

        wait_until(lambda: found() or self.child.poll() is not None, "it asks", PATIENCE_S)
        return found()

    def type(self, keys):
        os.write(self._ours, keys)

    def end(self):
        """The exit status."""
        status = self.child.wait(PATIENCE_S)
        self._reader.join()
        os.close(self._ours)
        return status

    def _read(self):
        with suppress(OSError):  # it has ended
            while data := os.read(self._ours, 4096):
                self._said += data.decode()


@contextmanager
def terminal(*arguments):
    opened = Terminal(command("deixis", "calibrate", "site", *arguments))
    try:
        yield opened
    finally:
        opened.child.kill()


def go_through(shown, person, *, never=None, ends_after=None):
    """Do as told, but for `never`, until the command ends; press Ctrl-C after so many pointings. What was asked, in order."""
    asked, done = [], 0
    while found := shown.asked(done):
        for one in found:
            if one["spot"]:
                person.spot = one["spot"]
                person.look_at(None)
                asked.append(person.spot)
                shown.type(b"\n")
            elif one["poi"]:
                person.look_at(one["poi"] if one["poi"] != never else None)
                asked.append(one["poi"])
            else:
                person.look_at(None)
                if ends_after is not None and (ends_after := ends_after - 1) == 0:
                    shown.type(b"\x03")
        done += len(found)
    return asked


@pytest.fixture
def site(tmp_path):
    write_site(tmp_path / "site.yaml")
    return tmp_path / "site.yaml"


@pytest.fixture
def person(endpoint, robot):
    with open_client(endpoint, shared_memory=False) as session, Person(session, robot) as somebody:
        yield somebody


def test_a_session_says_what_is_told_apart_and_corrects_the_mount(endpoint, robot, site, person, tmp_path, capsys):
    keep, out = tmp_path / "session", tmp_path / "corrected.yaml"
    system = ["--site", site, "--robot", robot, "--connect", endpoint, *STANDS]
    with terminal(*system, "--height", 1.75, "--rounds", 1, "--only", "P1,P3,P6,P9", "--keep", keep, "--out", out) as shown:
        asked = go_through(shown, person)
        status = shown.end()
    assert status in (0, 3), shown.text
    order = ["P1", "P3", "P6", "P9"]
    assert asked == ["A", *order, "B", *order, "C", *order]
    assert "12 pointings measured; 'as corrected' each is judged by what the others say, and not by itself" in shown.text
    assert shown.text.count("thank you") == 12
    mount = load_site(out).camera["mount"]
    assert mount["yaw_deg"] == pytest.approx(4.0, abs=1.0)
    labels = load_labels(keep / "labels.yaml")
    assert [(one.spot, one.poi_id) for one in labels.pointings] == [(spot, poi) for spot in SPOTS for poi in order]
    assert all(one.to_s - one.from_s == pytest.approx(1.0, abs=0.35) for one in labels.pointings)
    files = ["--from", keep / "session.mcap", "--labels", keep / "labels.yaml"]
    assert main(["calibrate", "site", "--site", str(site), *map(str, files)]) == status
    again = capsys.readouterr().out
    assert again.strip() in re.sub(r"\n+", "\n", shown.text), "the same again, without anybody"


def test_what_was_pointed_at_until_ctrl_c_counts(endpoint, robot, site, person):
    with terminal("--site", site, "--robot", robot, "--connect", endpoint, *STANDS) as shown:
        go_through(shown, person, ends_after=2)
        assert shown.end() == 130
    assert "ended early: what was pointed at until now counts" in shown.text
    assert "2 pointings measured" in shown.text
    assert "4 are the fewest" in shown.text


@pytest.mark.usefixtures("person")
def test_ended_before_anybody_has_pointed_it_keeps_nothing_and_says_so(endpoint, robot, site, tmp_path):
    arguments = ["--site", site, "--robot", robot, "--connect", endpoint, *STANDS, "--keep", tmp_path / "new" / "session"]
    with terminal(*arguments) as shown:
        assert shown.asked(0)[0]["spot"] == "A"
        shown.type(b"\x03")
        assert shown.end() == 130
    assert "ended early: nobody has pointed at anything yet, and nothing is kept" in shown.text
    assert "deixis:" not in shown.text
    assert not (tmp_path / "new").exists()


def test_who_does_not_point_is_not_waited_for_for_ever(endpoint, robot, site, person):
    arguments = ["--site", site, "--robot", robot, "--connect", endpoint, *STANDS[:2], "--rounds", 1, "--only", "P3,P6"]
    with terminal(*arguments) as shown:
        go_through(shown, person, never="P6")
        assert shown.end() == 3
    assert re.search(r"P6 +not seen", shown.text)
    assert shown.text.count("no pointing was held") == 1


def test_a_system_without_camera_is_refused_before_anybody_has_to_stand_there(endpoint, robot, site, tmp_path):
    keep = tmp_path / "session"
    with terminal("--site", site, "--robot", robot, "--connect", endpoint, *STANDS, "--keep", keep) as shown:
        assert shown.end() == 1
    assert not keep.exists(), "the next try may have the name"
    assert f"no camera of robot '{robot}' tells its lens" in shown.text
    assert "Stand at" not in shown.text
