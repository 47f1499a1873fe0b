"""What a clip's labels say of the whole clip, its scene among it: with that it can be rendered again."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from .bearings import azimuth_of
from .geometry import robot_at, to_world, view_at
from .pixels import rounded
from .scene import Scene
from .truth_camera import camera_truth, labels_origin

DRAWN_NAME = re.compile(r"[ps](\d+)_(\d+)_[a-z]+")
"""Of scenes drawn at random: seed and index."""
CONVENTIONS = (
    "azimuth/yaw: at the person, from the direction person -> camera, + toward image right (the person's own left). "
    "pitch + up, roll + head top to image right. head.yaw/pitch/roll: camera axes (R_cam, basis x_cam, -y_cam, -z_cam, "
    "identity = frontal); yaw_rel_deg: to the line head -> camera. World: X image right at the start, Y up, Z from the first "
    "person's start toward the robot; map x = x_ref_m - Z, map y = -X. robot_xy: x forward, y left from the camera's foot at "
    "that frame. frames[].camera and .robot (map) stand where the robot moves."
)
LABEL_BITS = (
    "labels.npz: per frame fNNNN a PNG; person << 5 | skin << 4 | part; part 1 head 2 neck 3 right hand 4 left hand "
    "5 right arm 6 left arm 7 other; 0 background"
)


def meta_truth(scene: Scene, skin_tones: Mapping[int, dict[str, Any]]) -> dict[str, Any]:
    """Of `meta`. `skin_tones`: what was measured of the faces, by person."""
    seed, index = seed_and_index(scene)
    return {
        "name": scene.name,
        "kind": scene.kind,
        "seed": seed,
        "index": index,
        "fps": scene.fps,
        "width": scene.camera.width,
        "height": scene.camera.height,
        "n_frames": scene.frames,
        "duration_s": scene.duration_s,
        "camera": camera_truth(scene, view_at(scene.camera, robot_at(scene.robot_path, 0.0)), labels_origin(scene)),
        "conventions": CONVENTIONS,
        "label_bits": LABEL_BITS,
        "hand_center": "area",
        "light": scene.light.preset,
        "shutter_s": scene.sensor.shutter_s,
        "sensor": scene.sensor.model_dump(mode="json"),
        "persons": [_person(scene, number, skin_tones.get(number, {})) for number in range(len(scene.people))],
        "pois": [_poi(scene, number) for number in range(len(scene.pois))],
        "x_ref_m": float(labels_origin(scene)[2]),
        "generator": generator(),
        "avatars": "VALID avatars, MIT License, copyright 2022 Tiffany Do; glTF conversion c-frame/valid-avatars-glb, MIT",
        "scene": scene.model_dump(mode="json"),
    }


def generator() -> str:
    """Name and version of what renders: a clip of another version is not the same clip."""
    try:
        return f"deixis-simulation {version('deixis-simulation')}"
    except PackageNotFoundError:
        return "deixis-simulation"


def seed_and_index(scene: Scene) -> tuple[int, int] | tuple[None, None]:
    """Where a drawn scene comes from, by its name; none of another scene."""
    match = DRAWN_NAME.fullmatch(scene.name)
    return (int(match[1]), int(match[2])) if match else (None, None)


def _person(scene: Scene, number: int, tone: dict[str, Any]) -> dict[str, Any]:
    person = scene.people[number]
    return {
        "id": number,
        "avatar": person.avatar,
        "skin_tint": list(person.skin_tint),
        "root_world": rounded(to_world(person.place_m) + labels_origin(scene), 3),
        "height_m": person.height_m,
        "events": [action.model_dump(mode="json") for action in person.actions],
        **tone,
    }


def _poi(scene: Scene, number: int) -> dict[str, Any]:
    poi = scene.pois[number]
    place = (poi.position_m[0], poi.position_m[1])
    person = scene.people[0].place_m if scene.people else (float(labels_origin(scene)[2]), 0.0)
    return {
        "id": poi.poi_id,
        "xyz_world": rounded(to_world(poi.position_m) + labels_origin(scene), 5),
        "azimuth_deg": round(azimuth_of(person, scene.camera.position_m[:2], place), 2),
        "dist_user_m": round(math.dist(person, place), 3),
        "render": poi.exhibit is not None,
    }
