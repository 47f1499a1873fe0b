"""`deixis view` and `deixis run --view`: what is drawn of the example clip, and that no viewer holds a run up."""

import os
import re
import signal
import socket
import subprocess
import tempfile
from contextlib import contextmanager
from functools import cache

import cv2
import numpy as np
import pytest
import yaml
from deixis_cli.main import main
from deixis_cli.play import play
from deixis_runtime.host import HostOptions
from deixis_runtime.site import load_site
from deixis_view import colours
from deixis_view.drawer import Drawer, Painter
from deixis_view.drawing import Drawing, Layout, Picture, Shot
from deixis_view.feed import Feed
from deixis_view.floor import FIELD_OF_VIEW_M, shown
from deixis_view.hearing import hear, keys_of
from deixis_view.known import Known
from deixis_view.scene import UNRECORDED, Scene
from deixis_view.workplace import remove_left
from headless_browser import needs_chromium, page
from rerun_ready import columns, needs_rerun
from running import BIN, CLIP, POINTED_AT, SITE, children, command, free_port, process, system, wait_until
from stuck_viewer import StuckSink

FRAMES = 126
DRAWN = FRAMES // 3
"""At the default rate, of 30 frames a second."""
WINDOW = (1000, 700)
LOADED_S = 240.0
"""The page draws by the processor here, and the processor may be busy."""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The example, played once in lockstep: its recording, without pictures, and what was drawn of it while it ran."""
    folder = tmp_path_factory.mktemp("view")
    options = ["--site", SITE, "--lockstep", "--robot", "test-view", "--listen", f"tcp/127.0.0.1:{free_port()}"]
    files = ["--registry", folder / "pois.sqlite", "--out", folder, "--view", folder / "run.rrd"]
    done = subprocess.run(
        command("deixis", "run", CLIP, *options, *files, "--expect", POINTED_AT),
        capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return folder


def drawn(recording, out, *options):
    done = subprocess.run(
        command("deixis", "view", recording, "--site", SITE, "--out", out, *options),
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return columns(out)


def value(rows, name):
    """The last value of a column, without the list that it comes in."""
    return next(row[name] for row in reversed(rows) if name in row)


@needs_rerun
def test_a_run_is_drawn_into_a_file_that_rerun_reads_and_that_names_the_poi(run):
    checked = subprocess.run([BIN / "rerun", "rrd", "verify", run / "run.rrd"], capture_output=True, text=True, check=False)
    assert checked.returncode == 0, checked.stderr
    found = columns(run / "run.rrd")
    assert len(found["/picture"]) == DRAWN
    assert len({row["seq"] for row in found["/picture/tracks"]}) == DRAWN
    assert {"/picture/contours", "/picture/fingertips", "/picture/yaw", "/map/walls", "/map/robot", "/health"} <= set(found)
    chances = [row["Scalars:scalars"][0] for row in found[f"/belief/0/{POINTED_AT}"] if "Scalars:scalars" in row]
    assert max(chances) > 0.7
    assert f"({POINTED_AT})" in value(found["/reason"], "TextDocument:text")[0]
    assert "points to the right" in value(found["/reason"], "TextDocument:text")[0]
    assert any(POINTED_AT in row["TextLog:text"][0] for row in found["/log"])
    picture = cv2.imdecode(np.frombuffer(bytes(value(found["/picture"], "EncodedImage:blob")[0]), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (480, 640, 3)
    ship = shown(0.95, 1.82)
    assert any(np.allclose(point, ship, atol=1e-5) for point in value(found["/map/pois"], "Points2D:positions"))


@needs_rerun
def test_a_recording_is_drawn_without_pictures_or_with_those_of_its_clip(run, tmp_path):
    without = drawn(run / "pointing.mcap", tmp_path / "without.rrd")
    assert "/picture" not in without
    assert UNRECORDED in value(without["/reason"], "TextDocument:text")[0]
    found = drawn(run / "pointing.mcap", tmp_path / "with.rrd", "--pictures", CLIP, "--width", 320)
    assert len(found["/picture"]) == DRAWN
    picture = cv2.imdecode(np.frombuffer(bytes(value(found["/picture"], "EncodedImage:blob")[0]), np.uint8), cv2.IMREAD_COLOR)
    assert picture.shape == (240, 320, 3)
    assert [row["seq"] for row in found["/picture"]] == [row["seq"] for row in columns(run / "run.rrd")["/picture"]]


@needs_rerun
@needs_chromium
def test_a_browser_shows_the_person_and_the_named_poi_and_asks_nobody_else(run, tmp_path):
    log = tmp_path / "log"
    argv = command(
        "deixis", "view", run / "pointing.mcap", "--site", SITE, "--pictures", CLIP, "--web", "--port", 0, "--rate", 2
    )
    with process(argv, log):
        url = wait_until(lambda: re.search(r"http://\S+", log.read_text()), "the page's address", 60.0, log).group()
        wait_until(lambda: "times drawn" in log.read_text(), "all is drawn", 60.0, log)
        with page(tmp_path, WINDOW, "--blink-settings=preferredColorScheme=0") as browser:
            browser.open(url)
            (look,) = wait_until(lambda: complete(browser, tmp_path / "page.png"), "person and answer are shown", LOADED_S)
            assert {host.rsplit(":", 1)[0] for host in browser.hosts} == {"127.0.0.1"}
    assert_ring_is_where_the_poi_stands(look)


def complete(browser, kept):
    """What the page shows, once that is all, as a list of one."""
    browser.wait(2.0)
    look = browser.look()
    cv2.imwrite(str(kept), look)  # for who wants to know why it failed
    return [look] if len(ring(look)) and shows(look, last_person()) else []


@cache
def last_person():
    """The person in the clip's last frame, grey."""
    capture, frame = cv2.VideoCapture(str(CLIP)), None
    while (read := capture.read())[0]:
        frame = read[1]
    return cv2.cvtColor(frame[60:300, 220:420], cv2.COLOR_BGR2GRAY)


def shows(look, person):
    """Whether the person stands in the left part of the page, at about the size that the picture has there."""
    width = look.shape[1]
    left = cv2.cvtColor(look[:, : width * 5 // 12], cv2.COLOR_BGR2GRAY)
    best = 0.0
    for shown_width in range(width * 28 // 100, width * 42 // 100, 4):
        by = shown_width / 640
        template = cv2.resize(person, None, fx=by, fy=by, interpolation=cv2.INTER_AREA)
        best = max(best, cv2.matchTemplate(left, template, cv2.TM_CCOEFF_NORMED).max())
    return best > 0.7  # labels lie over it


def map_part(look):
    """The map's part of the page, and where it begins."""
    height, width = look.shape[:2]
    return look[: height * 6 // 10, width * 42 // 100 : width * 74 // 100]


def pixels_of(look, colour):
    return np.argwhere((np.abs(look.astype(int) - np.array(colour[::-1])) < 12).all(axis=2))


def ring(look):
    return pixels_of(map_part(look), colours.FULL_BELIEF)


def assert_ring_is_where_the_poi_stands(look):
    """As measured from the robot by its field of view, whose size is known; labels hide parts of both, but not their tops."""
    place = load_site(SITE).pois[2].position_m
    matrix = yaml.safe_load((SITE.parent / "pointing_camera.yaml").read_text())["camera_matrix"]["data"]
    half = np.arctan(320 / matrix[0])
    edges, round_it = pixels_of(map_part(look), colours.ROBOT), ring(look)
    (top, left), right = edges.min(axis=0), edges[:, 1].max()
    metre_px = (right - left) / 2 / (FIELD_OF_VIEW_M * np.sin(half))
    robot = np.array([(left + right) / 2, top + FIELD_OF_VIEW_M * np.cos(half) * metre_px])
    (top, left), right = round_it.min(axis=0), round_it[:, 1].max()
    centre = np.array([(left + right) / 2, top + (right - left) / 2])
    away_m = (centre - robot) / metre_px
    assert np.allclose(away_m, shown(*place[:2]), atol=0.3), away_m


@contextmanager
def camera_only(tmp_path, port, count):
    for index in range(count):
        cv2.imwrite(str(tmp_path / f"{index:03}.png"), np.full((480, 640, 3), index, np.uint8))
    sets = {"camera": (f"source={tmp_path}", "rate_hz=30")}
    yield HostOptions(robot="test-stuck", stages=("camera",), listen=(f"tcp/127.0.0.1:{port}",), sets=sets)


def test_a_viewer_that_is_stuck_costs_the_run_no_frame_and_no_time(tmp_path, free_port):
    sink, feed, heard = StuckSink(), Feed(), []

    @contextmanager
    def stuck(session):
        painter = Painter(Scene(Known()), sink)
        with Drawer(feed, painter, end_s=0.1), hear(session, keys_of("test-stuck", pictures=True), feed):
            yield

    with camera_only(tmp_path, free_port, 90) as options:
        result = play(options, beside=stuck, on_message=lambda _, message: heard.append(message), timeout_s=60)
    assert result.failure is None
    assert sink.entered.is_set()
    assert sink.drawn == 0
    assert result.camera.last_seq == 89
    assert result.counters["lost"] == 0
    stamps = [message.stamp_ns for message in heard if type(message).__name__ == "Frame"]
    assert (stamps[-1] - stamps[0]) / 1e9 < 3.6  # 90 frames at 30 a second
    assert feed.left_out >= 30  # of a second before it is stuck nothing, and the newest 16 are held
    sink.let_go.set()


@needs_rerun
def test_a_viewer_that_is_stopped_is_left_out_and_takes_part_again_when_it_goes_on():
    from deixis_view.rerun_sink import RerunSink
    from deixis_view.viewer_process import ViewerProcess

    picture = Picture(os.urandom(200_000))

    def draw(sink, number):
        return sink.draw(Shot(number * 10**8, number, [Drawing("picture", picture)]))

    with ViewerProcess(window=False) as viewer:
        sink = RerunSink(name="test", live=True).to_viewer(viewer.url)
        sink.lay_out(Layout((0, 0, 1, 1), None, live=True))
        assert all(draw(sink, number) for number in range(20))
        os.killpg(viewer.pid, signal.SIGSTOP)
        try:
            wait_until(lambda: not draw(sink, 20), "the viewer is left out", 30.0)
            before_kb = rss_kb()
            assert not any(draw(sink, number) for number in range(21, 300))
            assert rss_kb() - before_kb < 8_000  # of 56 MB that went undrawn
        finally:
            os.killpg(viewer.pid, signal.SIGCONT)
        wait_until(lambda: draw(sink, 300), "the viewer takes part again", 30.0)
        assert sink.left_out >= 280
        assert sink.close()


@needs_rerun
def test_a_viewer_that_is_killed_is_said_in_one_sentence(run, tmp_path):
    log = tmp_path / "log"
    with process(command("deixis", "view", run / "pointing.mcap", "--web", "--port", 0), log) as child:
        wait_until(lambda: "times drawn" in log.read_text(), "it is drawn", LOADED_S, log)
        (viewer,) = children(child.pid)
        os.kill(viewer, signal.SIGKILL)
        assert child.wait(30) == 1
    _address, _drawn, *said = log.read_text().splitlines()
    assert said == ["deixis: Rerun's viewer was ended by signal 9 (Killed)"]


@needs_rerun
def test_the_viewer_ends_with_a_command_that_is_killed(run, tmp_path):
    log = tmp_path / "log"
    with process(command("deixis", "view", run / "pointing.mcap", "--web", "--port", 0), log) as child:
        wait_until(lambda: "times drawn" in log.read_text(), "it is drawn", LOADED_S, log)
        (viewer,) = children(child.pid)
        child.kill()
    wait_until(lambda: not alive(viewer), "the viewer is gone", 10.0)


def alive(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def rss_kb():
    with open("/proc/self/status") as file:
        return int(re.search(r"VmRSS:\s+(\d+)", file.read()).group(1))


def test_it_says_what_is_missing(tmp_path, capsys, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)

    def said(*arguments):
        assert main([str(argument) for argument in arguments]) == 1
        return capsys.readouterr().err

    assert "--robot" in said("view", "--web")
    assert "--web" in said("view", "--robot", "r1")  # there is no display
    both = said("view", "a.mcap", "--robot", "r1", "--web")
    assert both == "deixis: --robot r1 goes with a running system: 'a.mcap' says itself whose it is\n"
    assert ".rrd" in said("run", CLIP, "--view", tmp_path / "clip.mp4")
    assert not (tmp_path / "clip.mp4").exists()
    monkeypatch.setattr("deixis_view.installed.find_spec", lambda _: None)
    assert "make rerun" in said("view", "--robot", "r1", "--out", tmp_path / "out.rrd")


@needs_rerun
def test_a_recording_that_cannot_be_read_costs_no_file_and_opens_no_page(tmp_path, capsys):
    out, nothing, words = tmp_path / "out.rrd", tmp_path / "nothing.mcap", tmp_path / "words.mcap"
    out.write_bytes(b"drawn before")
    words.write_text("no recording")
    for recording, cause in ((nothing, "No such file"), (words, "no MCAP file")):
        assert main(["view", str(recording), "--out", str(out)]) == 1
        assert cause in capsys.readouterr().err
        assert main(["view", str(recording), "--web", "--port", "0"]) == 1
        assert capsys.readouterr().out == ""
    assert out.read_bytes() == b"drawn before"


@needs_rerun
def test_a_view_that_is_refused_leaves_the_file_that_was_there_and_makes_no_new_one(run, tmp_path, capsys):
    clip, out, fresh = tmp_path / "small.avi", tmp_path / "out.rrd", tmp_path / "fresh" / "out.rrd"
    writer = cv2.VideoWriter(str(clip), cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (320, 240))
    writer.write(np.zeros((240, 320, 3), np.uint8))
    writer.release()
    out.write_bytes(b"drawn before")
    for path in (out, fresh):
        assert main(["view", str(run / "pointing.mcap"), "--pictures", str(clip), "--out", str(path)]) == 1
        assert "is 320 x 240, but the recording was made of 640 x 480" in capsys.readouterr().err
    assert out.read_bytes() == b"drawn before"
    assert list(fresh.parent.iterdir()) == []
    assert {path.name for path in tmp_path.iterdir()} == {"fresh", "out.rrd", "small.avi"}


@needs_rerun
def test_a_run_that_does_not_start_leaves_the_drawing_that_was_there(tmp_path):
    out = tmp_path / "out.rrd"
    out.write_bytes(b"drawn before")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        listen = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        argv = command("deixis", "run", CLIP, "--robot", "test-none", "--listen", listen, "--view", out)
        done = subprocess.run(argv, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1, done.stderr
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("out.rrd", b"drawn before")]


@needs_rerun
def test_a_port_that_is_taken_is_said_in_one_line_and_no_viewer_is_started(run, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("deixis_view.viewer_process.ViewerProcess._start", lambda _: pytest.fail("a viewer is started"))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", None)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["view", str(run / "pointing.mcap"), "--web", "--port", str(port)]) == 1
    said = capsys.readouterr()
    advice = "another viewer may be running there: --port N takes another port, 0 a free one"
    assert (said.out, said.err) == ("", f"deixis: --port {port}: Address already in use; {advice}\n")
    assert list(tmp_path.iterdir()) == []


@needs_rerun
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_view_that_is_killed_leaves_no_folder_or_the_next_removes_it(run, tmp_path, monkeypatch, number):
    monkeypatch.setenv("TMPDIR", str(tmp_path))

    def looked_at():
        log = tmp_path / f"log-{len(list(tmp_path.glob('log-*')))}"
        return process(command("deixis", "view", run / "pointing.mcap", "--web", "--port", 0), log), log

    def folders():
        return list(tmp_path.glob("deixis-view-*"))

    started, log = looked_at()
    with started as child:
        wait_until(lambda: "times drawn" in log.read_text(), "it is drawn", LOADED_S, log)
        (left,) = folders()
        child.send_signal(number)
        child.wait(30)
    assert folders() == ([] if number == signal.SIGTERM else [left])
    if folders():
        os.utime(left, (0, 0))  # one that was just made is let alone
    started, log = looked_at()
    with started:
        wait_until(lambda: "shows it to browsers" in log.read_text(), "the page's address", LOADED_S, log)
        (used,) = folders()
        assert used != left
        os.utime(used, (0, 0))
        remove_left(tmp_path)
        assert folders() == [used], "one that is used stays, however old"


@needs_rerun
def test_damage_deep_in_a_recording_is_said_in_one_line_and_what_comes_before_it_is_drawn(run, tmp_path, capsys):
    damaged, out = tmp_path / "damaged.mcap", tmp_path / "out.rrd"
    content = bytearray((run / "pointing.mcap").read_bytes())
    middle = len(content) // 2
    content[middle : middle + 64] = bytes(64)
    damaged.write_bytes(content)
    assert main(["view", str(damaged), "--site", str(SITE), "--out", str(out)]) == 1
    said = [line for line in capsys.readouterr().err.splitlines() if "damaged.mcap" in line]
    assert said[0].startswith(f"deixis view: '{damaged}' is damaged: ")
    assert said[0].endswith("; what comes before that is drawn")
    assert subprocess.run([BIN / "rerun", "rrd", "verify", out], capture_output=True, check=False).returncode == 0
    drawn_before = len({row["seq"] for row in columns(out)["/picture/tracks"]})
    assert 5 < drawn_before < DRAWN


@needs_rerun
def test_a_recording_that_was_cut_off_is_said_to_be_and_what_it_holds_is_drawn(run, tmp_path, capsys):
    cut, out = tmp_path / "cut.mcap", tmp_path / "out.rrd"
    content = (run / "pointing.mcap").read_bytes()
    cut.write_bytes(content[: len(content) // 2])
    assert main(["view", str(cut), "--site", str(SITE), "--out", str(out)]) == 0
    said = capsys.readouterr().err
    assert f"deixis view: '{cut}' was cut off while it was written; what it holds is used\n" in said
    assert 5 < len({row["seq"] for row in columns(out)["/picture/tracks"]}) < DRAWN


@needs_rerun
def test_what_runs_is_drawn_into_a_file_and_it_says_how_many_times_and_how_to_show_it(tmp_path, capsys):
    out = tmp_path / "live.rrd"
    with system(tmp_path, "test-live") as running:
        running.wait_until(lambda: running.state().get("sources"), "fusion")
        argv = ["view", "--robot", "test-live", "--connect", running.endpoint, "--out", str(out), "--seconds", "3"]
        assert main(argv) == 0
    times, shows = capsys.readouterr().err.splitlines()[-2:]
    assert int(re.fullmatch(r"robot test-live: (\d+) times drawn", times).group(1)) > 5
    assert shows == f"{out}: 'rerun {out}' shows it"
    assert len(columns(out)["/picture"]) > 5
