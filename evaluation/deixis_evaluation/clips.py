"""Labelled clips: NAME.mp4 with its truth in NAME.json. Pixels, metres and degrees as in the messages."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Literal, Self

import numpy as np
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.codec import say
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

MAX_LABEL_BYTES = 64 << 20
# Of R times its transpose from the identity: labels are rounded to six digits or so.
MAX_SKEW = 1e-3

Number = Annotated[float, Field(ge=-1e6, le=1e6)]
Point = tuple[Number, Number]
Box = tuple[Number, Number, Number, Number]
Vector = tuple[Number, Number, Number]
Matrix = tuple[float, float, float, float, float, float, float, float, float]
TruthPhase = Literal["none", "preparation", "stroke", "retraction"]
SideName = Literal["left", "right"]


class ClipError(ValueError):
    """Labelled clips that cannot be used; the text names the file, the field and the cause."""


class _Label(BaseModel):
    model_config = ConfigDict(extra="ignore", allow_inf_nan=False, frozen=True)


class TrueHead(_Label):
    """Head of a person; `yaw_rel_deg` is relative to the line from head to camera, `center_cam` in camera axes.

    R_cam: row-major rotation to axes x to the picture's right, y up, z toward the camera; identity for a head that looks along
    the optical axis into the camera.
    """

    yaw_rel_deg: float
    center_px: Point
    center_cam: Vector | None = None
    R_cam: Annotated[list[Number], Field(min_length=9, max_length=9)] | None = None

    @model_validator(mode="after")
    def _is_turned(self) -> Self:
        if self.R_cam is not None and not is_rotation(np.array(self.R_cam, np.float64).reshape(3, 3)):
            raise ValueError("R_cam: not a rotation")
        return self


class TrueFace(_Label):
    """Face of a person: x, y, width, height of what is visible, none where nothing is."""

    bbox_visible: Box | None = None
    centroid_visible_px: Point | None = None
    visible_px: int = Field(ge=0)


class TrueHand(_Label):
    """One hand. Its `bbox_visible` is not read: stray pixels of the label image stretch it over half the body."""

    center_px: Point
    centroid_visible_px: Point | None = None
    bbox_amodal: Box | None = None
    index_tip_px: Point | None = None
    visible_px: int = Field(ge=0)
    in_frame: bool


class TrueHands(_Label):
    """Both hands; left and right are the person's own."""

    left: TrueHand
    right: TrueHand

    def sides(self) -> tuple[tuple[SideName, TrueHand], ...]:
        """Both with their names."""
        return ("left", self.left), ("right", self.right)


class TrueArm(_Label):
    """The gesturing arm; no side while none gestures. `eye_tip_azimuth_deg`: from between the eyes over the fingertip."""

    side: SideName | None = None
    eye_tip_azimuth_deg: float | None = None


class TrueUserPos(_Label):
    """Where the person stands: map frame from the camera's foot, and distance from there, metres."""

    robot_xy: Point
    distance_m: float = Field(gt=0, le=1000)


class TruePerson(_Label):
    """One person in one frame."""

    id: int = Field(ge=0)
    phase: TruthPhase
    gesture: str
    nonpoint_phase: TruthPhase | None = None
    poi: str | None = None
    poi_azimuth_deg: float | None = None
    head: TrueHead
    face: TrueFace
    hands: TrueHands
    arm: TrueArm = TrueArm()
    user_pos: TrueUserPos

    @model_validator(mode="after")
    def _stroke_has_a_target(self) -> Self:
        if self.points and (self.poi is None or self.poi_azimuth_deg is None):
            raise ValueError("poi: a pointing stroke needs poi and poi_azimuth_deg")
        return self

    @property
    def points(self) -> bool:
        """Whether this is the stroke of a pointing gesture."""
        return self.phase == "stroke" and self.gesture == "point"

    @property
    def raised(self) -> SideName | None:
        """The hand that is held up: the gesturing one during any stroke, pointing or not."""
        return self.arm.side if "stroke" in (self.phase, self.nonpoint_phase) else None


class TrueView(_Label):
    """Where a camera is and how it is turned, OpenCV axes: x_camera = R x_world + t."""

    R_world_to_cam: Annotated[list[Number], Field(min_length=9, max_length=9)]
    t_world_to_cam: Vector

    @model_validator(mode="after")
    def _looks_ahead(self) -> Self:
        if math.hypot(self.R_world_to_cam[6], self.R_world_to_cam[8]) < 1e-3:
            raise ValueError("R_world_to_cam: the camera looks straight up or down; it has no forward direction")
        if not is_rotation(self.rotation):
            raise ValueError("R_world_to_cam: not a rotation")
        return self

    @property
    def rotation(self) -> NDArray[np.float64]:
        """R (3, 3): its rows are the camera's right, down and ahead in the world."""
        return np.array(self.R_world_to_cam, np.float64).reshape(3, 3)

    @property
    def centre(self) -> NDArray[np.float64]:
        """Optical centre (3,), world, metres."""
        return np.asarray(-self.rotation.T @ np.array(self.t_world_to_cam), np.float64)


class TrueFrame(_Label):
    """One frame of the file, by its index. `camera`: where it was then, of a camera that moves."""

    frame: int = Field(ge=0)
    persons: list[TruePerson] = Field(default_factory=list, max_length=32)
    camera: TrueView | None = None


class TrueCamera(TrueView):
    """The pinhole camera; one that moves, as it is in frame 0. The mount is read from R and t, which are exact."""

    K: tuple[Vector, Vector, Vector]
    dist: list[Number] = Field(default_factory=list, max_length=14)

    @model_validator(mode="after")
    def _projects(self) -> Self:
        if self.K[0][0] <= 0 or self.K[1][1] <= 0:
            raise ValueError("K: focal lengths are not positive")
        return self

    @property
    def matrix(self) -> Matrix:
        """K, row-major."""
        (a, b, c), (d, e, f), (g, h, i) = self.K
        return a, b, c, d, e, f, g, h, i

    @property
    def distortion_model(self) -> Literal["plumb_bob", "rational_polynomial"]:
        """What the coefficients in `dist` are, as ROS names it."""
        return "plumb_bob" if len(self.dist) <= 5 else "rational_polynomial"


class TruePoi(_Label):
    """A point of interest, world frame (x toward image right, y up, z toward the camera)."""

    id: str = Field(pattern=r"^[A-Za-z0-9_.\-]{1,64}$")
    xyz_world: Vector


class TrueAction(_Label):
    """What a rendered person was told to do; times in seconds of the clip. The words only sort clips."""

    type: str = Field(max_length=64)
    start_s: float = 0.0
    preparation_s: float = 0.0
    hold_s: float = 0.0
    retraction_s: float = 0.0
    style: str | None = Field(default=None, max_length=64)
    hand: str | None = Field(default=None, max_length=64)
    looks: str | None = Field(default=None, max_length=64)

    @property
    def end_s(self) -> float:
        """End of the retraction."""
        return self.start_s + self.preparation_s + self.hold_s + self.retraction_s


class TrueActor(_Label):
    """A rendered person; persons of the frames are numbered by their place in the scene."""

    height_m: float = Field(gt=0, le=3)
    actions: list[TrueAction] = Field(default_factory=list, max_length=64)


class TrueScene(_Label):
    """The scene that a clip was rendered from, so far as clips are sorted by it."""

    people: list[TrueActor] = Field(default_factory=list, max_length=32)


class TrueLooks(_Label):
    """How a person looks: `face_ITA_deg` is the measured skin tone."""

    id: int = Field(ge=0)
    face_ITA_deg: float | None = None


class TrueMeta(_Label):
    """What holds for the whole clip."""

    kind: str = Field(max_length=64)
    fps: float = Field(gt=0, le=1000)
    width: int = Field(ge=1, le=8192)
    height: int = Field(ge=1, le=8192)
    camera: TrueCamera
    pois: list[TruePoi] = Field(default_factory=list, max_length=1024)
    persons: list[TrueLooks] = Field(default_factory=list, max_length=32)
    scene: TrueScene | None = None

    @property
    def horizontal_fov_deg(self) -> float:
        """Width of the view, degrees."""
        return 2 * math.degrees(math.atan(self.width / 2 / self.camera.K[0][0]))


class Truth(_Label):
    """Content of a label file."""

    meta: TrueMeta
    frames: list[TrueFrame] = Field(min_length=1)

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        known = {poi.id for poi in self.meta.pois}
        if len(known) != len(self.meta.pois):
            raise ValueError("meta.pois: an id stands twice")
        for index, frame in enumerate(self.frames):
            if frame.frame != index:
                raise ValueError(f"frames.{index}.frame: is {frame.frame}, but frames are numbered from 0 without gaps")
            for person in frame.persons:
                if person.points and person.poi not in known:
                    raise ValueError(f"frames.{index}.persons: poi '{person.poi}' is not in meta.pois")
        if self.moves:
            without = next((frame.frame for frame in self.frames if frame.camera is None), None)
            if without is not None:
                raise ValueError(f"frames.{without}.camera: missing, but other frames have it")
        return self

    @property
    def moves(self) -> bool:
        """Whether the camera moves."""
        return any(frame.camera is not None for frame in self.frames)

    def face_width_px(self, person: TruePerson) -> float:
        """Width of the person's face in the picture, as seen from the front at its distance."""
        return self.meta.camera.K[0][0] * FACE_WIDTH_M / person.user_pos.distance_m

    def in_picture(self, point: Point) -> bool:
        """Whether a pixel lies inside the picture."""
        return 0 <= point[0] < self.meta.width and 0 <= point[1] < self.meta.height

    @property
    def person_ids(self) -> tuple[int, ...]:
        """The persons that appear in the clip."""
        return tuple(sorted({person.id for frame in self.frames for person in frame.persons}))


@dataclass(frozen=True)
class Clip:
    """A video with its truth."""

    name: str
    video: Path
    truth: Truth


def is_rotation(matrix: NDArray[np.float64]) -> bool:
    """Whether a matrix (3, 3) is a rotation, but for the digits that labels leave out."""
    return bool(np.abs(matrix @ matrix.T - np.eye(3)).max() <= MAX_SKEW and np.linalg.det(matrix) > 0)


def load_clips(folder: Path, pattern: str = "*") -> list[Clip]:
    """All labelled clips of a folder whose name fits the glob `pattern`, by name.

    Raises ClipError where the folder is missing or holds no such clip, or where a label file or a video is missing or bad.
    """
    if not folder.is_dir():
        raise ClipError(f"'{folder}' is not a folder of labelled clips")
    videos = {path.stem: path for path in sorted(folder.glob("*.mp4"))}
    labels = {path.stem: path for path in sorted(folder.glob("*.json"))}
    wanted = [name for name in videos if fnmatchcase(name, pattern)]
    if not wanted:
        raise ClipError(f"'{folder}' holds no clip named {pattern}.mp4" if videos else f"'{folder}' holds no clips (NAME.mp4)")
    _refuse_unlabelled(folder, (name for name in wanted if name not in labels))
    return [Clip(name, videos[name], load_truth(labels[name])) for name in wanted]


def load_truth(path: Path) -> Truth:
    """Read a label file. Raises ClipError that names file and field."""
    try:
        if path.stat().st_size > MAX_LABEL_BYTES:
            raise ClipError(f"label file '{path}': larger than {MAX_LABEL_BYTES} bytes")
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ClipError(f"label file '{path}' cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError) as error:
        raise ClipError(f"label file '{path}' is not JSON: {error}") from None
    try:
        return Truth.model_validate(content)
    except ValidationError as error:
        raise ClipError(f"label file '{path}': {say(error)}") from None


def _refuse_unlabelled(folder: Path, names: Iterable[str]) -> None:
    missing = [f"{name}.json" for name in names]
    if missing:
        raise ClipError(f"'{folder}': no label file {', '.join(missing[:3])}{' and more' if len(missing) > 3 else ''}")
