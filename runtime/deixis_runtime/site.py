"""The site file: one place, its camera, its walls and its points of interest."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import yaml
from deixis_schemas.codec import say
from deixis_schemas.messages import MAX_REGISTERED, Degree, Metre, Poi
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

MAX_SITE_BYTES = 4 << 20
MAX_DEPTH = 100
# The same by libyaml where PyYAML was built with it: 10 000 POIs in a second instead of ten.
LOADER: type[yaml.SafeLoader | yaml.CSafeLoader] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
WallEnd = tuple[Metre, Metre]
WallLine = tuple[WallEnd, WallEnd]
Wall = Annotated[tuple[WallEnd, ...], Field(min_length=2, max_length=1024)]


class SiteError(ValueError):
    """A site file that cannot be used; the text names the file and the field."""


class SitePoi(Poi):
    """A POI as written by a person: a misspelt field is an error, not ignored as on the wire."""

    model_config = ConfigDict(extra="forbid")


class SiteRobotPose(BaseModel):
    """Where `base_link` stands in the map until the robot says otherwise on `robot/pose`."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    x_m: Metre = Field(default=0.0, description="Map x of base_link, metres.")
    y_m: Metre = Field(default=0.0, description="Map y of base_link, metres.")
    yaw_deg: Degree = Field(default=0.0, description="Heading, counter-clockwise from the map's x axis, degrees.")


class Site(BaseModel):
    """Content of a site file. `camera` and `settings` are checked by the stages they are for, which know their fields."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    name: Annotated[str, Field(max_length=200)] = Field(default="", description="For people.")
    camera: dict[str, Any] = Field(default_factory=dict, description="Settings of the camera: source, calibration, mount ...")
    robot_pose: SiteRobotPose = Field(default_factory=SiteRobotPose, description="Start pose of the robot in the map.")
    pois: list[SitePoi] = Field(
        default_factory=list, max_length=MAX_REGISTERED, description="Points of interest in the map frame."
    )
    walls: list[Wall] = Field(
        default_factory=list,
        max_length=4096,
        description="Walls, which hide POIs: lines [[x, y], [x, y]], or polygons of 3 corners and more; map frame, metres.",
    )
    map: Annotated[str, Field(max_length=4096)] = Field(
        default="", description="A ROS map_server YAML beside this file: what is occupied in it are walls, too."
    )
    settings: dict[str, dict[str, Any]] = Field(default_factory=dict, description="Settings of the other stages, by stage.")
    path: Path = Field(default=Path(), exclude=True, description="The file itself; filled in on loading.")

    @property
    def wall_lines(self) -> list[WallLine]:
        """The walls that stand in this file as lines, polygons as their sides. Those of `map`: see `occupancy_map`."""
        lines: list[WallLine] = []
        for wall in self.walls:
            lines += pairwise(wall if len(wall) == 2 else (*wall, wall[0]))
        return lines

    @model_validator(mode="after")
    def _ids_are_unique(self) -> Site:
        seen: set[str] = set()
        for poi in self.pois:
            if poi.poi_id in seen:
                raise ValueError(f"pois: poi_id '{poi.poi_id}' stands twice")
            seen.add(poi.poi_id)
        return self


def load_site(path: Path) -> Site:
    """Read and check a site file. Raises SiteError with file, field and cause."""
    content = read_yaml(path, "site file")
    if "path" in content:
        raise SiteError(f"site file {path}: path: unknown key")
    try:
        return Site.model_validate({**content, "path": path.resolve()})
    except ValidationError as error:
        raise SiteError(f"site file {path}: {say(error)}") from None


def read_yaml(path: Path, what: str) -> dict[str, Any]:
    """The mapping in a YAML file; an empty file is an empty mapping. Raises SiteError."""
    content = load_yaml(path, what)
    if content is None:
        return {}
    if not isinstance(content, dict):
        raise SiteError(f"{what} {path}: not a mapping but {type(content).__name__}")
    return {str(key): value for key, value in content.items()}


def load_yaml(path: Path, what: str) -> Any:
    """Whatever a YAML file holds. Raises SiteError."""
    try:
        if path.stat().st_size > MAX_SITE_BYTES:
            raise SiteError(f"{what} {path}: larger than {MAX_SITE_BYTES} bytes")
        text = path.read_text(encoding="utf-8")
        if _depth(text) > MAX_DEPTH:
            raise SiteError(f"{what} {path}: nested more than {MAX_DEPTH} deep")
        return yaml.load(text, Loader=LOADER)
    except OSError as error:
        raise SiteError(f"{what} {path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise SiteError(f"{what} {path}: not YAML: {' '.join(str(error).split())[:300]}") from None


def _depth(text: str) -> int:
    """How deep the lists and mappings of a YAML text are nested, or one more than may be.

    Read as events: libyaml makes nodes by calling itself for each level, and of too many the process dies.
    """
    depth = deepest = 0
    for event in yaml.parse(text, Loader=LOADER):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            deepest = max(deepest, depth)
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if deepest > MAX_DEPTH:
            break
    return deepest
