"""Two hosts on one machine, joined by a bad link: for tests of what crosses a network.

Each host is a network namespace with a private /dev/shm (Zenoh's shared memory crosses namespaces otherwise and would bypass
the link). The link is a pair of TUN devices; a thread here relays their packets with delay, jitter, loss, a rate limit with a
drop-tail queue, and can be cut. It stands in for tc netem, which many kernels lack. Needs root, iproute2 and util-linux.

    with TwoHosts("robot", "edge") as hosts:              # robot 10.77.0.1, edge 10.77.0.2
        server = hosts.popen("edge", [sys.executable, "-m", "http.server"])
        hosts.link(delay_ms=20, jitter_ms=5, loss=0.01, rate_mbit=8, queue_ms=200)
        hosts.cut(); hosts.restore(); hosts.statistics()
"""

from __future__ import annotations

import fcntl
import heapq
import os
import random
import select
import shutil
import struct
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 0x0001, 0x1000
POLL_S = 0.05
VGA_BYTES = 640 * 480 * 3
BURST = 64
MAX_PACKET_BYTES = 65536


@dataclass(frozen=True)
class Link:
    """How bad the link is, in each direction."""

    delay_ms: float = 0.0
    jitter_ms: float = 0.0
    loss: float = 0.0  # share of packets, 0..1
    rate_mbit: float = 0.0  # 0 is unlimited
    queue_ms: float = 200.0  # what would wait longer is dropped


@dataclass
class Statistics:
    """Packets since the start."""

    forwarded: int = 0
    lost: int = 0
    dropped: int = 0
    bytes: int = 0


def missing_for_two_hosts() -> str:
    """Why two hosts cannot be made here; empty if they can."""
    if os.geteuid() != 0:
        return "two hosts need root"
    absent = [tool for tool in ("unshare", "nsenter", "ip") if shutil.which(tool) is None]
    if absent:
        return f"two hosts need {', '.join(absent)}"
    if not os.path.exists("/dev/net/tun"):
        return "two hosts need /dev/net/tun"
    tried = subprocess.run(["unshare", "-n", "-m", "true"], check=False, capture_output=True, text=True)
    return f"two hosts need namespaces: {tried.stderr.strip()}" if tried.returncode else ""


class TwoHosts:
    """Use as a context manager."""

    def __init__(self, first: str = "robot", second: str = "edge", subnet: str = "10.77.0") -> None:
        self.names = (first, second)
        self.address = {first: f"{subnet}.1", second: f"{subnet}.2"}
        self.statistics = Statistics()
        self._holders: dict[str, subprocess.Popen[str]] = {}
        self._tun: dict[str, int] = {}
        self._link = Link()
        self._is_cut = False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._relay, daemon=True, name="two-hosts-relay")

    def __enter__(self) -> Self:
        try:
            for index, name in enumerate(self.names):
                self._make_host(name, f"tun{os.getpid() % 10000}{index}")
        except BaseException:
            self._take_down()
            raise
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()
        self._take_down()

    def command(self, host: str, argv: Sequence[object]) -> list[str]:
        """`argv` as it has to be started to run on the host."""
        return ["nsenter", "-t", str(self._holders[host].pid), "-m", "-n", *map(str, argv)]

    def popen(self, host: str, argv: Sequence[object], **options: Any) -> subprocess.Popen[Any]:
        """Start a process on the host; the caller ends it."""
        return subprocess.Popen(self.command(host, argv), **options)

    def run(self, host: str, argv: Sequence[object], check: bool = True, **options: Any) -> subprocess.CompletedProcess[Any]:
        """Run a command on the host to its end. Raises subprocess.CalledProcessError where it fails and `check` is set."""
        return subprocess.run(self.command(host, argv), check=check, **options)

    def link(self, **settings: float) -> None:
        """Change some settings of the link."""
        self._link = replace(self._link, **settings)

    def cut(self) -> None:
        """Let nothing through, and lose what is under way."""
        self._is_cut = True

    def restore(self) -> None:
        """Let packets through again."""
        self._is_cut = False

    def _make_host(self, name: str, device: str) -> None:
        holder = subprocess.Popen(
            ["unshare", "-n", "-m", "sh", "-c", "mount -t tmpfs tmpfs /dev/shm && echo up && exec sleep infinity"],
            stdout=subprocess.PIPE,
            text=True,
        )
        self._holders[name] = holder
        if holder.stdout is None or holder.stdout.readline().strip() != "up":
            raise RuntimeError(f"cannot make the host {name}: root and unshare are needed")
        tun = self._tun[name] = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(tun, TUNSETIFF, struct.pack("16sH", device.encode(), IFF_TUN | IFF_NO_PI))
        subprocess.run(["ip", "link", "set", device, "netns", str(holder.pid)], check=True)
        self.run(name, ["ip", "link", "set", "lo", "up"])
        self.run(name, ["ip", "addr", "add", f"{self.address[name]}/24", "dev", device])
        self.run(name, ["ip", "link", "set", device, "up"])

    def _take_down(self) -> None:
        for holder in self._holders.values():
            holder.kill()
            holder.wait()
            if holder.stdout is not None:
                holder.stdout.close()
        for tun in self._tun.values():
            os.close(tun)

    def _relay(self) -> None:
        first, second = (self._tun[name] for name in self.names)
        other, free_at = {first: second, second: first}, {first: 0.0, second: 0.0}
        waiting: list[tuple[float, int, int, bytes]] = []
        number = 0
        while not self._stop.is_set():
            timeout = min(POLL_S, max(0.0, waiting[0][0] - time.monotonic())) if waiting else POLL_S
            for tun in select.select([first, second], [], [], timeout)[0]:
                for packet in _burst(tun):
                    arrives = self._arrival(len(packet), tun, free_at)
                    if arrives is not None:
                        number += 1
                        heapq.heappush(waiting, (arrives, number, other[tun], packet))
            if self._is_cut:
                waiting.clear()
            while waiting and waiting[0][0] <= time.monotonic():
                _, _, tun, packet = heapq.heappop(waiting)
                self._deliver(tun, packet)

    def _arrival(self, size: int, tun: int, free_at: dict[int, float]) -> float | None:
        """When a packet read now arrives at the other end; None if it never does."""
        link, now = self._link, time.monotonic()
        if self._is_cut or (link.loss and random.random() < link.loss):
            self.statistics.lost += 1
            return None
        leaves = now
        if link.rate_mbit:
            leaves = max(now, free_at[tun])
            if leaves - now > link.queue_ms / 1e3:
                self.statistics.dropped += 1
                return None
            leaves += size * 8 / (link.rate_mbit * 1e6)
            free_at[tun] = leaves
        return leaves + max(0.0, link.delay_ms + random.uniform(-1, 1) * link.jitter_ms) / 1e3

    def _deliver(self, tun: int, packet: bytes) -> None:
        try:
            os.write(tun, packet)
        except BlockingIOError:
            self.statistics.dropped += 1
            return
        self.statistics.forwarded += 1
        self.statistics.bytes += len(packet)


def assert_each_frame_crosses_once(hosts: TwoHosts, newest: Callable[[], tuple[int, int]], frames: int = 30) -> None:
    """Of raw VGA frames in lockstep; `newest` gives run and seq of the newest frame that the edge has said it has answered."""
    run, first, sent = _just_said(hosts, newest)
    now, last, sent_last = run, first, sent
    while last - first < frames:
        now, last, sent_last = _just_said(hosts, newest)
        if now != run:  # the clip began anew
            run, first, sent = now, last, sent_last
    # Of the first and the last a part may be counted, and what else there is to say comes on top.
    times = (sent_last - sent) / (last - first) / VGA_BYTES
    assert 0.9 < times < 1.3, f"each frame crossed the link {times:.2f} times"


def _just_said(hosts: TwoHosts, newest: Callable[[], tuple[int, int]]) -> tuple[int, int, int]:
    """Run and seq as soon as they are new, and the bytes that had crossed the link."""
    before, deadline = newest(), time.monotonic() + 60
    while (said := newest()) == before:
        assert time.monotonic() < deadline, "the edge answers no frames"
        time.sleep(POLL_S / 5)
    return *said, hosts.statistics.bytes


def _burst(tun: int) -> list[bytes]:
    packets: list[bytes] = []
    while len(packets) < BURST:
        try:
            packets.append(os.read(tun, MAX_PACKET_BYTES))
        except BlockingIOError:
            break
    return packets
