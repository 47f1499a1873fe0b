"""What a stage of one's own has to do so that `deixis swap` can put it in another's place, or another in its: docs/swap.md."""

import time

import zenoh
from deixis_schemas import codec, topics
from deixis_schemas.messages import FrameId, Voice

TAKE_WITHIN_S = 1.5
LEAD_FRAMES = 15
BEFORE_ALL = FrameId(-1, -1)


class Place:
    """Which frames are ours to answer aloud: from `first` on, and before `end`. Who stands by answers aside."""

    def __init__(self, session, robot, producer, *, stands_by):
        self.session, self.robot, self.producer = session, robot, producer
        self.first, self.end, self.newest = None if stands_by else BEFORE_ALL, None, None
        self.other, self.leaving, self.token = "", False, None
        self.runs = {BEFORE_ALL.run: -1}
        self.key = topics.VOICE.key(robot, stage=producer.stage, id=producer.instance)
        self.asked = session.declare_queryable(self.key, zenoh.handlers.RingChannel(8))
        self._hold_token()

    def is_ours(self, frame):
        """Whether the answer to this frame is to be heard. To be asked once for each, in the order of their coming."""
        self.newest, now = frame, self._order(frame)
        begun = self.first is not None and self._order(self.first) <= now
        return begun and (self.end is None or now < self._order(self.end))

    def answer_questions(self):
        """Do what is asked of us: `take` a place, `yield` ours, `leave`; each is answered with how we stand then."""
        while (query := self.asked.try_recv()) is not None:
            try:
                self._do(dict(query.parameters))
                query.reply(self.key, codec.encode(self._voice()), encoding=codec.encoding_of(Voice))
            except (KeyError, ValueError, codec.CodecError) as error:
                query.reply_err(str(error).encode())
            query.drop()

    def _do(self, told):
        if told.get("op") == "take":
            self._take(told["from"])
        elif told.get("op") == "yield":
            self._give(told["to"])
        elif told.get("op") == "leave":
            if self.end is None:
                raise ValueError("it has not yielded to anybody")
            self.leaving = True

    def _take(self, other):
        """Ask the one that is heard for a frame. What it answers later than TAKE_WITHIN_S counts for nothing."""
        key, asked_s = topics.VOICE.key(self.robot, stage=self.producer.stage, id=other), time.monotonic()
        for reply in self.session.get(f"{key}?op=yield;to={self.producer.instance}", timeout=TAKE_WITHIN_S):
            if reply.ok is None:
                raise ValueError(f"{other}: {reply.err.payload.to_string()}")
            voice = codec.decode(Voice, reply.ok.payload.to_bytes(), str(reply.ok.encoding))
            if time.monotonic() - asked_s < TAKE_WITHIN_S:
                self.other, self.first = other, BEFORE_ALL if voice.run is None else FrameId(voice.run, voice.seq)
                self._hold_token()
        if self.first is None:
            raise ValueError(f"{other} has not answered within {TAKE_WITHIN_S} s")

    def _give(self, other):
        """Name a frame a little ahead, so that the newcomer has heard of it before it comes; the same one when asked again."""
        if self.first is None or (self.end is not None and self.other != other):
            raise ValueError("it is not heard itself" if self.first is None else f"it yields to {self.other} already")
        if self.end is None:
            self.other = other
            self.end = BEFORE_ALL if self.newest is None else FrameId(self.newest.run, self.newest.seq + 1 + LEAD_FRAMES)
            self._hold_token()

    def _voice(self):
        state = "stands_by" if self.first is None else "speaks" if self.end is None else "yields"
        fence = self.end or self.first
        named = {"run": fence.run, "seq": fence.seq} if fence not in (None, BEFORE_ALL) else {}
        return Voice(stamp_ns=time.time_ns(), **self.producer._asdict(), state=state, other=self.other, **named)

    def _hold_token(self):
        """One token says that we are heard, another that we stand by."""
        key = topics.alive_key if self.first is not None and self.end is None else topics.standby_alive_key
        before, self.token = self.token, self.session.liveliness().declare_token(key(self.robot, *self.producer))
        if before is not None:
            before.undeclare()

    def _order(self, frame):
        """Runs in the order of their coming, frames within a run by `seq`."""
        return self.runs.setdefault(frame.run, len(self.runs)), frame.seq
