"""Shell of the adaptation: who reads the frames, what they answer, and what the capture thread is to make of its pictures."""

from __future__ import annotations

from typing import Any

from deixis_runtime.inputs import Subscription
from deixis_runtime.readers import Readers
from deixis_runtime.stage import Node
from deixis_schemas import topics
from deixis_schemas.messages import FrameId

from .adaptation import Adaptation, LinkReport
from .config import CameraConfig
from .ladder import Rung, ladder

# A stage that answers has had the frame: these two repeat its number and are small whatever the registry holds, while tracks
# (9 kB with their outlines) and beliefs (by the number of POIs) would load the way back. They are in the contract already, so a
# stage made elsewhere is measured as ours are; a receipt of our own would have to be taught to each. Either will do: when one
# of the two stages is dead, the other tells.
ANSWERS = (topics.GESTURES, topics.HEAD_POSES)
ANSWERS_KEPT = 8
USUAL_RATE_HZ = 30.0
NOTE = "link"


class LinkControl:
    """Decides what is sent. `rung` may be read from any thread; all else belongs to the loop."""

    def __init__(self, node: Node, config: CameraConfig) -> None:
        self._node = node
        self._config = config
        self._source_hz = 0.0
        self._readers: Readers | None = None
        self._answers: list[Subscription[Any]] = []
        self._adaptation: Adaptation | None = None
        self._elsewhere: set[str] = set()
        self.rung = self._steady(elsewhere=False)
        if not node.lockstep and (config.adapt or config.encoding == "auto"):
            self._readers = node.follow_readers(topics.FRAME)

    def settled(self) -> bool:
        """Whether it is known of all who are there where they are."""
        if self._readers is None:
            return True
        self._readers.turn()
        return not self._readers.unsettled()

    def source_has_rate(self, rate_hz: float) -> None:
        """Frames a second that would be published; 0 where it is unknown."""
        if rate_hz != self._source_hz:
            self._source_hz = rate_hz
            self._adaptation = None

    def turn(self, now_s: float) -> None:
        """Call it in each turn of the loop, before a picture is looked at."""
        if self._readers is None:
            return
        self._readers.turn()
        self._elsewhere = self._readers.elsewhere()
        if not (self._elsewhere and self._config.adapt):
            self._adaptation = None
            self._become(self._steady(elsewhere=bool(self._elsewhere)))
            return
        if self._adaptation is None:
            self._adaptation = self._begin(now_s)
        self._take_answers(now_s)
        self._adaptation.turn(now_s)
        self._become(self._adaptation.rung)

    def may_send(self, now_s: float) -> bool:
        """Whether the picture that is due may go out."""
        if self._adaptation is None or self._adaptation.due(now_s):
            return True
        self._node.count("pictures_held_back")
        return False

    def sent(self, frame_id: FrameId, size: int, quality: int | None, now_s: float) -> None:
        """A frame of so many bytes went out."""
        if self._adaptation is not None:
            self._adaptation.sent(frame_id, size, quality, now_s)

    def _steady(self, *, elsewhere: bool) -> Rung:
        """What the settings say where nothing adapts."""
        config = self._config
        as_jpeg = config.encoding == "jpeg" or (config.encoding == "auto" and elsewhere)
        return Rung(config.quality if as_jpeg else None, config.rate_hz or 0.0)

    def _begin(self, now_s: float) -> Adaptation:
        if not self._answers:  # only now: on one host nobody pays for them
            self._answers = [self._node.subscribe(topic, ANSWERS_KEPT) for topic in ANSWERS]
        config = self._config
        best = self._steady(elsewhere=True)
        rungs = ladder(best.quality, config.adapt_least_quality, self._source_hz or USUAL_RATE_HZ, config.adapt_least_rate_hz)
        return Adaptation(rungs, config.adapt_slack_ms / 1e3, now_s)

    def _take_answers(self, now_s: float) -> None:
        if self._adaptation is None:
            return
        for answers in self._answers:
            for answer in answers.take_all():
                self._adaptation.answered(FrameId(answer.run, answer.seq), now_s)

    def _become(self, rung: Rung) -> None:
        changed, self.rung = rung != self.rung, rung
        if not self._elsewhere:
            self._node.note(NOTE, None)
            return
        report = self._adaptation.report() if self._adaptation is not None else None
        self._node.note(NOTE, say(rung, self._elsewhere, report))
        if changed and report is not None and not report.is_best:
            self._node.warn(NOTE, say(rung, self._elsewhere, report))


def say(rung: Rung, elsewhere: set[str], report: LinkReport | None) -> str:
    """What is sent to readers on other hosts, and why that much, as one sentence."""
    what = "raw pictures" if rung.quality is None else f"JPEGs of quality {rung.quality}"
    rate = "at the source's rate" if not rung.rate_hz else f"at up to {rung.rate_hz:.3g}/s"
    sent = f"sends {what} {rate} to {', '.join(sorted(elsewhere))}"
    if report is None:
        return f"{sent}: not adapted to the link (camera.adapt)"
    if report.silent:
        return f"{sent}: no answer to its frames; the link is cut, or no stage answers there"
    if report.took_s is None:
        return f"{sent}: no answer yet"
    measured = f"{report.bytes_s / 1e3:.0f} kB/s arrive, answered after {report.took_s * 1e3:.0f} ms"
    return f"{sent}: {measured} (at the quickest {report.quickest_s * 1e3:.0f} ms)" + (
        "" if report.is_best else "; no more comes in time"
    )
