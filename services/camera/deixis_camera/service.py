"""The camera stage: publishes what the capture thread has ready, when it is due, and says how the camera is."""

from __future__ import annotations

from pathlib import Path

import cv2
from deixis_runtime.queries import Query
from deixis_runtime.stage import Node, run_stage
from deixis_schemas import topics
from deixis_schemas.messages import CameraInfo, Frame, FrameId, HealthState, Message

from .calibration import AssumedFieldOfView, Calibration, CalibrationError, load_calibration
from .capture import Capture
from .config import CameraConfig
from .handoff import Became, Handoff, Item, Noted, Opened, Ready, Refused
from .info import CameraStatus
from .link_control import LinkControl
from .pacing import LOCKSTEP_EPOCH_NS, Lockstep, OwnRate, Readiness, missing
from .sources import without_credentials

INFO_PERIOD_S = 2.0
INFO_PERIOD_FRAMES = 60
STOP_WAIT_S = 1.0
SETTLE_S = 0.5
HEALTH: dict[str, HealthState] = {"retrying": "degraded", "failed": "failed"}


class CameraStage:
    """The loop thread's side of the camera. Everything that touches the node happens here; `handoff` brings what to publish."""

    def __init__(self, node: Node, config: CameraConfig) -> None:
        self._node = node
        self._config = config
        self._frames = node.publish(topics.FRAME)
        self._infos = node.publish(topics.CAMERA_INFO)
        self._beliefs = node.subscribe(topics.BELIEF, depth=8) if node.lockstep else None
        self._status = CameraStatus(node.producer, without_credentials(config.source), config.mount, node.lockstep)
        self.handoff = Handoff()
        self._link = LinkControl(node, config)
        self._lockstep = Lockstep(config.lockstep_timeout_s, config.loop)
        self._live = False
        self._started = False
        self._own_rate = OwnRate(0.0)
        self._readiness: Readiness | None = None
        self._hold_s = 0.0
        self._info_due_s = 0.0
        self._frames_since_info = 0
        self._stamp_ns = LOCKSTEP_EPOCH_NS
        self._picture_s = 0.0
        node.serve_get(topics.CAMERA_INFO, self._answer)

    def run(self) -> None:
        """Until shutdown."""
        self._settle()
        capture = self._start_capture()
        try:
            while self._node.wait(timeout_s=self._next_s()):
                self.step()
        finally:
            if capture is not None:
                capture.stop(STOP_WAIT_S)

    # --- starting -----------------------------------------------------------------------------------------------------

    def _settle(self) -> None:
        """Wait a moment for those who are there to say where: the first pictures are made for them already."""
        until_s = self._node.monotonic_s() + SETTLE_S
        while not self._link.settled() and self._node.monotonic_s() < until_s:
            if not self._node.wait(SETTLE_S / 10):
                return

    def _start_capture(self) -> Capture | None:
        self._picture_s = self._node.monotonic_s()
        try:
            calibration = self._calibration()
        except CalibrationError as error:
            self._become(Became("failed", str(error)))
            return None
        node = self._node
        capture = Capture(
            self._config,
            calibration,
            self.handoff,
            first_run(node),
            rung=lambda: self._link.rung,
            lockstep=node.lockstep,
            wake=node.wake,
            log=node.log,
        )
        capture.start()
        return capture

    def _calibration(self) -> Calibration:
        if self._config.calibration is None:
            return AssumedFieldOfView(self._config.horizontal_fov_deg)
        beside = self._node.site.path.parent if self._node.site is not None else Path()
        return load_calibration(beside / self._config.calibration)

    # --- each turn of the loop ----------------------------------------------------------------------------------------

    def step(self) -> None:
        """One turn of the loop: apply what the capture thread reported, and publish what is due."""
        self._take_answers()
        self._link.turn(self._node.monotonic_s())
        self._hold_s = INFO_PERIOD_S
        item = self.handoff.first()
        while item is not None and not isinstance(item, Ready):
            self.handoff.take(item)
            self._apply(item)
            item = self.handoff.first()
        if isinstance(item, Ready):
            self._handle(item)
        self._watch_for_stall()
        overwritten = self.handoff.take_overwritten()
        if overwritten:
            self._node.count("pictures_overwritten", overwritten)
        self._publish_info()

    def _next_s(self) -> float:
        return max(0.0, min(self._hold_s, self._info_due_s - self._node.monotonic_s()))

    def _take_answers(self) -> None:
        if self._beliefs is not None:
            for belief in self._beliefs.take_all():
                self._lockstep.answered(belief.frame_id)

    def _handle(self, picture: Ready) -> None:
        """Publish or drop the picture, or leave it for later and say for how long in `_hold_s`."""
        if self._live:
            self._send(picture, self._ago_ns(self._monotonic_ns() - picture.time_ns))
        elif not self._others_ready():
            self._hold_s = 0.1
        elif self._node.lockstep:
            self._feed(picture)
        else:
            self._play(picture)

    def _play(self, picture: Ready) -> None:
        decision = self._own_rate.decide(picture.time_ns, self._monotonic_ns(), self.handoff.waiting_pictures() > 1)
        if decision.act == "wait":
            self._hold_s = decision.wait_s
        elif decision.act == "drop":
            self._node.count("pictures_skipped")
            self.handoff.take(picture)
            self._hold_s = 0.0
        else:
            if decision.fell_behind:
                self._node.count("playback_fell_behind")
            self._send(picture, self._ago_ns(decision.late_ns))

    def _feed(self, picture: Ready) -> None:
        now_s = self._node.monotonic_s()
        if not self._lockstep.may_feed(now_s):
            self._hold_s = 0.1
            return
        early_s = self._lockstep.early_s(picture.time_ns, now_s)
        if early_s > 0:
            self._hold_s = early_s
            return
        unanswered = self._lockstep.given_up()
        if unanswered is not None:
            self._node.count("lockstep_unanswered")
            limit = self._config.lockstep_timeout_s
            key = topics.BELIEF.key(self._node.robot)
            self._node.warn("lockstep", f"{key}: no answer to frame {unanswered} within {limit:g} s; the next is fed")
        self._publish(picture, LOCKSTEP_EPOCH_NS + picture.time_ns)
        self._lockstep.sent(FrameId(picture.run, picture.seq), picture.time_ns, now_s)

    def _send(self, picture: Ready, stamp_ns: int) -> None:
        """Publish the picture, or drop it where those before it are late: the next one is newer."""
        if self._link.may_send(self._node.monotonic_s()):
            self._publish(picture, stamp_ns)
        else:
            self.handoff.take(picture)
            self._hold_s = 0.0
            self._picture_s = self._node.monotonic_s()

    def _publish(self, picture: Ready, stamp_ns: int) -> None:
        """Publish the picture, unless a newer live one has come in its place meanwhile."""
        self._hold_s = 0.0
        if not self.handoff.take(picture):
            return
        encoded, producer = picture.encoded, self._node.producer
        with self._node.step():
            frame = Frame(
                run=picture.run,
                seq=picture.seq,
                stamp_ns=stamp_ns,
                stage=producer.stage,
                instance=producer.instance,
                width=encoded.width,
                height=encoded.height,
                encoding=encoded.encoding,
                data=encoded.data,
            )
            if self._status.projects(encoded.width, encoded.height, picture.intrinsics):
                self._node.note("intrinsics", f"intrinsics: {picture.intrinsics.source}")
            self._become(Became("streaming"))
            self._stamp_ns = stamp_ns
            self._frames_since_info += 1
            self._publish_info()  # before the frame where it is news: who reads the frame needs its intrinsics
            self._frames.put(frame)
        self._status.published(picture.run, picture.seq)
        self._picture_s = self._node.monotonic_s()
        self._link.sent(FrameId(picture.run, picture.seq), len(encoded.data), picture.quality, self._picture_s)

    def _monotonic_ns(self) -> int:
        return round(self._node.monotonic_s() * 1e9)

    def _ago_ns(self, age_ns: int) -> int:
        """Unix time of what was `age_ns` ago. Ages are measured on the monotonic clock: the wall clock may be set meanwhile."""
        return self._node.now_ns() - age_ns

    def _others_ready(self) -> bool:
        """Whether a recording may start: a clip's first frames are not to be lost."""
        if self._started:
            return True
        node, config, now_s = self._node, self._config, self._node.monotonic_s()
        longest_s = config.lockstep_start_s if node.lockstep else config.subscriber_wait_s
        if self._readiness is None:
            self._readiness = Readiness(now_s, longest_s)
        alive = node.alive_stages() if node.lockstep else None
        matching = self._frames.matching() and (self._infos.matching() or not node.lockstep)
        self._started = self._readiness.ready(alive, matching, now_s)
        if self._started and self._readiness.timed_out(now_s):
            node.warn("start", f"{missing(alive)} within {longest_s:g} s; the recording starts all the same")
        return self._started

    # --- what the capture thread reports ------------------------------------------------------------------------------

    def _apply(self, item: Item) -> None:
        if isinstance(item, Opened):
            self._opened(item)
        elif isinstance(item, Became):
            self._become(item)
        elif isinstance(item, Refused):
            self._node.count("pictures_refused")
            self._node.warn("picture", item.reason)
        elif isinstance(item, Noted):
            self._node.note(item.key, item.text)

    def _opened(self, opened: Opened) -> None:
        self._live = opened.live
        limit = self._config.rate_hz
        rate_hz = min(limit, opened.rate_hz) if limit and opened.rate_hz else limit or opened.rate_hz
        self._status.has_rate(rate_hz)
        self._link.source_has_rate(rate_hz)
        self._picture_s = self._node.monotonic_s()
        if self._status.state != "streaming":  # not between two passes: the next one follows without a gap
            self._own_rate = OwnRate(rate_hz)

    def _become(self, became: Became) -> None:
        if not self._status.become(became.state, became.reason):
            return
        health: HealthState = "degraded" if became.broken else HEALTH.get(became.state, "ok")
        self._node.set_state(health, became.reason if health != "ok" else "")
        if health == "ok":
            self._node.log.info("%s%s", became.state, f": {became.reason}" if became.reason else "")

    def _watch_for_stall(self) -> None:
        if not (self._live and self._status.state == "streaming"):
            return
        silent_s = self._node.monotonic_s() - self._picture_s
        if silent_s > self._config.stalled_after_s:
            self._become(Became("retrying", f"'{without_credentials(self._config.source)}' is open but gives no new pictures"))

    # --- CameraInfo ---------------------------------------------------------------------------------------------------

    def _publish_info(self) -> None:
        """Publish it where it changed, and now and then for who came late or lost it."""
        now_s = self._node.monotonic_s()
        if self._info_is_due(now_s):
            self._infos.put(self._info())
            self._status.changed = False
            self._frames_since_info = 0
        if now_s >= self._info_due_s:
            self._info_due_s = now_s + INFO_PERIOD_S

    def _info_is_due(self, now_s: float) -> bool:
        state = self._status.state
        if self._node.lockstep and state == "starting":
            return False  # how often the start changes what is known depends on the machine; two runs are to be equal
        if self._node.lockstep and state in ("streaming", "ended"):
            return self._status.changed or self._frames_since_info >= INFO_PERIOD_FRAMES
        return self._status.changed or now_s >= self._info_due_s

    def _info(self) -> CameraInfo:
        return self._status.info(self._stamp_ns if self._node.lockstep else self._node.now_ns())

    def _answer(self, _query: Query) -> list[tuple[str, Message]]:
        return [(topics.CAMERA_INFO.key(self._node.robot), self._info())]


def first_run(node: Node) -> int:
    """Number of the first run. Live, the time tells this start from others; in lockstep two runs are to be equal."""
    return node.started_before << 32 if node.lockstep else node.now_ns() // 1_000_000


def serve(node: Node, config: CameraConfig) -> None:
    """Run the stage until shutdown."""
    cv2.setNumThreads(1)  # scaling one picture is quick; threads cost the other stages more than they gain here
    CameraStage(node, config).run()


def main(argv: list[str] | None = None) -> int:
    """Console script `deixis-camera`."""
    return run_stage("camera", CameraConfig, serve, argv, "Devices, files and streams to frames.")
