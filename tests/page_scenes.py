"""What runs while the pages' commands are tried, what cannot be tried as it stands, and what goes on until Ctrl-C."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from importlib.util import find_spec

BIN = ".venv/bin/"
PLAYED = "run examples/pointing.mp4 --site examples/pointing.yaml"
CLIP = "--set camera.source=examples/pointing.mp4 --set camera.loop=true"
SMALL = "--set camera.rate_hz=10 --set camera.max_width=320"
ELSEWHERE = "--listen tcp/127.0.0.1:7450"


@dataclass(frozen=True)
class Scene:
    """A machine with what runs on it. starts: lines of the pages that go on until Ctrl-C, each with the folder it is typed in.

    ready: a line that succeeds when all of it runs. serves: which lines are tried meanwhile, in the folder `at`.
    certificates: what is copied into each folder, as the pages have people do: by its name there, whose.
    """

    name: str
    starts: tuple[tuple[str, str], ...] = ()
    ready: str = ""
    serves: str = "(?!)"
    at: str = "here"
    certificates: dict[str, dict[str, str]] = field(default_factory=dict)


def _two(edge: str, robot: str) -> tuple[tuple[str, str], ...]:
    return ("edge", edge), ("robot", robot)


ROBOT_AND_EDGE = {"edge": {"certs": "edge-pc"}, "robot": {"certs": "robot-r1"}, "here": {"certs": "editor-me"}}
ASK_R1 = "deixis status --robot r1 --connect tls/edge:7447 --certs certs"

SCENES = (
    Scene(
        "the example, again and again",
        (("here", f"{BIN}deixis {PLAYED} --loop"),),
        ready="deixis status --robot demo",
        serves=r".*--robot demo\b.*|.* visit\.mcap .*",
    ),
    Scene(
        "a headpose stage of one's own",
        (
            ("here", f"{BIN}deixis {PLAYED} --loop --except headpose"),
            ("here", f"{BIN}python examples/swap_headpose.py --robot demo"),
        ),
        ready="deixis status --robot demo | grep headpose",
        # What another Zenoh client asks would be answered the same by the scene before, which takes longest as it is.
        serves=r"z .*",
    ),
    Scene(
        "a gesture stage of one's own",
        (
            ("here", f"{BIN}deixis {PLAYED} --loop --except gesture"),
            ("here", f"{BIN}python examples/own_gesture.py --robot demo"),
        ),
        ready="deixis status --robot demo | grep gesture",
    ),
    Scene(
        "robot and edge, as the README has them",
        _two(
            f"{BIN}deixis up --robot r1 --site examples/pointing.yaml --except camera --certs site/edge-pc "
            "--listen tls/0.0.0.0:7447",
            f"{BIN}deixis up --robot r1 --site examples/pointing.yaml --only camera --certs certs --connect tls/edge:7447 "
            "--set camera.source=0",
        ),
        ready=ASK_R1,
        certificates={**ROBOT_AND_EDGE, "edge": {"site/edge-pc": "edge-pc"}},
    ),
    Scene(
        "robot and edge, as deployed",
        _two(
            f"{BIN}deixis up --robot r1 --site examples/pointing.yaml --except camera --zenoh-config config/edge.json5 "
            "--certs edge-pc --listen tls/0.0.0.0:7447",
            f"{BIN}deixis up --robot r1 --site examples/pointing.yaml --only camera --zenoh-config config/robot.json5 "
            f"--certs robot-r1 --connect tls/edge:7447 {CLIP}",
        ),
        ready=ASK_R1.replace("certs certs", "certs me"),
        serves=r".*--certs (me|editor-me|edge-pc)( .*)?|.*calibrate site .*--from session.*|deixis doctor --robot r1 --camera",
        certificates={
            "edge": {"edge-pc": "edge-pc"},
            "robot": {"robot-r1": "robot-r1"},
            "here": {"me": "editor-me", "editor-me": "editor-me", "edge-pc": "edge-pc"},
        },
    ),
    Scene(
        "robot and edge, guarded",
        _two(
            "deixis up --robot r1 --site examples/pointing.yaml --except camera --certs certs --listen tls/0.0.0.0:7447",
            f"deixis up --robot r1 --site examples/pointing.yaml --only camera --certs certs --connect tls/edge:7447 {CLIP}",
        ),
        ready=ASK_R1,
        serves=r".*--certs certs --connect tls/edge:7447",
        certificates=ROBOT_AND_EDGE,
    ),
    Scene(
        "frames that stay",
        _two(
            "deixis up --robot r1 --site SITE.yaml --only gesture,fusion --certs certs --listen tls/0.0.0.0:7447",
            "deixis up --robot r1 --site SITE.yaml --only camera,tracker,headpose --certs certs --connect tls/edge:7447",
        ),
        ready=ASK_R1,
        certificates=ROBOT_AND_EDGE,
    ),
    Scene(
        "two robots on one edge",
        (
            ("edge", "deixis up --robot r1 --site r1.yaml --except camera --certs certs --listen tls/0.0.0.0:7447"),
            ("edge", "deixis up --robot r2 --site r2.yaml --except camera --certs certs --listen tls/0.0.0.0:7448"),
            ("robot", "deixis up --robot r2 --site r2.yaml --only camera --certs certs --connect tls/edge:7448"),
        ),
        ready="deixis status --robot r2 --connect tls/edge:7448 --certs certs",
        serves=r".*--robot r2 .*",
        certificates={**ROBOT_AND_EDGE, "robot": {"certs": "robot-r2"}},
    ),
    Scene(
        "fusion alone",
        (("here", f"{BIN}deixis up --robot r1 --site examples/pointing.yaml --only fusion"),),
        ready="deixis poi list --robot r1",
        serves=r".*deixis poi edit --robot r1 .*|deixis-camera .*|deixis-headpose .*",
    ),
    Scene(
        "all but the camera, for ROS's",
        (("here", f"{BIN}deixis up --robot r1 --site SITE.yaml --except camera --listen tcp/127.0.0.1:7448"),),
        ready="deixis poi list --robot r1 --connect tcp/127.0.0.1:7448",
        serves=r"deixis doctor --robot r1 --connect tcp/127.0.0.1:7448",
    ),
)
ALONE = Scene("nothing", certificates={"here": {"edge-pc": "edge-pc"}})

# Where a line is not tried word for word: what is said, what is done, and why.
ADAPTED = (
    (r"--set camera\.source=0", CLIP, "no camera is plugged in: the clip stands for it"),
    (r"--source 0", "--source examples/pointing.mp4", "no camera is plugged in"),
    (r"--set source=0", "--set source=examples/pointing.mp4", "no camera is plugged in"),
    (
        r"SOURCE=0",
        "SOURCE=pictures",
        "no camera is plugged in; a folder of pictures is played as one, and costs less than the clip",
    ),
    (r"(--only camera.* --connect tls/edge:\d+)", rf"\1 {ELSEWHERE}", "robot and edge share the machine, and its port 7447"),
    (r"(doctor --robot r1 --camera)", r"\1 --connect tcp/127.0.0.1:7450", "as above"),
    (
        r"(--loop( --except \w+)?$|--set camera\.loop=true)",
        rf"\1 {SMALL}",
        "what is asked needs no more, and leaves the processor for the asking",
    ),
    (r"--seconds (20|60)", "--seconds 3", "nobody waits so long"),
    (r"--trials 1000000", "--trials 2000", "a million take a minute"),
    (r"(init )site( --frames-stay)", r"\1another\2", "another site than that of the lines before"),
)

MINUTES = "takes minutes to hours; what it is made of is tested in small"
# Lines that are not run, and why. One that no line of a page matches fails the test.
EXCEPTIONS = (
    (r"make test", "it is what runs this"),
    (r"make setup", "it has made the environment that this runs in"),
    (r"make (guests|rerun|zenohd)", "downloads or builds hundreds of megabytes; tests of what needs them skip without"),
    (r"make view", "needs a display; with WEB=1 it is run"),
    (r".*deixis view --robot demo --site examples/pointing\.yaml", "needs a display; with --web it is run"),
    (r"(.venv/bin/)?rerun .*", "needs a display; what is in the file is tested in test_view"),
    (r".*(LINEUP=|--lineup |/guests/mediapipe/).*", "needs 'make guests'; test_guests_mediapipe runs them"),
    (r"cargo build.*|.*gesture_rust.*", "needs cargo and its index; test_gesture_rust builds and runs it"),
    (r".*docker compose.*|sudo chown.*", "needs docker and images; test_compose builds and runs them"),
    (r"sudo apt .*", "installs packages of the system"),
    (r"sudo .*/opt/deixis.*", "installs into the system; test_systemd has such an environment and runs it"),
    (
        r"install .*|cp -[rn] .*/etc/.*|mkdir -p /etc/deixis|systemd-sysusers|(sudo )?systemctl .*|journalctl .*",
        "needs systemd; test_systemd runs these blocks in a machine that has it",
    ),
    (r"zenohd .*", "needs a stock zenohd; test_zenohd_access runs it with such a file"),
    (r"ros2 .*|RMW_IMPLEMENTATION=.*|ln -s .*deixis_msgs.*|cd ~/ws.*", "needs ROS"),
    (r".*deixis-ros2(-camera)? .*", "needs ROS; test_ros2 runs it beside what speaks as ROS does"),
    (r"ssh .*", "needs another host"),
    (r".*rtsp://.*", "needs a camera on the network; test_camera_rtsp has one"),
    (r".*--instance NAME", "needs a process that stands by; test_hot_swap has one"),
    (r"python3\.11 -m venv zenoh-cli.*|zenoh-cli/bin/pip .*", "needs a package index; test_zenoh_cli makes this environment"),
    (r".*bin/pip install .*", "needs a package index, and torch or belief libraries are large"),
    (r".*python (bench|fitting)/.*", MINUTES),
    (
        r".*deixis eval .*examples/clips.*",
        "scores all shipped clips, a minute on a busy machine; test_evaluation_command and test_evaluation_stage score some",
    ),
    (r".*deixis eval (?!.*examples/clips).*", MINUTES),
    (r".*deixis rehearse --site my_site\.yaml", f"{MINUTES}; with --plan it is run"),
    (r".*deixis simulate .*", MINUTES),
    (r"make references", MINUTES),
)
WORD_FOR_WORD = {"docs/tutorial.md": "test_tutorial"}
"""Pages that a test of their own runs from beginning to end."""


@dataclass(frozen=True)
class GoesOn:
    """A command that ends on Ctrl-C: what it says once it does its work, what is typed to it, what it ends with.

    prompt: a line that gives it something to say.
    """

    line: str
    says: str
    statuses: tuple[int, ...] = (0, 130)
    typed: str = ""
    prompt: str = ""


GOING_ON = (
    GoesOn(r".*deixis watch .*", r"points? "),
    GoesOn(r".*deixis swap .*--command .*", r"runs here until Ctrl-C"),
    GoesOn(r".*deixis view .*--web.*", r"shows it to browsers"),
    GoesOn(r"make view WEB=1", r"shows it to browsers[^$]*[1-9]\d* times drawn", (0, 130, -2)),
    GoesOn(r".*deixis poi edit .*", r"http://127\.0\.0\.1:\d+"),
    GoesOn(r"deixis-camera .*--set (source=|quality).*", r"streaming"),
    GoesOn(r"deixis-headpose .*", r"ready as"),
    # A subscription of zenoh-cli knows no good end.
    GoesOn(
        r"z subscribe .*poi.*",
        r"vase2",
        (0, 1, 130),
        prompt="z put -k deixis/demo/fusion/poi/vase2 -v '{\"position_m\": [3, 1, 1.2]}'",
    ),
    GoesOn(r"z subscribe .*", r"run", (0, 1, 130)),
    GoesOn(r"deixis calibrate camera --robot .*", r"board|Ctrl-C", (1,)),
    GoesOn(r"deixis calibrate site .*--stand.*", r"thank you", (130,), typed="\n"),
)

# Statuses that are no fault where the command says so, and why.
STATUSES = (
    (r".*deixis doctor .*", 1, r"WRONG", "a busy machine is slow, a camera that is a file is none, and doctor says so"),
    (
        r".*deixis calibrate site .*--from.*",
        3,
        r"the mount cannot be judged|P3 +told apart",
        "the clip that stands for a person points at P3, whatever is asked; a slow machine hears several of its pointings",
    ),
    (r"make demo", 2, r"this machine is too slow or too busy", "it plays in real time"),
)


@dataclass(frozen=True)
class Need:
    """What not every machine has: lines that need it, and why it is not here; empty where it is."""

    line: str
    why_not: str


NEEDS = (
    Need(
        r".*deixis view .*|.*--view .*|make view WEB=1",
        "" if find_spec("rerun") is not None else "Rerun is not installed here (make rerun)",
    ),
)


def matches(pattern: str, line: str) -> bool:
    """Whether the pattern is that of the whole line."""
    return re.fullmatch(pattern, line) is not None
