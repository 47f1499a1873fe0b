"""A host with systemd as its first process, in namespaces of its own: for tests of what systemd runs.

Its root is made for the test: /usr, the checkout and Python of this machine, read-only; /etc, /var, /run, /dev and the network
are its own, and no unit of this machine's runs in it. Needs root, systemd and util-linux; boots in a second.

    with SystemdHost(folder) as host:
        host.run(["systemctl", "start", "some.service"])
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

from running import ROOT, children, tail, wait_until

SYSTEMD = Path("/lib/systemd/systemd")
CGROUPS = Path("/sys/fs/cgroup")
UNIT_PATH = "/etc/systemd/system:/units"
BOOT_S = 30.0
CHECKOUT, PYTHON, SHARE = "/checkout", "/opt/python", "/share"
# What units refer to without being asked; on a real host these mean more.
STUBS = ("sysinit", "basic", "shutdown", "network-online", "multi-user")
SERVICES = tuple(f"services/{name}" for name in ("camera", "tracker", "headpose", "gesture", "fusion"))
DISTRIBUTIONS = ("schemas", "runtime", "cli", *SERVICES)

# $1 the folder, $2 the checkout, $3 the prefix of Python, $4 where units are; then the cgroup file systems: the options of
# each, or `unified`.
BOOT = r"""
set -eu
folder=$1 checkout=$2 prefix=$3 units=$4
shift 4
mount --make-rprivate /
mount -t tmpfs -o mode=755 tmpfs "$folder/root"
cd "$folder/root"
mkdir -p proc sys dev run tmp etc/systemd/system var opt/python root usr checkout share units old
for name in bin sbin lib lib32 lib64; do
  if [ -L "/$name" ]; then cp -a "/$name" .; elif [ -d "/$name" ]; then mkdir "$name"; mount --bind "/$name" "$name"; fi
done
mount --bind /usr usr && mount -o remount,bind,ro usr
mount --bind "$checkout" checkout && mount -o remount,bind,ro checkout
mount --bind "$prefix" opt/python && mount -o remount,bind,ro opt/python
mount --bind "$folder/share" share
mount -t proc proc proc
mount -t sysfs sysfs sys
if [ "$1" = unified ]; then
  mount -t cgroup2 cgroup2 sys/fs/cgroup
else
  mount -t tmpfs -o mode=755 tmpfs sys/fs/cgroup
  for kind; do
    mkdir "sys/fs/cgroup/${kind##*=}"
    mount -t cgroup -o "$kind" cgroup "sys/fs/cgroup/${kind##*=}"
  done
fi
mount -t tmpfs -o mode=755 tmpfs dev
for device in null zero full random urandom tty; do
  touch "dev/$device"
  mount --bind "/dev/$device" "dev/$device"
done
ln -s /proc/self/fd dev/fd
ln -s pts/ptmx dev/ptmx
mkdir dev/shm dev/pts
mount -t tmpfs -o mode=1777 tmpfs dev/shm
mount -t devpts -o newinstance,ptmxmode=666 devpts dev/pts
mount -t tmpfs -o mode=755 tmpfs run
chmod 1777 tmp
cp -r "$folder/units/." units
cp -r "$folder/environment" opt/deixis
printf 'root:x:0:0:root:/root:/bin/sh\nnobody:x:65534:65534:nobody:/:/usr/sbin/nologin\n' >etc/passwd
printf 'root:x:0:\nvideo:x:44:\nnogroup:x:65534:\n' >etc/group
printf '%032x\n' 1 >etc/machine-id
printf 'NAME=test\nID=test\n' >etc/os-release
{ echo /opt/python/lib; cat /etc/ld.so.conf /etc/ld.so.conf.d/*.conf 2>/dev/null; } | grep -v '^include' >etc/ld.so.conf
pivot_root . old
umount -l /old
ldconfig
exec env -i container=test PATH=/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 SYSTEMD_UNIT_PATH="$units" \
  /lib/systemd/systemd --system --unit=basic.target --log-target=null
"""


def missing_for_systemd_host() -> str:
    """Why such a host cannot be made here; empty if it can."""
    if os.geteuid() != 0:
        return "a host with systemd needs root"
    if not SYSTEMD.exists():
        return "systemd is not installed"
    absent = [tool for tool in ("unshare", "nsenter", "pivot_root", "systemctl") if shutil.which(tool) is None]
    if absent:
        return f"a host with systemd needs {', '.join(absent)}"
    if not _cgroup_kinds():
        return "a host with systemd needs a cgroup hierarchy that it may make folders in"
    tried = subprocess.run(
        ["unshare", "-m", "-p", "-f", "-n", "-u", "-i", "-C", "true"], check=False, capture_output=True, text=True
    )
    return f"a host with systemd needs namespaces: {tried.stderr.strip()}" if tried.returncode else ""


class SystemdHost:
    """Use as a context manager. What its services print lies in `log`; `/share` in it is `share` here."""

    def __init__(self, folder: Path) -> None:
        self.share = folder / "share"
        self.log = self.share / "log"
        self._folder = folder
        self._cgroups = [cgroup / f"deixis-test-{os.getpid()}" for cgroup in _cgroup_kinds().values()]
        self._unshare: subprocess.Popen[bytes] | None = None
        self._pid = 0

    def __enter__(self) -> Self:
        for name in ("root", "share", "units"):
            (self._folder / name).mkdir()
        self.share.chmod(0o755)
        self.log.touch()
        self._write_units()
        write_environment(self._folder / "environment")
        try:
            self._boot()
        except BaseException:
            self._take_down()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._take_down()

    def command(self, argv: Sequence[object]) -> list[str]:
        """`argv` as it has to be started to run on the host, in its root folder."""
        return ["nsenter", "-t", str(self._pid), "-m", "-p", "-n", "-u", "-i", "--", "env", "-C", "/", *map(str, argv)]

    def run(self, argv: Sequence[object], check: bool = True, **options: Any) -> subprocess.CompletedProcess[str]:
        """Run a command on the host to its end. Fails with what it said where it fails and `check` is set."""
        done = subprocess.run(self.command(argv), check=False, capture_output=True, text=True, env=ENVIRONMENT, **options)
        assert done.returncode == 0 or not check, f"{argv}: {done.stdout}{done.stderr}\n{tail(self.log)}"
        return done

    def popen(self, argv: Sequence[object], **options: Any) -> subprocess.Popen[Any]:
        """Start a process on the host; the caller ends it."""
        return subprocess.Popen(self.command(argv), env=ENVIRONMENT, **options)

    def show(self, unit: str, name: str) -> str:
        """A property of a unit."""
        return self.run(["systemctl", "show", "--value", "-p", name, unit]).stdout.strip()

    def commands(self) -> list[str]:
        """Names of all that runs on the host, but for systemd and the one that looks.

        The ended are left out: who was started from outside has its parent there, which may be slow to take note of it.
        """
        rows = [line.split(maxsplit=1) for line in self.run(["ps", "-e", "-o", "stat=,comm="]).stdout.splitlines()]
        running = {name.strip() for state, name in rows if not state.startswith("Z")}
        return sorted(running - {"systemd", "ps", "(sd-pam)"})

    def _boot(self) -> None:
        for cgroup in self._cgroups:
            cgroup.mkdir()
        join = "".join(f"echo $$ >{cgroup}/cgroup.procs; " for cgroup in self._cgroups)
        spaces = "unshare --mount --pid --fork --net --uts --ipc --cgroup --kill-child"
        argv = ["sh", "-c", f'{join}exec {spaces} sh -c "$0" sh "$@"', BOOT]
        argv += [str(self._folder), str(ROOT), str(Path(sys.base_prefix).resolve()), UNIT_PATH, *_cgroup_kinds()]
        with self.log.open("ab") as log:
            self._unshare = subprocess.Popen(argv, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self._pid = wait_until(self._first_process, "systemd starts", BOOT_S, self.log)
        up = ["systemctl", "is-active", "--quiet", "basic.target"]
        wait_until(lambda: self.run(up, check=False).returncode == 0, "systemd is up", BOOT_S, self.log)

    def _first_process(self) -> int:
        assert self._unshare is not None
        assert self._unshare.poll() is None, tail(self.log)
        with suppress(FileNotFoundError):
            for child in children(self._unshare.pid):
                if Path(f"/proc/{child}/comm").read_text().strip() == "systemd":
                    return child
        return 0

    def _write_units(self) -> None:
        units = self._folder / "units"
        for name in STUBS:
            (units / f"{name}.target").write_text(f"[Unit]\nDescription={name}\nDefaultDependencies=no\n")
        # There is no journal.
        (units / "service.d").mkdir()
        (units / "service.d" / "log.conf").write_text(f"[Service]\nStandardOutput=append:{SHARE}/log\nStandardError=inherit\n")

    def _take_down(self) -> None:
        if self._unshare is not None:
            self._unshare.kill()  # and with it systemd and all that it runs
            self._unshare.wait()
        for cgroup in self._cgroups:
            wait_until(lambda at=cgroup: _removed(at), f"{cgroup} is empty", BOOT_S)


ENVIRONMENT = {"PATH": "/opt/deixis/bin:/usr/sbin:/usr/bin:/sbin:/bin", "LANG": "C.UTF-8"}


def write_environment(folder: Path) -> None:
    """What `pip install` makes in /opt/deixis, without its copies: scripts, and paths to the checkout and its packages."""
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    packages = folder / "lib" / version / "site-packages"
    packages.mkdir(parents=True)
    theirs = f"{CHECKOUT}/.venv/lib/{version}/site-packages"
    (packages / "deixis.pth").write_text("\n".join([*(f"{CHECKOUT}/{name}" for name in DISTRIBUTIONS), theirs]) + "\n")
    (folder / "pyvenv.cfg").write_text(f"home = {PYTHON}/bin\ninclude-system-site-packages = false\n")
    (folder / "bin").mkdir()
    (folder / "bin" / "python").symlink_to(f"{PYTHON}/bin/{version}")
    for name in ("cli", *SERVICES):
        # The very functions that pip would name.
        for script, called in tomllib.loads((ROOT / name / "pyproject.toml").read_text())["project"]["scripts"].items():
            module, function = called.split(":")
            path = folder / "bin" / script
            path.write_text(f"#!/opt/deixis/bin/python\nimport sys\nfrom {module} import {function}\nsys.exit({function}())\n")
            path.chmod(0o755)


def _cgroup_kinds() -> dict[str, Path]:
    """Where this process is in the hierarchies that the host gets, by what they are mounted with; empty if not to be had."""
    lines = [line.split(":", 2) for line in Path("/proc/self/cgroup").read_text().splitlines()]
    where = {controllers: path.lstrip("/") for _, controllers, path in lines}
    if (CGROUPS / "cgroup.controllers").exists():
        kinds = {"unified": CGROUPS / where.get("", "")}
    else:
        names = {"name=systemd": "systemd", "memory": "memory"}
        kinds = {kind: CGROUPS / name / where[kind] for kind, name in names.items() if kind in where}
    return kinds if all(os.access(path, os.W_OK) for path in kinds.values()) else {}


def _removed(cgroup: Path) -> bool:
    """Remove a cgroup and those in it; False while something lives in them."""
    if not cgroup.exists():
        return True
    try:
        for folder, _, _ in os.walk(cgroup, topdown=False):
            os.rmdir(folder)
    except OSError:
        time.sleep(0.05)
        return False
    return True
