"""A machine of one's own, for who types commands as the pages have them: its ports are free, hosts' names of the pages are its
own, and it reaches nothing outside. It shares disk and processor with this one.

Namespaces of network and mounts (/etc/hosts, /dev/shm). Needs util-linux and iproute2, and root or user namespaces.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from namespace_holder import NamespaceHolder

NEW = ("unshare", "--net", "--mount")
AS_ROOT_THERE = ("--user", "--map-root-user")
MAKE = r"""
set -eu
ip link set lo up
mount --bind "$0" /etc/hosts
mount -t tmpfs tmpfs /dev/shm
echo up
exec sleep infinity
"""


def _options() -> tuple[str, ...]:
    return () if os.geteuid() == 0 else AS_ROOT_THERE


def missing_for_own_machine() -> str:
    """Why there can be none here; empty if there can."""
    absent = [tool for tool in ("unshare", "nsenter", "ip") if shutil.which(tool) is None]
    if absent:
        return f"a machine of one's own needs {', '.join(absent)}"
    tried = subprocess.run([*NEW, *_options(), "true"], check=False, capture_output=True, text=True)
    return f"a machine of one's own needs namespaces: {tried.stderr.strip()}" if tried.returncode else ""


class OwnMachine(NamespaceHolder):
    """Use as a context manager. names: of hosts, all of which it is."""

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        hosts = folder / "hosts"
        hosts.write_text(f"127.0.0.1 localhost {' '.join(names)}\n")
        super().__init__([*NEW, *_options(), "sh", "-c", MAKE, str(hosts)], "a machine of one's own")

    def argv(self, folder: Path, script: str) -> list[str]:
        """How to start a script of bash there, in a folder."""
        user = ["--user", "--preserve-credentials"] if os.geteuid() else []
        inside = ["nsenter", "--target", str(self.pid), "--net", "--mount", *user, f"--wd={folder}"]
        return [*inside, "bash", "-c", script]
