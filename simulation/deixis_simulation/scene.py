"""A scene as data: all that a clip is made of. The same scene gives the same clip, wherever and whenever it is rendered.

Frames: the map of the site (REP-103: x forward, y left, z up, metres), whose origin is the robot's foot at the start. Headings
are degrees counter-clockwise from the map's x axis, so a person straight ahead who faces the robot has heading 180. Azimuths
are at the person, from the direction person -> camera, positive toward the person's own left (as in the messages).
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from deixis_schemas.codec import say
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

MAX_SCENE_BYTES = 1 << 20

Kind = Literal["point", "quiet", "several", "walk", "turn"]
KINDS: tuple[Kind, ...] = ("point", "quiet", "several", "walk", "turn")
ArmSide = Literal["left", "right"]
ArmStyle = Literal["straight", "bent", "hip"]
HandShape = Literal["index", "flat"]
QuietGesture = Literal[
    "wave", "stop", "thumb", "scratch", "phone", "beats", "drink",
    "hips", "crossed", "chin", "hair", "glasses", "carry", "facepass",
]  # fmt: skip
QUIET_GESTURES: tuple[QuietGesture, ...] = (
    "wave", "stop", "thumb", "scratch", "phone", "beats", "drink",
    "hips", "crossed", "chin", "hair", "glasses", "carry", "facepass",
)  # fmt: skip
WallKind = Literal["plaster", "brick", "wood", "panel"]
FloorKind = Literal["wood", "stone", "carpet"]
LightPreset = Literal["office", "window_left", "window_right", "warm", "hard"]
FurnitureKind = Literal[
    "door", "cabinet", "books", "board", "poster", "plant", "window", "cardboard", "bench", "column"
]  # fmt: skip
ExhibitKind = Literal["vase", "sphere", "cube", "cup", "bust", "picture"]

Second = Annotated[float, Field(ge=0, le=3600)]
Metre = Annotated[float, Field(ge=-100, le=100)]
Degree = Annotated[float, Field(ge=-360, le=360)]
Share = Annotated[float, Field(ge=0, le=1)]
Gain = Annotated[float, Field(gt=0, le=10)]
Colour = Annotated[tuple[Gain, Gain, Gain], Field(description="Red, green, blue factors.")]
Channel = Annotated[int, Field(ge=0, le=255)]
Tone = Annotated[tuple[Channel, Channel, Channel], Field(description="Red, green, blue, 0 to 255.")]
Place = tuple[Metre, Metre]
Position = tuple[Metre, Metre, Metre]
PoiId = Annotated[str, Field(pattern=r"^[A-Za-z0-9_.\-]{1,64}$")]


class SceneError(ValueError):
    """A scene that cannot be rendered; the text names the file, the field and the cause."""


class Part(BaseModel):
    """Part of a scene: unknown fields are refused, so that a misspelt one is not silently the default."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


# --- what people do ---------------------------------------------------------------------------------------------------


class Pointing(Part):
    """One pointing gesture at a POI: preparation, stroke (the arm stands), retraction."""

    type: Literal["point"] = "point"
    start_s: Second = Field(description="Begin of the preparation.")
    preparation_s: float = Field(default=0.55, ge=0.1, le=5)
    hold_s: float = Field(default=1.5, ge=0.1, le=60, description="Duration of the stroke.")
    retraction_s: float = Field(default=0.55, ge=0.1, le=5)
    poi: PoiId
    arm: ArmSide
    style: ArmStyle = Field(default="straight", description="Arm stretched, bent at the elbow, or from the hip.")
    hand: HandShape = "index"
    looks: Literal["poi", "robot", "elsewhere"] = Field(default="poi", description="Where the head turns to.")
    elsewhere_deg: Degree = Field(default=0.0, description="Azimuth of the head where it looks elsewhere.")
    head_gain: float = Field(
        default=1.0, ge=0, le=1.1, description="Share of the turn that the head does; the eyes do the rest."
    )
    head_lag_s: float = Field(default=-0.07, ge=-0.5, le=1, description="Head after the arm; negative: before it.")
    head_overshoot_deg: float = Field(default=0.0, ge=-10, le=10)
    torso_gain: float = Field(default=1.0, ge=0, le=2, description="Turn of the trunk, 1: as people usually do.")
    pronation_deg: float = Field(default=45.0, ge=-90, le=120, description="Turn of the forearm about its axis.")

    @property
    def end_s(self) -> float:
        """End of the retraction."""
        return self.start_s + self.preparation_s + self.hold_s + self.retraction_s


class Quiet(Part):
    """A gesture that is no pointing."""

    type: Literal["quiet"] = "quiet"
    gesture: QuietGesture
    start_s: Second
    preparation_s: float = Field(default=0.55, ge=0.1, le=5)
    hold_s: float = Field(default=2.0, ge=0.1, le=60)
    retraction_s: float = Field(default=0.55, ge=0.1, le=5)
    arm: ArmSide = "right"
    rate_hz: float = Field(default=2.0, gt=0, le=6, description="Of what is repeated: waving, scratching.")

    @property
    def end_s(self) -> float:
        """End of the retraction."""
        return self.start_s + self.preparation_s + self.hold_s + self.retraction_s


class HeadTurn(Part):
    """A look to the side, and back."""

    type: Literal["turn"] = "turn"
    start_s: Second
    azimuth_deg: Degree
    pitch_deg: float = Field(default=0.0, ge=-40, le=40)
    turn_s: float = Field(default=0.6, ge=0.15, le=5, description="Duration of the way there, and of that back.")
    hold_s: float = Field(default=1.0, ge=0, le=60)
    torso_gain: float = Field(default=0.35, ge=0, le=2)

    @property
    def end_s(self) -> float:
        """When the head is back."""
        return self.start_s + 2 * self.turn_s + self.hold_s


class Walk(Part):
    """A walk to a place; then the person turns to `heading_deg`."""

    type: Literal["walk"] = "walk"
    start_s: Second
    to_m: Place
    speed_m_s: float = Field(default=1.1, ge=0.2, le=2.5)
    heading_deg: Degree | None = Field(default=None, description="Heading after it; none: toward the robot.")
    glance_s: tuple[Second, Second] | None = Field(default=None, description="When the head looks at the robot meanwhile.")


Action = Annotated[Pointing | Quiet | HeadTurn | Walk, Field(discriminator="type")]


class Person(Part):
    """One person: body, place, and what it does in order of time."""

    avatar: str = Field(pattern=r"^[A-Za-z0-9_]{1,64}$", description="Name of a packed avatar.")
    height_m: float = Field(default=1.75, ge=1.1, le=2.1)
    skin_tint: Colour = (1.0, 1.0, 1.0)
    clothes_tint: Colour = (1.0, 1.0, 1.0)
    hair_tint: Colour = (1.0, 1.0, 1.0)
    place_m: Place
    heading_deg: Degree = 180.0
    head_deg: tuple[Degree, Degree, Degree] = Field(default=(0.0, 0.0, 0.0), description="Usual yaw, pitch, roll of the head.")
    restlessness: float = Field(default=1.0, ge=0, le=3, description="Size of sway and jitter.")
    actions: list[Action] = Field(default_factory=list, max_length=32)


# --- where ------------------------------------------------------------------------------------------------------------


class ScenePoi(Part):
    """A point of interest; `exhibit` says what stands there, none: nothing is drawn."""

    poi_id: PoiId
    position_m: Position
    name: str = Field(default="", max_length=200)
    exhibit: ExhibitKind | None = None
    tone: Tone = (120, 120, 120)


class Furniture(Part):
    """Something at the back wall; `along_m` is its place along the wall, the map's y."""

    kind: FurnitureKind
    along_m: Metre
    off_wall_m: float = Field(default=0.0, ge=0, le=10, description="Distance in front of the wall.")
    tone: Tone | None = None


class Room(Part):
    """A box of walls around robot and persons. Walls of a site (`walls`) are drawn besides, from floor to ceiling."""

    front_x_m: Metre = Field(default=5.0, description="Map x of the wall that the camera looks at.")
    back_x_m: Metre = Field(default=-3.5, description="Map x of the wall behind the robot.")
    left_y_m: Metre = 4.4
    right_y_m: Metre = -4.4
    ceiling_m: float = Field(default=3.0, ge=2.2, le=20)
    wall: WallKind = "plaster"
    wall_tone: Tone = (205, 203, 196)
    side_tone: Tone = (205, 203, 196)
    floor: FloorKind = "wood"
    floor_tone: Tone = (128, 92, 62)
    furniture: list[Furniture] = Field(default_factory=list, max_length=32)
    walls: list[tuple[Place, Place]] = Field(default_factory=list, max_length=200)

    @model_validator(mode="after")
    def _has_an_inside(self) -> Self:
        if self.back_x_m >= self.front_x_m or self.right_y_m >= self.left_y_m:
            raise ValueError("front_x_m, left_y_m: not beyond back_x_m, right_y_m")
        return self

    def holds(self, place_m: Place) -> bool:
        """Whether a place lies between the walls."""
        return self.back_x_m < place_m[0] < self.front_x_m and self.right_y_m < place_m[1] < self.left_y_m


class LightChange(Part):
    """From `at_s` on the light goes to `gain` times the usual, within `over_s`."""

    at_s: Second
    gain: float = Field(ge=0.02, le=10)
    over_s: float = Field(default=0.1, ge=0, le=60)


class Light(Part):
    """Lamps and windows, and what they do."""

    preset: LightPreset = "office"
    tint: Colour = (1.0, 1.0, 1.0)
    changes: list[LightChange] = Field(default_factory=list, max_length=32)
    flicker_depth: Share = 0.0
    flicker_hz: float = Field(default=3.0, gt=0, le=60)
    auto_exposure: bool = Field(default=True, description="The camera follows changes of the light, slowly.")


# --- camera -----------------------------------------------------------------------------------------------------------


class Waypoint(Part):
    """Where the robot is at a time. Between waypoints it goes smoothly; before the first and after the last it stands."""

    at_s: Second
    x_m: Metre = 0.0
    y_m: Metre = 0.0
    yaw_deg: Degree = 0.0


class Camera(Part):
    """A pinhole camera on the robot, mounted as a site file says it (`CameraMount`)."""

    width: int = Field(default=640, ge=160, le=4096, multiple_of=2)
    height: int = Field(default=480, ge=120, le=4096, multiple_of=2)
    horizontal_fov_deg: float = Field(default=60.0, ge=20, le=120)
    position_m: Position = (0.0, 0.0, 1.3)
    yaw_deg: Degree = 0.0
    pitch_up_deg: float = Field(default=0.0, ge=-60, le=60)
    roll_deg: float = Field(default=0.0, ge=-45, le=45)

    @property
    def focal_px(self) -> float:
        """Focal length, pixels."""
        return self.width / 2 / math.tan(math.radians(self.horizontal_fov_deg) / 2)


class Sensor(Part):
    """What lens, sensor, image processing and compression do to the light."""

    exposure: float = Field(default=1.0, ge=0.1, le=10, description="Brightness, 1: well exposed.")
    shutter_s: float = Field(default=1 / 60, ge=1e-4, le=1 / 15)
    noise: float = Field(default=1.0, ge=0, le=10)
    blur_px: float = Field(default=0.55, ge=0.3, le=4)
    sharpening: float = Field(default=0.45, ge=0, le=2)
    saturation: float = Field(default=1.0, ge=0, le=2)
    contrast: float = Field(default=0.1, ge=-0.5, le=0.5)
    white_balance: Colour = Field(default=(1.0, 1.0, 1.0), description="Error of the white balance.")
    quality_crf: float = Field(default=20.0, ge=0, le=40, description="Compression (x264 rate factor): more is coarser.")


# --- the scene --------------------------------------------------------------------------------------------------------


class Scene(Part):
    """All of a clip. `seed` moves what is not said here: noise of textures and sensor, sway, blinks."""

    name: str = Field(default="scene", pattern=r"^[A-Za-z0-9_.\-]{1,100}$")
    kind: Kind = "point"
    seed: int = Field(default=0, ge=0, lt=2**63)
    duration_s: float = Field(gt=0, le=600)
    fps: int = Field(default=30, ge=1, le=120)
    camera: Camera = Camera()
    robot_path: list[Waypoint] = Field(default_factory=list, max_length=64, description="Empty: the robot stands.")
    sensor: Sensor = Sensor()
    light: Light = Light()
    room: Room = Room()
    pois: list[ScenePoi] = Field(default_factory=list, max_length=256)
    people: list[Person] = Field(default_factory=list, max_length=7)

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        known = {poi.poi_id for poi in self.pois}
        if len(known) != len(self.pois):
            raise ValueError("pois: a poi_id stands twice")
        for number, person in enumerate(self.people):
            wanted = {action.poi for action in person.actions if isinstance(action, Pointing)} - known
            if wanted:
                raise ValueError(f"people.{number}.actions: no POI '{min(wanted)}' in pois")
            if not self.room.holds(person.place_m):
                raise ValueError(f"people.{number}.place_m: {person.place_m} is outside the room: it would be labelled unseen")
        times = [point.at_s for point in self.robot_path]
        if times != sorted(set(times)):
            raise ValueError("robot_path: at_s does not grow from waypoint to waypoint")
        return self

    @property
    def frames(self) -> int:
        """Number of frames of the clip."""
        return max(1, round(self.duration_s * self.fps))


def load_scene(path: Path) -> Scene:
    """Read a scene from YAML, or from a clip's JSON, which holds its own. Raises SceneError that names file and field."""
    try:
        if path.stat().st_size > (64 << 20 if path.suffix == ".json" else MAX_SCENE_BYTES):
            raise SceneError(f"scene '{path}': the file is too large")
        content: Any = yaml.safe_load(path.read_text(encoding="utf-8")) if path.suffix != ".json" else _of_clip(path)
    except OSError as error:
        raise SceneError(f"scene '{path}' cannot be read: {error.strerror or error}") from None
    except (ValueError, RecursionError, yaml.YAMLError) as error:
        raise SceneError(f"scene '{path}' is not YAML: {error}") from None
    try:
        return Scene.model_validate(content)
    except ValidationError as error:
        raise SceneError(f"scene '{path}': {say(error)}") from None


def _of_clip(path: Path) -> Any:
    content = json.loads(path.read_text(encoding="utf-8"))
    return content.get("meta", {}).get("scene", content) if isinstance(content, dict) else content


def dump_scene(scene: Scene) -> str:
    """The scene as YAML."""
    return yaml.safe_dump(scene.model_dump(mode="json"), sort_keys=False, width=120)
