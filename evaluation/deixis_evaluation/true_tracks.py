"""The true tracks in place of the tracker: faces from the truth, hands cut from the label pictures where they are there.

Without label pictures a hand has its box and no outline, and the gesture stage, which reads outlines, does not see it.
"""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from deixis_schemas import topics
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import MAX_CONTOUR_BYTES, Frame, FrontalFace, KindProbabilities, Message, OfFrame, Track, Tracks
from numpy.typing import NDArray

from .clips import Clip, ClipError, Point, TrueHand, TruePerson, Truth
from .matching import MIN_FACE_PX, MIN_HAND_PX
from .speaker import producer_of

PARTS = {"right": 3, "left": 4}
PART_BITS = 15
PERSON_SHIFT = 5
IDS_A_PERSON = 3
FACE_HEIGHT = 1.31
"""Of a face's box, chin to brow, by its width: as the tracker has it."""
FRONTAL_DEG = 15.0
"""A head turned by less shows its face from the front."""
HAND_FACE_WIDTHS = 0.8
"""Size of a hand's box where neither picture nor label tells it."""


class TrueTracks:
    """Answers each frame with the true Tracks. Person ids are those of the labels."""

    topic = topics.TRACKS

    def __init__(self, clip: Clip) -> None:
        """Raises ClipError for label pictures that cannot be read."""
        self._truth = clip.truth
        self._labels = LabelPictures(label_pictures_of(clip))
        self._before: dict[int, Point] = {}

    @property
    def has_outlines(self) -> bool:
        """Whether hands have outlines."""
        return self._labels.exist

    def begin(self) -> Sequence[Message]:
        """Nothing: there is no frame yet."""
        return ()

    def hear(self, message: Message) -> Sequence[Message]:
        """The tracks of a frame."""
        return (self.of_frame(message),) if isinstance(message, Frame) else ()

    def of_frame(self, frame: OfFrame) -> Tracks:
        """The tracks of a frame; frames are given in order."""
        meta = self._truth.meta
        tracks = self._tracks(frame.seq) if frame.seq < len(self._truth.frames) else []
        return Tracks.derive(frame, producer_of(self.topic), width=meta.width, height=meta.height, tracks=tracks)

    def _tracks(self, seq: int) -> list[Track]:
        labels = self._labels.at(seq)
        tracks: list[Track] = []
        for person in self._truth.frames[seq].persons:
            if self._truth.in_picture(person.head.center_px):
                tracks.append(self._face(person))
                tracks += self._hands(person, labels)
        return [self._moving(track) for track in tracks]

    def _face(self, person: TruePerson) -> Track:
        width = face_width_px(self._truth, person)
        x, y = person.head.center_px
        frontal = FrontalFace(centre_px=(x, y), width_px=width) if abs(person.head.yaw_rel_deg) < FRONTAL_DEG else None
        return Track(
            track_id=IDS_A_PERSON * person.id,
            person_id=person.id,
            kind="face",
            kind_probabilities=KindProbabilities(face=1.0),
            centroid_px=person.face.centroid_visible_px or (x, y),
            bbox_px=(x - (width - 1) / 2, y - (FACE_HEIGHT * width - 1) / 2, width, FACE_HEIGHT * width),
            velocity_px_s=(0.0, 0.0),
            frontal=frontal if person.face.visible_px >= MIN_FACE_PX else None,
            observed=person.face.bbox_visible is not None,
        )

    def _hands(self, person: TruePerson, labels: NDArray[np.uint8] | None) -> list[Track]:
        found = []
        for number, (side, hand) in enumerate(person.hands.sides(), 1):
            if hand.in_frame and hand.visible_px >= MIN_HAND_PX:
                outline = None if labels is None else hand_outline(labels, person.id, PARTS[side])
                found.append(self._hand(person, IDS_A_PERSON * person.id + number, side, hand, outline))
        return found

    def _hand(self, person: TruePerson, number: int, side: str, hand: TrueHand, outline: NDArray[np.int32] | None) -> Track:
        if outline is None:
            centre = hand.centroid_visible_px or hand.center_px
            size = HAND_FACE_WIDTHS * face_width_px(self._truth, person)
            box = hand.bbox_amodal or (centre[0] - size / 2, centre[1] - size / 2, size, size)
        else:
            centre = _centroid(outline)
            x, y, w, h = cv2.boundingRect(outline)
            box = (float(x), float(y), float(w), float(h))
        return Track(
            track_id=number,
            person_id=person.id,
            kind="left_hand" if side == "left" else "right_hand",
            kind_probabilities=KindProbabilities(**{f"{side}_hand": 1.0}),
            centroid_px=centre,
            bbox_px=box,
            velocity_px_s=(0.0, 0.0),
            contour=b"" if outline is None else outline.astype("<i2").tobytes(),
        )

    def _moving(self, track: Track) -> Track:
        """The track with its velocity since the frame before: a head's is that of its box, for the skin moves as it turns."""
        x, y, w, h = track.bbox_px
        now = (x + (w - 1) / 2, y + (h - 1) / 2) if track.kind == "face" else track.centroid_px
        before = self._before.get(track.track_id, now)
        self._before[track.track_id] = now
        fps = self._truth.meta.fps
        velocity = ((now[0] - before[0]) * fps, (now[1] - before[1]) * fps)
        return track.model_copy(update={"velocity_px_s": velocity})


def face_width_px(truth: Truth, person: TruePerson) -> float:
    """Width of the face from the front at the head's depth along the optical axis, as fusion reads it."""
    depth_m = person.head.center_cam[2] if person.head.center_cam is not None else person.user_pos.distance_m
    return truth.meta.camera.K[0][0] * FACE_WIDTH_M / max(depth_m, 0.2)


def hand_outline(labels: NDArray[np.uint8], person: int, part: int) -> NDArray[np.int32] | None:
    """Outline (n, 2) of the largest piece of a person's hand in a label picture (h, w); none where there is none."""
    mask = (((labels & PART_BITS) == part) & (labels >> PERSON_SHIFT == person)).astype(np.uint8)
    outlines, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not outlines:
        return None
    largest = np.asarray(max(outlines, key=cv2.contourArea)[:, 0, :], np.int32)
    return largest if 3 <= len(largest) <= MAX_CONTOUR_BYTES // 4 else None


def label_pictures_of(clip: Clip) -> Path:
    """Where the label pictures of a clip lie, if it has any."""
    return clip.video.with_name(f"{clip.video.stem}_labels.npz")


class LabelPictures:
    """Label pictures of a clip: in an archive, a PNG a frame, `f0000` the first."""

    def __init__(self, path: Path) -> None:
        """Raises ClipError for an archive that is none."""
        self._archive: Any = None
        if not path.exists():
            return
        try:
            self._archive = np.load(path, allow_pickle=False)
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            raise ClipError(f"label pictures '{path}' cannot be read: {error}") from None

    @property
    def exist(self) -> bool:
        """Whether there are any."""
        return self._archive is not None

    def at(self, seq: int) -> NDArray[np.uint8] | None:
        """The picture (h, w) of a frame; none where there is none."""
        name = f"f{seq:04d}"
        if self._archive is None or name not in self._archive:
            return None
        picture = cv2.imdecode(self._archive[name], cv2.IMREAD_UNCHANGED)
        return None if picture is None or picture.ndim != 2 else np.asarray(picture, np.uint8)


def _centroid(outline: NDArray[np.int32]) -> Point:
    moments = cv2.moments(outline)
    if moments["m00"] <= 0:
        middle = outline.mean(axis=0)
        return float(middle[0]), float(middle[1])
    return moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
