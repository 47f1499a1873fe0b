"""The units as docs/deployment.md installs them, run by systemd: robot and edge on one host."""

import json
import re
import subprocess
import time
from contextlib import contextmanager

import pytest
from running import CLIP, POINTED_AT, ROOT, SITE, wait_until
from site_made import add, make_site
from systemd_host import CHECKOUT, UNIT_PATH, SystemdHost, missing_for_systemd_host

WHY_NOT = missing_for_systemd_host()
pytestmark = [pytest.mark.slow, pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT)]

STAGES = ("camera", "tracker", "headpose", "gesture", "fusion")
WATCHMAN = "deixis-watchman.service"
UNITS = ("deixis-router.service", WATCHMAN, *(f"deixis@{stage}.service" for stage in STAGES))
TARGETS = ("deixis-robot.target", "deixis-edge.target")
SOCKET = "unixsock-stream//run/deixis/router.sock"
PATIENCE_S = 60.0
AGAIN_S = 2.0
IMPORTS_S = 0.7
ROBOT = "r1"
GUARDED = "tls/127.0.0.1:7448"
ONE_MACHINE = "--config /etc/deixis/one_machine.json5 --listen tcp/127.0.0.1:7447"


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    """Both targets started, on the example clip played again and again."""
    with SystemdHost(tmp_path_factory.mktemp("systemd")) as made:
        made.run(["sh", "-euc", f"cd /checkout\n{commands_with('systemd-sysusers')}"])
        settings = (ROOT / "systemd" / "deixis.env").read_text().replace("DEIXIS_ROBOT=\n", f"DEIXIS_ROBOT={ROBOT}\n")
        assert f"DEIXIS_ROBOT={ROBOT}" in settings
        # In lockstep, so that a busy machine plays the clip slowly and drops nothing.
        settings = settings.replace("/etc/deixis/site.yaml", f"{on_host(SITE)} --lockstep")
        assert ONE_MACHINE in settings
        settings = settings.replace(ONE_MACHINE, f"--config /etc/deixis/edge.json5 --listen {GUARDED}")
        (made.share / "deixis.env").write_text(f"{settings}\nDEIXIS_CERTS=/etc/deixis/certs\n")
        (made.share / "camera.env").write_text(f'DEIXIS_STAGE_OPTIONS="--set source={on_host(CLIP)} --set loop=true"\n')
        site = make_site(made.share / "site")
        add(site, "edge:pc", "127.0.0.1")
        add(site, "viewer:anna")
        made.run(["sh", "-euc", "cd /share/site\n" + commands_with("/etc/deixis/certs/").replace("robot-r1", "edge-pc")])
        made.run(["cp", "/share/deixis.env", "/share/camera.env", "/etc/deixis/"])
        made.run(["systemctl", "start", *TARGETS])
        yield made


def commands_with(word):
    """The block of the page in which the word stands, word for word."""
    page = (ROOT / "docs" / "deployment.md").read_text()
    (block,) = [block for block in re.findall(r"```sh\n(.*?)```", page, re.DOTALL) if word in block]
    return block


def on_host(path):
    """Where the host has a file of the checkout."""
    return f"{CHECKOUT}/{path.relative_to(ROOT)}"


def deixis(host, *arguments, check=True):
    return host.run(["deixis", *arguments, "--robot", ROBOT, "--connect", SOCKET], check=check)


def names_the_poi(host):
    answer = deixis(host, "watch", "--until-answer", "--expect", POINTED_AT, "--seconds", "30", check=False)
    return answer.returncode == 0 and f"({POINTED_AT})" in answer.stdout


def send(host, signal, unit):
    """Send a signal to the unit's own process."""
    host.run(["systemctl", "kill", "--kill-whom=main", f"--signal={signal}", unit])


def main_pid(host, unit):
    """Process number, as the host counts them; 0 while the unit does not run."""
    ready = host.show(unit, "SubState") == "running"
    return int(host.show(unit, "MainPID")) if ready else 0


def restarts(host, unit):
    return int(host.show(unit, "NRestarts"))


def shared_segments(host, unit):
    """Shared memory that the unit's process has mapped."""
    maps = host.run(["cat", f"/proc/{main_pid(host, unit)}/maps"]).stdout
    return set(re.findall(r"/dev/shm/\S+", maps))


def test_systemd_finds_no_fault_in_the_units(host):
    files = [f"/etc/systemd/system/{name}" for name in ("deixis-router.service", *TARGETS)]  # and with the targets all stages
    done = host.run(["env", f"SYSTEMD_UNIT_PATH={UNIT_PATH}", "systemd-analyze", "verify", "--man=no", *files], check=False)
    ours = [line for line in (done.stdout + done.stderr).splitlines() if "deixis" in line]
    assert ours == []


def test_the_poi_is_named(host):
    wait_until(lambda: names_the_poi(host), f"{POINTED_AT} is named", PATIENCE_S, host.log)
    assert {host.show(unit, "ActiveState") for unit in UNITS} == {"active"}
    assert "/var/lib/deixis/r1/pointing-" in host.run(["sh", "-c", "ls /var/lib/deixis/r1/*.sqlite"]).stdout


def test_the_units_run_without_privileges_network_or_a_root_to_write_to(host):
    own = host.run(["readlink", "/proc/1/ns/net"]).stdout
    for unit in UNITS:
        pid = main_pid(host, unit)
        status = dict(line.split(":\t", 1) for line in host.run(["cat", f"/proc/{pid}/status"]).stdout.splitlines())
        assert status["Uid"].split()[0] != "0"
        assert status["NoNewPrivs"] == "1"
        assert int(status["CapBnd"], 16) == 0
        assert int(status["Seccomp"]) == 2
        assert (host.run(["readlink", f"/proc/{pid}/ns/net"]).stdout == own) is (unit == "deixis-router.service"), unit
        inside = ["nsenter", "-t", pid, "-m", "-S", status["Uid"].split()[0], "--"]
        refused = host.run([*inside, "touch", "/var/lib/x", "/etc/x"], check=False)
        assert refused.stderr.count("Read-only file system") == 2, unit


def test_another_host_comes_by_mutual_tls(host):
    """By the certificate of a viewer, through the listener that faces the network."""
    argv = ["deixis", "status", "--robot", ROBOT, "--connect", GUARDED]
    status = host.run([*argv, "--certs", "/share/site/viewer-anna"])
    assert all(stage in status.stdout for stage in STAGES)
    refused = host.run(argv, check=False)
    assert refused.returncode == 1
    assert "TLS needs a certificate" in refused.stderr


def test_memory_is_limited(host):
    limits = {unit: int(host.show(unit, "MemoryMax")) // 2**20 for unit in UNITS}
    assert limits == {unit: {"deixis-router.service": 256, WATCHMAN: 64}.get(unit, 512) for unit in UNITS}


def test_a_killed_stage_and_a_stopped_one_are_started_again_and_the_poi_is_named_again(host):
    tracker, headpose = "deixis@tracker.service", "deixis@headpose.service"
    before = {unit: (main_pid(host, unit), restarts(host, unit)) for unit in UNITS}
    send(host, "KILL", tracker)
    send(host, "STOP", headpose)
    for unit in (tracker, headpose):
        old = before[unit][0]
        wait_until(lambda unit=unit, old=old: main_pid(host, unit) not in (0, old), f"{unit} is again", PATIENCE_S, host.log)
    assert {unit for unit in UNITS if restarts(host, unit) > before[unit][1]} == {tracker, headpose}
    wait_for_an_answer(host)


@pytest.mark.parametrize("signal", ["KILL", "STOP"])
@pytest.mark.parametrize("stage", ["headpose", "tracker"])
def test_a_dead_and_a_hung_stage_are_heard_again_within_two_seconds(host, stage, signal):
    """Of three times the quickest counts. Where other work makes imports slow, it has so much more."""
    unit, times = f"deixis@{stage}.service", []
    host.run(["systemctl", "reset-failed", unit])  # its starts are counted, and these are no fault
    more_s = max(0.0, imports_s(host, stage) - IMPORTS_S)
    with first_words(host, stage) as heard:
        while not times or (min(times)[0] >= AGAIN_S + more_s and len(times) < 3):
            times.append(heard_again(host, unit, signal, heard))
    print(f"{stage}, {signal}: heard again, started again after {times}; {more_s:.2f} s more for other work")
    assert min(times)[0] < AGAIN_S + more_s, host.log.read_text()[-3000:]


def imports_s(host, stage):
    """How long a start of that stage takes this machine now, as far as it is imports."""
    began_s = time.monotonic()
    host.run(["/opt/deixis/bin/python", "-c", f"import deixis_{stage}.service"])
    return time.monotonic() - began_s


@contextmanager
def first_words(host, stage):
    """Lines of `first_words.py` about a stage that is heard already."""
    argv = ["/opt/deixis/bin/python", f"{CHECKOUT}/tests/first_words.py", ROBOT, stage, SOCKET]
    with host.popen(argv, stdout=subprocess.PIPE, text=True) as listener:
        try:
            lines = (line.split() for line in listener.stdout)
            assert next(lines)[0] == "listening"
            next(lines)
            yield lines
        finally:
            host.run(["pkill", "-f", "first_words.py"])
            listener.stdout.close()
            listener.wait(10)


def heard_again(host, unit, signal, heard):
    """Seconds from the signal to the first message of the new process, and to its start."""
    at_s = time.monotonic()
    send(host, signal, unit)
    _, heard_s = next(heard)
    # The monotonic clock is the same in all namespaces.
    started_s = int(host.show(unit, "ExecMainStartTimestampMonotonic")) / 1e6
    return round(float(heard_s) - at_s, 2), round(started_s - at_s, 2)


@pytest.mark.parametrize("signal", ["KILL", "STOP"])
def test_a_watchman_that_is_gone_or_hangs_harms_nobody_and_the_next_one_finds_who_hangs(host, signal):
    others = [unit for unit in UNITS if unit != WATCHMAN]
    before, watchman = {unit: main_pid(host, unit) for unit in others}, main_pid(host, WATCHMAN)
    gesture = "deixis@gesture.service"
    host.run(["systemctl", "reset-failed", gesture])
    send(host, signal, WATCHMAN)
    wait_until(lambda: main_pid(host, WATCHMAN) not in (0, watchman), "another watchman", PATIENCE_S, host.log)
    assert {unit: main_pid(host, unit) for unit in others} == before
    wait_until(lambda: hears_of(host, gesture), "it hears of gesture", PATIENCE_S, host.log)
    send(host, "STOP", gesture)
    wait_until(lambda: main_pid(host, gesture) not in (0, before[gesture]), "gesture is again", PATIENCE_S, host.log)
    said = f"deixis-gesture (process {before[gesture]}) gave no sign that its loop runs for 0.8 s; killed"
    assert said in host.log.read_text()


def hears_of(host, unit):
    """Whether the watchman holds a handle on the unit's process: it does from the first sign on."""
    held = host.run(["sh", "-c", f"cat /proc/{main_pid(host, WATCHMAN)}/fdinfo/*"], check=False).stdout
    return f"Pid:\t{main_pid(host, unit)}\n" in held


def wait_for_an_answer(host):
    """Wait for a final answer that comes from now on, and is right."""
    argv = ["deixis", "watch", "--json", "--robot", ROBOT, "--connect", SOCKET, "--seconds", PATIENCE_S]
    with host.popen(argv, stdout=subprocess.PIPE, text=True) as watch:
        try:
            assert any(is_right(json.loads(line)) for line in watch.stdout), host.log.read_text()[-3000:]
        finally:
            host.run(["pkill", "-x", "deixis"])
            watch.stdout.close()
            watch.wait(10)  # it is nsenter, which ends with the command


def is_right(line):
    return line["type"] == "Target" and line["message"]["final"] and line["message"]["poi_ids"] == [POINTED_AT]


def test_live_stages_share_memory(host):
    host.run(["sed", "-i", "s/ --lockstep//", "/etc/deixis/deixis.env"])
    host.run(["systemctl", "restart", *UNITS[2:]])
    tracker, headpose = "deixis@tracker.service", "deixis@headpose.service"
    common = wait_until(
        lambda: shared_segments(host, tracker) & shared_segments(host, headpose), "frames", PATIENCE_S, host.log
    )
    assert common, "frames of the camera, mapped by both"


def test_wrong_settings_are_not_tried_again_and_the_reason_is_on_display(host):
    host.run(["sh", "-c", "echo 'DEIXIS_STAGE_OPTIONS=\"--set sauce=0\"' >/etc/deixis/camera.env"])
    host.run(["systemctl", "restart", "deixis@camera.service"], check=False)
    wait_until(lambda: host.show("deixis@camera.service", "ActiveState") == "failed", "given up", PATIENCE_S, host.log)
    assert host.show("deixis@camera.service", "ExecMainStatus") == "78"
    assert "sauce" in host.log.read_text()
    host.run(["cp", "/share/camera.env", "/etc/deixis/"])
    host.run(["systemctl", "start", "deixis@camera.service"])


def test_stopping_leaves_nothing(host):
    host.run(["systemctl", "stop", *TARGETS])
    # The command waits for the targets only; what they hold stops meanwhile.
    wait_until(lambda: {host.show(unit, "ActiveState") for unit in UNITS} == {"inactive"}, "all stop", 15, host.log)
    assert {host.show(unit, "Result") for unit in UNITS} == {"success"}
    assert host.commands() == []
    assert host.run(["ls", "-A", "/run/deixis"], check=False).returncode != 0, "the router's folder is gone"
    assert host.run(["find", "/dev/shm", "/tmp", "/var/tmp", "-type", "f"], check=False).stdout == ""
