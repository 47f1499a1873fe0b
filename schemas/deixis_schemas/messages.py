"""The messages of Deixis: plain data, one class per type on the wire.

Units stand in the field names. Bearings and yaw are measured at the person, from the direction person -> camera, positive
toward the image's right, that is toward the person's own left (REP-103: counter-clockwise seen from above). Map,
`base_link` and optical frames follow REP-103 and REP-105. Pixel coordinates have their origin at the centre of the top
left pixel, x right, y down. Times are Unix nanoseconds at the camera's host.

How wide a face is, stands in `anatomy.py`, once for all stages.

A reader ignores fields it does not know; a field that changes its meaning raises the type's `VERSION`.
"""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, NamedTuple, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from .plain_text import plain

MAX_SIDE_PX = 8192
MAX_PERSONS = 32
MAX_TRACKS = 96
MAX_POIS = 1024
MAX_REGISTERED = 10_000
"""POIs that the registry holds; a message lists `MAX_POIS` of them at most."""
MAX_CONTOUR_BYTES = 65536
MAX_LISTED = 16
MAX_TEXT = 2000
COVARIANCE_SLACK = 1e-6
"""Of correlations beyond those of a positive semidefinite matrix: what rounding does."""
SIGMA_SLACK = 1e-3
"""Relative difference that a standard deviation stated twice may have."""

# A name is one part of a key and, of robots, of a path: `.` and `..` are none, and no option begins like one.
NAME_PATTERN = r"^[A-Za-z0-9_][A-Za-z0-9_.\-]{0,63}$"
Name = Annotated[str, Field(pattern=NAME_PATTERN)]
Text = Annotated[str, Field(max_length=MAX_TEXT)]
Line = AfterValidator(plain)  # of text that people write: no control characters
Count = Annotated[int, Field(ge=0, le=2**63 - 1)]
Nanoseconds = Annotated[int, Field(ge=0, le=2**63 - 1)]
Share = Annotated[float, Field(ge=-1e-9, le=1 + 1e-9)]
Pixel = Annotated[float, Field(ge=-4 * MAX_SIDE_PX, le=4 * MAX_SIDE_PX)]
FarPixel = Annotated[float, Field(ge=-1e9, le=1e9)]  # summed up: a robot that turns on the spot for a day comes to 1e8
Extent = Annotated[float, Field(ge=0, le=MAX_SIDE_PX)]
Metre = Annotated[float, Field(ge=-1e5, le=1e5)]
LogOdds = Annotated[float, Field(ge=-100, le=100)]
Degree = Annotated[float, Field(ge=-360, le=360)]
Variance = Annotated[float, Field(gt=0, le=180**2)]
Covariance = Annotated[float, Field(ge=-(180**2), le=180**2)]
Point = tuple[Pixel, Pixel]
Position = tuple[Metre, Metre, Metre]

TrackKind = Literal["face", "left_hand", "right_hand", "unknown"]
PoseStatus = Literal["tracking", "out_of_range", "initialising", "lost"]
Phase = Literal["idle", "preparation", "stroke", "retraction"]
GestureKind = Literal["point_left", "point_right", "invisible", "other", "none"]
Side = Literal["left", "right"]
HandPosture = Literal["index", "open", "fist", "thumb", "other", "unknown"]
FrameEncoding = Literal["bgr8", "mono8", "jpeg"]
CameraState = Literal["starting", "streaming", "retrying", "ended", "failed"]
SourceStatus = Literal["ok", "late", "dead", "wrong_version", "not_tracking"]
HealthState = Literal["ok", "degraded", "failed"]
VoiceState = Literal["speaks", "yields", "stands_by", "asks"]


class Producer(NamedTuple):
    """Who made a message: the stage and the one process of it."""

    stage: str
    instance: str


class FrameId(NamedTuple):
    """Names one frame of one camera."""

    run: int
    seq: int


class Part(BaseModel):
    """A piece of a message; has no version of its own."""

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, ser_json_bytes="base64", val_json_bytes="base64")


class Message(Part):
    """What travels under a key of its own."""

    VERSION: ClassVar[int] = 1


class Produced(Message):
    """A message that names its producer and the time it speaks of."""

    stamp_ns: Nanoseconds = Field(description="Time the content speaks of: capture time of the frame where there is one.")
    stage: Name = Field(description="Stage that made the message.")
    instance: Name = Field(description="Process of that stage; a new one after each restart.")


class OfFrame(Produced):
    """A message about one frame. `run` and `seq` together name the frame; `stamp_ns` is when it was captured, and no name."""

    VERSION: ClassVar[int] = 2

    run: Count = Field(
        description="Run of the camera that the frame belongs to: within a run `seq` rises. A new one begins with each start "
        "of the camera and each pass through a recording. Compare for equality only."
    )
    seq: Count = Field(description="Number of the frame within its run; of a file, its index from 0.")

    @classmethod
    def derive(cls, source: OfFrame, producer: Producer, **content: object) -> Self:
        """Build the message that `producer` derives from `source`: repeats `run`, `seq` and `stamp_ns`, names the producer.

        Raises pydantic.ValidationError where the content breaks the contract.
        """
        of_frame = {"run": source.run, "seq": source.seq, "stamp_ns": source.stamp_ns}
        return cls.model_validate({**content, **of_frame, "stage": producer.stage, "instance": producer.instance})

    @property
    def frame_id(self) -> FrameId:
        """(run, seq): equal for all messages about one frame."""
        return FrameId(self.run, self.seq)


# --- camera -----------------------------------------------------------------------------------------------------------


class Frame(OfFrame):
    """One picture. `bgr8` and `mono8` are rows of bytes without padding, `jpeg` is a JPEG file."""

    width: int = Field(ge=1, le=MAX_SIDE_PX)
    height: int = Field(ge=1, le=MAX_SIDE_PX)
    encoding: FrameEncoding
    data: bytes = Field(min_length=1)

    @model_validator(mode="after")
    def _data_fits_size(self) -> Self:
        channels = {"bgr8": 3, "mono8": 1}.get(self.encoding)
        if channels and len(self.data) != self.width * self.height * channels:
            raise ValueError(
                f"data: {len(self.data)} bytes, but {self.width} x {self.height} {self.encoding} has "
                f"{self.width * self.height * channels}"
            )
        return self


class CameraMount(Part):
    """Pose of the optical centre in `base_link` (REP-103: x forward, y left, z up)."""

    position_m: Position = Field(default=(0.0, 0.0, 1.3), description="Optical centre in base_link, metres.")
    yaw_deg: Degree = Field(default=0.0, description="Turn of the optical axis to the robot's left, degrees.")
    pitch_up_deg: Degree = Field(default=0.0, description="Tilt of the optical axis above the horizontal, degrees.")
    roll_deg: Degree = Field(
        default=0.0, description="Turn of the camera about its optical axis, clockwise as seen from behind it, degrees."
    )


class CameraInfo(Produced):
    """What the camera is, how it projects, and whether it delivers."""

    state: CameraState
    reason: Text = Field(default="", description="Why it is not streaming, as one sentence.")
    source: Text = Field(description="Device, file or URL, without credentials.")
    width: int = Field(default=0, ge=0, le=MAX_SIDE_PX)
    height: int = Field(default=0, ge=0, le=MAX_SIDE_PX)
    rate_hz: float = Field(default=0.0, ge=0, le=1000, description="Nominal rate of the source; 0 where it is unknown.")
    camera_matrix: tuple[float, float, float, float, float, float, float, float, float] | None = Field(
        default=None, description="K, row-major, for `width` x `height`; none before the first picture."
    )
    distortion_model: Literal["none", "plumb_bob", "rational_polynomial", "equidistant"] = "none"
    distortion: list[float] = Field(default_factory=list, max_length=14)
    intrinsics: Text = Field(default="", description="Where camera_matrix comes from, e.g. an assumed field of view.")
    mount: CameraMount = Field(default_factory=CameraMount)
    lockstep: bool = Field(default=False, description="The next frame waits for fusion's answer; stamps are media time.")
    run: Count = Field(default=0, description="Run of the last frame published.")
    last_seq: int = Field(
        default=-1, ge=-1, le=2**63 - 1, description="`seq` of the last frame published; of use when `ended`."
    )


# --- tracker ----------------------------------------------------------------------------------------------------------


class KindProbabilities(Part):
    """Belief of the classifier over the kinds; sums to 1."""

    face: Share = 0.0
    left_hand: Share = 0.0
    right_hand: Share = 0.0
    unknown: Share = 0.0


class FrontalFace(Part):
    """A face seen from the front, measured by its shape in this frame alone; not smoothed over frames."""

    centre_px: Point = Field(description="Centre of the head.")
    width_px: Annotated[float, Field(gt=0, le=MAX_SIDE_PX)] = Field(description="Ear to ear: `anatomy.FACE_WIDTH_M`.")


class Track(Part):
    """One tracked skin-coloured blob. Left and right are the person's own."""

    track_id: Count
    person_id: Count | None = Field(default=None, description="Person it belongs to; none where that is open.")
    kind: TrackKind
    kind_probabilities: KindProbabilities
    centroid_px: Point
    bbox_px: tuple[Pixel, Pixel, Extent, Extent] = Field(
        description="x, y of the top left corner, width, height. Of a face: chin to brow, and ear to ear "
        "(`anatomy.FACE_WIDTH_M`) as it would be seen from the front, about the head's centre also when the head is turned."
    )
    velocity_px_s: tuple[Annotated[float, Field(ge=-1e6, le=1e6)], Annotated[float, Field(ge=-1e6, le=1e6)]]
    contour: bytes = Field(
        default=b"",
        max_length=MAX_CONTOUR_BYTES,
        description="Outline: packed little-endian int16 pairs x, y. Of a hand: the hand alone, cut from a bare forearm.",
    )
    frontal: FrontalFace | None = Field(
        default=None, description="Of a face: what it shows from the front in this frame, where that was looked for and seen."
    )
    observed: bool = Field(default=True, description="Seen in this frame; false while it is only predicted.")
    confidence: Share = Field(default=1.0, description="Belief that the blob is what its kind says.")

    @model_validator(mode="after")
    def _contour_is_pairs(self) -> Self:
        if len(self.contour) % 4:
            raise ValueError("contour: not a whole number of int16 pairs")
        return self


class Tracks(OfFrame):
    """All tracks of one frame."""

    width: int = Field(ge=1, le=MAX_SIDE_PX, description="Width of the frame the pixels refer to.")
    height: int = Field(ge=1, le=MAX_SIDE_PX)
    tracks: list[Track] = Field(default_factory=list, max_length=MAX_TRACKS)
    room_offset_px: tuple[FarPixel, FarPixel] = Field(
        default=(0.0, 0.0),
        description="How far the room has moved in the middle of the picture since the run began, x right, y down: the camera "
        "moved. Whether a hand is still is judged with the room, not with the picture.",
    )


# --- headpose ---------------------------------------------------------------------------------------------------------


class HeadPose(Part):
    """Head of one person. `yaw_deg` is none unless `status` is `tracking`; for `out_of_range` its sign may be known."""

    person_id: Count
    status: PoseStatus
    yaw_deg: Degree | None = None
    yaw_sigma_deg: Annotated[float, Field(gt=0, le=180)] | None = None
    pitch_deg: Degree | None = None
    roll_deg: Degree | None = None
    covariance_deg2: tuple[Variance, Covariance, Covariance, Variance, Covariance, Variance] | None = Field(
        default=None,
        description="Covariance of yaw (y), pitch (p) and roll (r), degrees squared: yy, yp, yr, pp, pr, rr. Positive "
        "semidefinite; where `yaw_sigma_deg` is there too, it is the square root of yy.",
    )
    face_width_px: Annotated[float, Field(gt=0, le=MAX_SIDE_PX)] | None = Field(
        default=None,
        description="How wide the face would be from the front, ear to ear (anatomy.FACE_WIDTH_M), as read from the head "
        "however it is turned: how far away it is. None where the stage does not tell; then the track's box says it.",
    )
    side: Side | None = Field(default=None, description="Side the head is turned to where out of range: the person's own.")
    beyond_deg: Annotated[float, Field(ge=0, le=180)] | None = Field(
        default=None,
        description="Where out of range: the yaw, to either side, beyond which this stage reads heads no more. A head that was "
        "lost is not out of range, however it was turned.",
    )

    @model_validator(mode="after")
    def _tracking_has_yaw(self) -> Self:
        if self.status == "tracking" and (self.yaw_deg is None or self.yaw_sigma_deg is None):
            raise ValueError("yaw_deg: a pose with status 'tracking' needs yaw_deg and yaw_sigma_deg")
        return self

    @model_validator(mode="after")
    def _covariance_is_one(self) -> Self:
        if self.covariance_deg2 is None:
            return self
        yy, yp, yr, pp, pr, rr = self.covariance_deg2
        # Of a symmetric matrix of three, all principal minors tell; of the correlations, so that one slack fits all sizes.
        y, p, r = math.sqrt(yy), math.sqrt(pp), math.sqrt(rr)  # a product of two variances may be too small for a number
        a, b, c = yp / y / p, yr / y / r, pr / p / r
        lowest = min(1 - a * a, 1 - b * b, 1 - c * c, 1 + 2 * a * b * c - a * a - b * b - c * c)
        if not lowest >= -COVARIANCE_SLACK:
            raise ValueError("covariance_deg2: not positive semidefinite, so the covariance of nothing")
        if self.yaw_sigma_deg is not None and abs(self.yaw_sigma_deg - y) > SIGMA_SLACK * y:
            raise ValueError(
                f"yaw_sigma_deg: {self.yaw_sigma_deg:.6g}, but the variance of yaw in covariance_deg2 makes it {y:.6g}"
            )
        return self


class HeadPoses(OfFrame):
    """Heads of one frame."""

    poses: list[HeadPose] = Field(default_factory=list, max_length=MAX_PERSONS)


# --- gesture ----------------------------------------------------------------------------------------------------------


BEARING_STEP_DEG = 5
BEARINGS = 360 // BEARING_STEP_DEG


class Gesture(Part):
    """What the gesturing hand of one person does."""

    person_id: Count
    phase: Phase
    gesture: GestureKind
    hand: Side | None = Field(default=None, description="The hand spoken of, the person's own; none while idle.")
    fingertips_px: list[Point] = Field(default_factory=list, max_length=10)
    bearing_deg: Degree | None = Field(default=None, description="Direction pointed to, where the stage can tell.")
    bearing_sigma_deg: Annotated[float, Field(gt=0, le=180)] | None = None
    bearing_mirrored: bool = Field(
        default=False, description="The stage cannot tell bearing b from 180 - b (in front of the person or behind)."
    )
    bearing_likelihood: list[Share] = Field(
        default_factory=list,
        max_length=BEARINGS,
        description="How likely what is seen is if the person points to bearing -180, -175 ... 175 degrees, beside the best; "
        "empty, or all of them. It says more than mean and sigma do: front and back, and what no arm does.",
    )
    elevation_deg: Annotated[float, Field(ge=-90, le=90)] | None = Field(
        default=None, description="How high it points, above the horizontal at the person's head, where the stage can tell."
    )
    elevation_sigma_deg: Annotated[float, Field(gt=0, le=180)] | None = None
    point_probability: Share | None = Field(
        default=None, description="That this stroke is a pointing; none outside of strokes, and of a stage that does not weigh."
    )
    point_log_odds: dict[Annotated[str, Field(max_length=32)], LogOdds] = Field(
        default_factory=dict, max_length=16, description="What spoke for a pointing (above 0) and against it (below), by name."
    )
    hand_posture: HandPosture | None = Field(
        default=None,
        description="Of a held hand: the index finger alone stretched, the open palm, a fist, the thumb alone, something else; "
        "`unknown` where the picture does not tell. None outside of strokes, and of a stage that does not look.",
    )
    hand_posture_probability: Share | None = Field(
        default=None, description="Of the likeliest posture, also where unknown is said."
    )

    @model_validator(mode="after")
    def _bearing_has_sigma(self) -> Self:
        if (self.bearing_deg is None) != (self.bearing_sigma_deg is None):
            raise ValueError("bearing_sigma_deg: bearing_deg and bearing_sigma_deg come together")
        if self.bearing_likelihood and (len(self.bearing_likelihood) != BEARINGS or max(self.bearing_likelihood) <= 0):
            raise ValueError(f"bearing_likelihood: {BEARINGS} shares, one at least above 0")
        return self

    @model_validator(mode="after")
    def _elevation_has_sigma(self) -> Self:
        if (self.elevation_deg is None) != (self.elevation_sigma_deg is None):
            raise ValueError("elevation_sigma_deg: elevation_deg and elevation_sigma_deg come together")
        return self

    @model_validator(mode="after")
    def _posture_has_probability(self) -> Self:
        if (self.hand_posture is None) != (self.hand_posture_probability is None):
            raise ValueError("hand_posture_probability: hand_posture and hand_posture_probability come together")
        return self


class Gestures(OfFrame):
    """Gestures of one frame."""

    gestures: list[Gesture] = Field(default_factory=list, max_length=MAX_PERSONS)


# --- fusion -----------------------------------------------------------------------------------------------------------


class Poi(Message):
    """A point of interest in the map frame."""

    poi_id: Name = Field(description="Equals the last part of its key.")
    name: Annotated[Text, Line] = Field(default="", description="For people, one line; the id where it is empty.")
    position_m: Position = Field(description="Centre in the map frame, x, y, z, metres.")
    extent_m: float = Field(default=0.5, ge=0, le=1000, description="Size across, metres.")
    tags: list[Annotated[str, Field(max_length=64), Line]] = Field(
        default_factory=list, max_length=32, description="Words to sort it by; Deixis keeps them and makes nothing of them."
    )
    edited_by: Annotated[str, Field(max_length=128), Line] = Field(
        default="", description="Who put it there, where that was told."
    )
    edited_ns: Nanoseconds = Field(default=0, description="When, by the registry's clock, which fills it in; 0 where unknown.")


class PoiBelief(Part):
    """Standing of one POI in a combined belief."""

    poi_id: Name
    mass: Share = Field(description="Mass of the set that holds it alone.")
    belief: Share
    plausibility: Share
    pignistic: Share
    probability: Share | None = Field(
        default=None,
        description="How probable it is that this one is meant: by this POIs are ranked and answered. None where not told.",
    )
    bearing_deg: Degree | None = Field(default=None, description="Its bearing at the person.")


class FocalSet(Part):
    """A set of POIs with its mass."""

    poi_ids: list[Name] = Field(max_length=MAX_LISTED, description="Its members; of a larger set the first of them.")
    size: Count = Field(description="How many members it has.")
    mass: Share


class Evidence(Part):
    """What one source contributed."""

    source: Name = Field(description="`gesture` or `headpose`; `robot` where its pose is in doubt.")
    producer: Text = Field(default="", description="`stage/instance` that made it; empty if there was none.")
    status: SourceStatus
    observed: Text = Field(description="What was observed, e.g. 'point_left' or 'yaw -61.9 +- 3.1 deg'; why nothing was.")
    age_ms: float | None = Field(default=None, ge=0, description="Age of the observation when it was used.")
    weight: Share = Field(description="1 - m(X): 0 for a vacuous assignment.")
    masses: list[FocalSet] = Field(default_factory=list, max_length=MAX_LISTED, description="The sets of largest mass.")


class Excluded(Part):
    """A POI that does not come into question for a person."""

    poi_id: Name
    reason: Text = Field(description="Why, e.g. 'behind a wall'.")


CREDIBLE = (
    "The fewest POIs, the likeliest first, among which the one meant is with a probability of 0.9 (setting `answer.credible`); "
    "the first of them."
)
EXCLUDED = (
    "POIs of the registry that do not come into question, and why: the first of them, the nearest to the person first. State "
    "and Target have them, a Belief leaves them out."
)
CONTOUR_CONFLICT = (
    "1 - max over POIs of the product of hand's and head's likelihoods, each divided by its largest: 0 where both fit one POI, "
    "near 1 where they contradict each other, at any number of POIs."
)


class PersonBelief(Part):
    """Belief about one person."""

    person_id: Count
    position_m: Position | None = Field(default=None, description="Person's head in the map frame; none where unknown.")
    distance_m: float | None = Field(default=None, ge=0)
    pois: list[PoiBelief] = Field(
        default_factory=list, max_length=MAX_POIS, description="The likeliest of the frame of discernment, best first."
    )
    pois_total: Count = Field(default=0, description="How many POIs the frame of discernment has.")
    unknown: Share = Field(default=1.0, description="Mass of the whole frame of discernment: what is not known.")
    conflict: Share = Field(default=0.0, description="Mass that Dempster's rule divides away, 1 - K.")
    contour_conflict: Share = Field(default=0.0, description=CONTOUR_CONFLICT)
    credible: list[Name] = Field(default_factory=list, max_length=MAX_LISTED, description=CREDIBLE)
    credible_total: Count = Field(default=0, description="How many they are.")
    excluded: list[Excluded] = Field(default_factory=list, max_length=MAX_LISTED, description=EXCLUDED)
    excluded_total: Count = Field(default=0, description="How many they are.")
    evidence: list[Evidence] = Field(default_factory=list, max_length=8)
    reason: Text = Field(default="", description="Why that is thought, in words. State has it, a Belief leaves it out.")
    episode_id: Text | None = Field(default=None, description="Pointing episode that the person is in.")


class Belief(OfFrame):
    """Fusion's answer to one frame."""

    persons: list[PersonBelief] = Field(default_factory=list, max_length=MAX_PERSONS)
    missing: list[Name] = Field(default_factory=list, max_length=8, description="Stages that did not answer for this frame.")


class Target(OfFrame):
    """The POI that a person points at: updates of one episode, the last with `final: true`."""

    episode_id: Text
    person_id: Count
    final: bool
    poi_ids: list[Name] = Field(max_length=MAX_POIS, description="The answer: one, several when tied, none on abstention.")
    pois: list[PoiBelief] = Field(default_factory=list, max_length=MAX_POIS, description="The likeliest, best first.")
    pois_total: Count = Field(default=0, description="How many POIs came into question.")
    conflict: Share = Field(description="Mass that Dempster's rule divides away, 1 - K.")
    contour_conflict: Share = Field(default=0.0, description=CONTOUR_CONFLICT)
    credible: list[Name] = Field(default_factory=list, max_length=MAX_LISTED, description=CREDIBLE)
    credible_total: Count = Field(default=0, description="How many they are.")
    excluded: list[Excluded] = Field(default_factory=list, max_length=MAX_LISTED, description=EXCLUDED)
    excluded_total: Count = Field(default=0, description="How many they are.")
    evidence: list[Evidence] = Field(default_factory=list, max_length=8)
    reason: Text
    started_ns: Nanoseconds
    ended_ns: Nanoseconds
    latency_ms: float = Field(
        ge=0,
        description="Capture of the last frame used to publication, by the clock of the camera's host where that was compared "
        "with fusion's; 0 in lockstep.",
    )
    latency_uncertain_ms: float | None = Field(
        default=None,
        ge=0,
        description="By how much latency_ms may be wrong because the clocks of two hosts go into it. None where they were not "
        "compared, or one was set since: then it is their plain difference, and means nothing. 0 in lockstep.",
    )


class RobotPose(Produced):
    """Pose of `base_link` in the map frame."""

    x_m: Metre
    y_m: Metre
    yaw_deg: Degree = Field(description="Counter-clockwise from the map's x axis.")


class SourceState(Part):
    """How fusion sees one stage it listens to."""

    stage: Name
    status: SourceStatus
    producers: list[Text] = Field(default_factory=list, max_length=8, description="Processes heard lately as `stage/instance`.")
    age_s: float | None = Field(default=None, ge=0, description="Since the last accepted message; none if there was none.")
    received: Count = 0
    rejected: Count = 0
    reason: Text = ""


class RejectedEdit(Part):
    """A registry edit that was refused."""

    key: Text
    reason: Text = Field(description="Names the field.")
    stamp_ns: Nanoseconds


class State(Produced):
    """Everything fusion knows, answered to a get.

    Lists of POIs are cut to the best or first few; `?top=N` asks for more of them, `?poi=ID` for one.
    """

    VERSION: ClassVar[int] = 2

    robot: Name
    sources: list[SourceState] = Field(max_length=16)
    robot_pose: RobotPose | None = None
    pois: list[Poi] = Field(max_length=MAX_POIS, description="The first by id; `fusion/poi/**` gives all.")
    pois_total: Count = Field(default=0, description="How many POIs the registry holds.")
    persons: list[PersonBelief] = Field(max_length=MAX_PERSONS)
    run: Count = Field(default=0, description="Run of the last frame answered.")
    last_seq: int = Field(default=-1, ge=-1, le=2**63 - 1, description="Last frame answered.")
    open_episodes: list[Text] = Field(default_factory=list, max_length=MAX_PERSONS)
    recent_targets: list[Target] = Field(default_factory=list, max_length=16, description="Final answers, newest last.")
    registry_path: Text = ""
    edits_accepted: Count = 0
    edits_rejected: Count = 0
    edits_lost: Count = Field(default=0, description="Edits without an answer that came faster than they could be kept.")
    rejected_edits: list[RejectedEdit] = Field(default_factory=list, max_length=16, description="Newest last.")


# --- every stage ------------------------------------------------------------------------------------------------------


class InputHealth(Part):
    """One key that a stage listens to."""

    key: Text
    received: Count = 0
    used: Count = 0
    overwritten: Count = Field(default=0, description="Replaced by a newer one before the stage came to it.")
    too_old: Count = Field(default=0, description="Dropped: older than the topic's age limit when the stage came to it.")
    rejected: Count = Field(default=0, description="Wrong encoding, version or content.")
    last_error: Text = ""
    age_s: float | None = Field(default=None, ge=0, description="Since the last one received.")
    rate_hz: float = Field(default=0.0, ge=0)
    producers: list[Text] = Field(default_factory=list, max_length=8)


class OutputHealth(Part):
    """One key that a stage publishes."""

    key: Text
    published: Count = 0
    oversized: Count = Field(default=0, description="Not published: larger than the topic allows.")
    rate_hz: float = Field(default=0.0, ge=0)


class ClockHealth(Part):
    """The clock of a stage's host beside that of the stage which says so, by questions and answers between the two."""

    stage: Name = Field(description="Stage whose clock it is.")
    host: Text = Field(description="Host of that stage.")
    ahead_s: float = Field(description="How far that clock is ahead of ours; behind: negative.")
    uncertain_s: float = Field(ge=0, description="By how much ahead_s may be wrong: half the quickest round trip, and drift.")


class Health(Produced):
    """Heartbeat of a stage, or of the supervisor of a host's stages. `count` advances only while its loop runs.

    `stamp_ns` is the time of the answer where it answers a get: clocks of hosts are compared by it.
    """

    count: Count
    state: HealthState
    reason: Text = Field(default="", description="Why it is not ok, as one sentence.")
    pid: Count
    host: Text
    router: Text = Field(
        default="",
        description="Zenoh id of the router that the stage is a client of: those with the same one share a host, whatever its "
        "name. Empty where it is not told, or no router is there.",
    )
    uptime_s: float = Field(ge=0)
    cpu_s: float = Field(ge=0, description="Processor time used since the start, user and system.")
    rss_mb: float = Field(ge=0)
    step_ms_p50: float = Field(default=0.0, ge=0, description="Time of one step over the last second.")
    step_ms_max: float = Field(default=0.0, ge=0)
    inputs: list[InputHealth] = Field(default_factory=list, max_length=16)
    outputs: list[OutputHealth] = Field(default_factory=list, max_length=16)
    counters: dict[str, Count] = Field(default_factory=dict, max_length=64, description="Counters of the stage's own.")
    notes: list[Text] = Field(default_factory=list, max_length=16, description="Conditions, e.g. assumed intrinsics.")
    versions: dict[str, Annotated[str, Field(max_length=64)]] = Field(
        default_factory=dict,
        max_length=16,
        description="Versions of what the process runs, by distribution: deixis-schemas, ...",
    )
    clocks: list[ClockHealth] = Field(
        default_factory=list, max_length=8, description="Clocks that the stage compares with its own, for their stamps."
    )
    standing_by: bool = Field(
        default=False,
        description="It works and is not heard: it waits to take the place of another process, or has yielded its own.",
    )


class Voice(Produced):
    """Which of two processes of a stage is heard: the answer to a get of `{stage}/voice/{instance}`."""

    state: VoiceState = Field(
        description="`speaks`: it answers frames, from `run`, `seq` on where they are there. `yields`: up to that frame, and "
        "then `other` does. `stands_by`: it works and is not heard. `asks`: it has asked `other` to yield."
    )
    other: Text = Field(default="", description="Instance with which it changes places or has changed them.")
    run: Count | None = Field(default=None, description="Of the first frame that is the newcomer's; none where all are.")
    seq: Count | None = None
    reason: Text = Field(default="", description="Of one that stands by: why it did not get the place that it asked for last.")


TYPES: dict[str, type[Message]] = {
    cls.__name__: cls
    for cls in (Frame, CameraInfo, Tracks, HeadPoses, Gestures, Belief, Target, State, Poi, RobotPose, Health, Voice)
}
