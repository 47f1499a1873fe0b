"""The commands of README and pages are run as they stand, on machines on which nothing else runs but what the page has
running. Those that cannot be are in one table, with the reason, as is what is typed otherwise (page_scenes.py).
"""

import os
import re
import shutil
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import cache

import cv2
import pytest
from board_views import views
from deixis_calibration.boards import Board
from own_machine import OwnMachine, missing_for_own_machine
from page_commands import PAGES, blocks, commands
from page_scenes import (
    ADAPTED,
    ALONE,
    EXCEPTIONS,
    GOING_ON,
    NEEDS,
    SCENES,
    STATUSES,
    WORD_FOR_WORD,
    matches,
)  # fmt: skip
from running import ROOT
from site_made import add, make_site

ENDS_S, READY_S, STOPS_S = 120.0, 60.0, 30.0
AT_ONCE = 3
"""Machines that run beside each other: most of the time is waiting."""
COPIED = ("README.md", "Makefile", "mkdocs.yml", "docs", "examples", "schemas")
ALL = commands()
ALIAS = next(command.line for command in ALL if command.line.startswith("alias z="))


def plain(line):
    """A line without the folder of the program and without `&`: pages differ in these."""
    return line.removeprefix(".venv/bin/").removesuffix("&").strip()


def scene_of(line):
    """Where a line is tried: where it starts something, else at the first scene that serves it, else alone."""
    starting = (scene for scene in SCENES if plain(line) in {plain(start) for _, start in scene.starts})
    serving = (scene for scene in SCENES if matches(scene.serves, line))
    return next(starting, None) or next(serving, ALONE)


def tried():
    """What is to be run."""
    whole = set(WORD_FOR_WORD)
    return [one for one in ALL if one.page not in whole and not any(matches(pattern, one.line) for pattern, _ in EXCEPTIONS)]


class Machine:
    """A machine with a scene's folders, and somebody who types there. faults: of what did not go as the pages say."""

    def __init__(self, scene, folder, site):
        self.scene, self.folder, self.faults = scene, folder, []
        folder.mkdir()
        for name in {scene.at, *(at for at, _ in scene.starts)}:
            checkout(folder / name)
            for link, member in scene.certificates.get(name, {}).items():
                (folder / name / link).parent.mkdir(exist_ok=True)
                (folder / name / link).symlink_to(site / member)

    def play(self, lines):
        """Start the scene, try the lines, stop it; all faults."""
        with ExitStack() as stack:
            self._machine = stack.enter_context(OwnMachine(self.folder, ["edge"]))
            try:
                for number, (at, line) in enumerate(self.scene.starts):
                    if number and at == self.scene.starts[0][0]:
                        self._until("</dev/tcp/127.0.0.1/7447")  # "in another terminal", later
                    stack.enter_context(self._started(at, line))
                if self.scene.ready:
                    self._until(self.scene.ready)
                for one in lines:
                    self._try(one)
            except AssertionError as error:
                self.faults.append(str(error))
        return self.faults

    def _popen(self, at, line, **how):
        argv = self._machine.argv(self.folder / at, f"shopt -s expand_aliases\n{ALIAS}\n{done(line)}")
        environment = {
            name: value for name, value in os.environ.items() if name not in {"DISPLAY", "WAYLAND_DISPLAY", "DEIXIS_CERTS"}
        }
        environment |= {"HOME": str(self.folder), "XDG_STATE_HOME": str(self.folder / at / "state"), "COLUMNS": "160"}
        environment["PATH"] = f"{self.folder / at / '.venv' / 'bin'}:{environment['PATH']}"
        return subprocess.Popen(argv, env=environment, text=True, start_new_session=True, **how)

    @contextmanager
    def _started(self, at, line):
        """Something that goes on, and ends in good order on Ctrl-C."""
        log = self.folder / f"{len(list(self.folder.glob('*.log')))}.log"
        with log.open("w") as out:
            child = self._popen(at, plain(line), stdin=subprocess.DEVNULL, stdout=out, stderr=out)
        try:
            yield
        finally:
            status = interrupted(child)
            if status not in (0, 130):
                self.faults.append(f"{line}\nended with {status}: {log.read_text()[-1500:]}")

    def _until(self, line):
        deadline_s = time.monotonic() + READY_S
        while True:
            child = self._popen(self.scene.at, line, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
            said, _ = child.communicate(timeout=ENDS_S)
            if child.returncode == 0:
                return
            logs = "\n".join(log.read_text()[-800:] for log in sorted(self.folder.glob("*.log")))
            time.sleep(0.1)
            assert time.monotonic() < deadline_s, f"{line}\nnever succeeds: {said[-500:]}\n{logs}"

    def _try(self, one):
        going = next((going for going in GOING_ON if matches(going.line, one.line)), None)
        began_s = time.monotonic()
        fault = self._ends(one.line) if going is None else self._goes_on(one.line, going)
        print(f"{time.monotonic() - began_s:5.1f} s  {one}", flush=True)
        if fault:
            self.faults.append(f"{one}\n{fault}")

    def _ends(self, line):
        child = self._popen(self.scene.at, line, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        try:
            said, _ = child.communicate(timeout=ENDS_S)
        except subprocess.TimeoutExpired:
            killed(child)
            return f"does not end within {ENDS_S:.0f} s; if it is not meant to, say so in GOING_ON"
        excuses = [says for pattern, status, says, _ in STATUSES if matches(pattern, line) and status == child.returncode]
        if child.returncode and not any(re.search(says, said) for says in excuses):
            return f"ended with {child.returncode}: {said[-1500:]}"
        # zenoh-cli ends with 0 whatever is answered.
        return said if line.startswith("z ") and ("ERROR" in said) != ('"far"' in line) else ""

    def _goes_on(self, line, going):
        log = self.folder / "said"
        with log.open("w") as out:
            child = self._popen(self.scene.at, line, stdin=subprocess.PIPE, stdout=out, stderr=out)
        with suppress(BrokenPipeError):
            child.stdin.write(going.typed)
            child.stdin.flush()
        deadline_s = time.monotonic() + ENDS_S
        while (
            not re.search(going.says, log.read_text(errors="replace"))
            and child.poll() is None
            and time.monotonic() < deadline_s
        ):
            if going.prompt:
                self._ends(going.prompt)
            time.sleep(0.05)
        status, said = interrupted(child), log.read_text(errors="replace")
        child.stdin.close()
        if not re.search(going.says, said):
            return f"does not say {going.says!r}: {said[-1500:]}"
        return "" if status in going.statuses else f"ended with {status} on Ctrl-C: {said[-1500:]}"


def checkout(folder):
    """The project, as who has just got it has it, and the files of a user's own that pages speak of."""
    folder.mkdir(exist_ok=True)
    for path in ROOT.iterdir():
        if path.name in COPIED:
            copy = shutil.copytree if path.is_dir() else shutil.copy2
            copy(path, folder / path.name)
        elif path.name not in {".git", "out", "build", "dist"}:
            (folder / path.name).symlink_to(path)
    text = (ROOT / "examples" / "pointing.yaml").read_text()
    (folder / "my_site.yaml").write_text(text)
    with_camera = text.replace("camera:", "camera:\n  source: clip.mp4\n  loop: true", 1)
    for site in ("SITE.yaml", "r1.yaml", "r2.yaml"):
        (folder / site).write_text(with_camera)
    (folder / "lab.yaml").write_text("camera: {source: clip.mp4, loop: true}\n")
    shutil.copy(ROOT / "examples" / "pointing_camera.yaml", folder)
    shutil.copy(ROOT / "examples" / "pointing.mp4", folder / "clip.mp4")
    (folder / "zenoh-cli").symlink_to(ROOT / ".venv")
    (folder / "pictures").mkdir()
    for number, picture in enumerate(pictures_of_a_board()):
        (folder / "pictures" / f"{number}.png").write_bytes(picture)


def done(line):
    """What is typed in the place of what a page says."""
    for said, instead, _ in ADAPTED:
        line = re.sub(said, instead, line)
    return line


def interrupted(child):
    """The status after Ctrl-C, which the terminal gives to all that it runs."""
    if child.poll() is None:
        os.killpg(child.pid, signal.SIGINT)
    try:
        return child.wait(STOPS_S)
    except subprocess.TimeoutExpired:
        killed(child)
        return child.wait()


def killed(child):
    with suppress(ProcessLookupError):
        os.killpg(child.pid, signal.SIGKILL)
    child.wait()


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """Faults by the name of the scene."""
    if why := missing_for_own_machine():
        pytest.skip(why)
    folder = tmp_path_factory.mktemp("pages")
    site = make_site(folder / "site")
    for member in ("robot:r1", "robot:r2", "editor:me"):
        add(site, member)
    add(site, "edge:pc", "edge")
    left = [one for one in tried() if not any(matches(need.line, one.line) for need in NEEDS if need.why_not)]
    with ThreadPoolExecutor(AT_ONCE) as pool:
        faults = {}
        for name, scene, lines in sorted(shows(left), key=lambda show: -len(show[2])):  # that which takes longest first
            machine = Machine(scene, folder / str(len(faults)), folder / "site")
            faults[name] = pool.submit(machine.play, lines)
        return {name: future.result() for name, future in faults.items()}


def shows(left):
    """Each scene with the lines that are tried in it; alone those of each page by themselves."""
    for scene in SCENES:
        starts = {plain(line) for _, line in scene.starts}
        yield scene.name, scene, [one for one in left if scene_of(one.line) is scene and plain(one.line) not in starts]
    alone = [one for one in left if scene_of(one.line) is ALONE]
    for page in dict.fromkeys(one.page for one in alone):
        yield page, ALONE, [one for one in alone if one.page == page]


SHOWS = [name for name, _, _ in shows(tried())]


@cache
def pictures_of_a_board():
    """As PNG files."""
    return [cv2.imencode(".png", picture)[1].tobytes() for picture in views(Board("charuco", 7, 5, 0.036, 0.027))]


@pytest.mark.parametrize("show", SHOWS)
def test_the_commands_do_what_the_pages_say(played, show):
    if show not in played:
        pytest.skip("this machine lacks what it needs")
    assert not played[show], "\n\n".join(played[show])


@pytest.mark.parametrize("need", NEEDS, ids=lambda need: need.line)
def test_what_a_machine_may_lack_is_needed_and_what_this_one_lacks_is_named(need):
    assert any(matches(need.line, one.line) for one in tried())
    if need.why_not:
        pytest.skip(need.why_not)


def test_a_block_says_what_it_is_so_that_no_command_hides_in_it():
    unnamed = {str(page.relative_to(ROOT)) for page in PAGES for language, _ in blocks(page) if not language}
    assert not unnamed


@pytest.mark.parametrize(
    "pattern",
    [*(pattern for pattern, _ in EXCEPTIONS), *(pattern for pattern, *_ in STATUSES), *(going.line for going in GOING_ON)],
)
def test_an_exception_is_one_of_a_line_on_a_page(pattern):
    assert any(matches(pattern, one.line) for one in ALL)


@pytest.mark.parametrize("said", [said for said, _, _ in ADAPTED])
def test_what_is_adapted_stands_on_a_page(said):
    assert any(re.search(said, one.line) for one in tried())


@pytest.mark.parametrize("scene", SCENES, ids=lambda scene: scene.name)
def test_what_a_scene_starts_stands_on_a_page(scene):
    assert {plain(line) for _, line in scene.starts} <= {plain(one.line) for one in ALL}


def test_most_commands_are_run():
    assert len(tried()) > 90


@pytest.mark.parametrize(("page", "test"), WORD_FOR_WORD.items())
def test_a_page_that_is_left_out_has_a_test_that_runs_it(page, test):
    assert f'"{page.split("/")[1]}"' in (ROOT / "tests" / "integration" / f"{test}.py").read_text()


@pytest.mark.parametrize("why", [why for _, why in EXCEPTIONS if "test_" in why])
def test_a_test_that_is_said_to_run_something_is_there(why):
    names = {path.stem for path in (ROOT / "tests").rglob("test_*.py")}
    assert set(re.findall(r"test_\w+", why)) <= names


SCRIPTS = [one for one in ALL if re.search(r"python (bench|fitting)/", one.line)]


@pytest.mark.parametrize("one", SCRIPTS, ids=str)
def test_a_script_that_takes_hours_is_there_and_knows_its_options(one):
    _, script, *arguments = one.line.split()
    text = (ROOT / script).read_text()
    unknown = [word for word in arguments if word.startswith("--") and f'"{word}"' not in text]
    assert not unknown
