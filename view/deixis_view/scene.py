"""The core: hears messages with the time when they came, and says what is to be drawn. No Zenoh, no clock, no Rerun."""

from __future__ import annotations

from collections.abc import Iterator

from deixis_runtime.images import ImageError
from deixis_schemas import topics
from deixis_schemas.messages import Belief, Frame, FrameId, Gestures, HeadPoses, Message, OfFrame, Target, Tracks

from . import pages
from .curves import Curves
from .drawing import Drawing, Layout, Note, Page, Picture, Shot
from .floor import bounds, draw_people, draw_place
from .frame_join import FrameJoin
from .frame_view import FrameView
from .known import Known
from .overlay import ROOT, draw_overlay, size_shown
from .pictures import reduced, scale

LOG = "log"
OF_FRAME = (Tracks, HeadPoses, Gestures, Belief)
QUIET_NS = 1_000_000_000
"""Where no frame comes, what else is known is drawn as often."""
NO_FRAMES_NS = 3_000_000_000
WITHHELD = "none come: the camera's host keeps them, this viewer's certificate is not given them, or the camera is gone"
UNRECORDED = "the recording has none"
MAX_HEARD = 64


class Scene:
    """One robot, as it is drawn over time.

    rate_hz: frames drawn a second, by their stamps. width: of the pictures as they are shown, pixels. no_pictures: why none
    are wanted, or empty; then frames that come all the same are not shown. live: somebody looks on, and wants to see something
    though no frame has come yet.
    """

    def __init__(
        self, known: Known, *, rate_hz: float = 10.0, width: int = 640, no_pictures: str = "", live: bool = True
    ) -> None:
        self.known = known
        self._live = live
        self.camera_ahead_ns = 0
        """How far the clock of the camera's host is ahead of ours: for delays."""
        self.pictures = 0
        self.unreadable = ""
        self._join = FrameJoin(rate_hz)
        self._width = width
        self._unwanted = no_pictures
        self._curves = Curves()
        self._heard: dict[FrameId, dict[str, float]] = {}
        self._view: FrameView | None = None
        self._drawn_ns: int | None = None
        self._view_ns = 0
        self._frame_ns: int | None = None
        self._began_ns: int | None = None
        self._heard_any = False
        self._pictured: FrameId | None = None
        self._place: list[Drawing] = []
        self._place_ns = 0

    def layout(self) -> Layout:
        """What the views should show, as far as is known by now."""
        return Layout(bounds(self.known), size_shown(self.known, self._width), live=self._live)

    def hear(self, key: str, message: Message | None, now_ns: int) -> Iterator[Shot]:
        """Take in a message that came at `now_ns`, by our clock; none for the deletion of a POI. Gives what is to be drawn."""
        self._heard_any = True
        self._began_ns = now_ns if self._began_ns is None else self._began_ns
        if isinstance(message, Frame):
            self._frame_ns = now_ns
        if isinstance(message, Frame | Tracks | HeadPoses | Gestures | Belief):
            view = self._join.hear(message, now_ns) if not (self._unwanted and isinstance(message, Frame)) else None
            self._time(message, now_ns)
            if view is not None:
                yield self._frame_shot(view, now_ns)
        elif self.known.hear(key, message, now_ns) and isinstance(message, Target):
            yield from self._answer(message)
        yield from self.tick(now_ns)

    def tick(self, now_ns: int) -> Iterator[Shot]:
        """What is to be drawn though no frame comes."""
        self._began_ns = now_ns if self._began_ns is None else self._began_ns
        if now_ns - (self._drawn_ns or self._began_ns) < QUIET_NS:
            return
        stamp_ns = self._stamp_ns(now_ns)
        if stamp_ns is not None:
            self._drawn_ns = now_ns
            yield Shot(stamp_ns, None, list(self._standing(now_ns)))

    def _stamp_ns(self, now_ns: int) -> int | None:
        """What the camera's clock shows now; none where frames have yet to say in which time they are."""
        if self._view is not None:
            return self._view.stamp_ns + (0 if self.known.lockstep else now_ns - self._view_ns)
        return now_ns + self.camera_ahead_ns if self._live and not self.known.lockstep else None

    def _answer(self, target: Target) -> Iterator[Shot]:
        if target.final:
            yield Shot(target.stamp_ns, target.seq, [Drawing(LOG, Note(pages.target_note(target, self.known)))])

    @property
    def heard_anything(self) -> bool:
        """Whether any message has come."""
        return self._heard_any

    def why_no_pictures(self, now_ns: int) -> str:
        """Why there are none; empty where there are, or where it is too early to tell."""
        if self._unwanted:
            return self._unwanted
        quiet_ns = now_ns - (self._frame_ns or self._began_ns or now_ns)
        if quiet_ns <= NO_FRAMES_NS:
            return self.unreadable
        if not self._live:
            return UNRECORDED
        camera = self.known.camera
        return f"the camera is {camera.state}" if camera is not None and camera.state != "streaming" else WITHHELD

    def _frame_shot(self, view: FrameView, now_ns: int) -> Shot:
        self._view, self._view_ns, self._drawn_ns = view, now_ns, now_ns
        return Shot(view.stamp_ns, view.frame_id.seq, [*self._of_frame(view), *self._standing(now_ns)])

    def _of_frame(self, view: FrameView) -> Iterator[Drawing]:
        yield from self._picture(view)
        size = view.frame or view.tracks
        yield from draw_overlay(view, self.known, scale(size.width, self._width) if size else 1.0)
        yield from draw_people(view, self.known)
        if view.belief is not None:
            yield from self._curves.of_belief(view.belief, self.known.names)
        if not self.known.lockstep:
            yield from self._curves.of_latency(self._heard.get(view.frame_id, {}))

    def _picture(self, view: FrameView) -> Iterator[Drawing]:
        if view.frame is None or self._unwanted or view.frame_id == self._pictured:
            return
        try:
            jpeg = reduced(view.frame, self._width)
        except ImageError as error:
            self.unreadable = str(error)
            return
        self.unreadable = ""
        self.pictures += 1
        self._pictured = view.frame_id
        yield Drawing(ROOT, Picture(jpeg))

    def _standing(self, now_ns: int) -> Iterator[Drawing]:
        """What holds until something else is said."""
        view = self._view or FrameView(FrameId(0, 0), 0)
        if self._view is None:
            yield from draw_people(view, self.known)
        yield from self._changed_place(now_ns)
        why = self.why_no_pictures(now_ns)
        yield Drawing(pages.REASON, Page(pages.reason_page(view, self.known, why)))
        yield Drawing(pages.HEALTH, Page(pages.health_page(self.known, now_ns)))

    def _changed_place(self, now_ns: int) -> Iterator[Drawing]:
        """Walls and robot where they have changed, or once a second: a viewer may come late, or have dropped what is old."""
        place = draw_place(self.known)
        if place != self._place or now_ns - self._place_ns >= QUIET_NS:
            self._place, self._place_ns = place, now_ns
            yield from place

    def _time(self, message: OfFrame, now_ns: int) -> None:
        if message.stage not in topics.STAGES:
            return
        late_ns = now_ns - (message.stamp_ns - self.camera_ahead_ns)
        self._heard.setdefault(message.frame_id, {})[message.stage] = late_ns / 1e6
        if len(self._heard) > MAX_HEARD:
            del self._heard[next(iter(self._heard))]
