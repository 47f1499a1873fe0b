"""Renders one scene: NAME.mp4, NAME.json and, on request, NAME_labels.npz."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .actor import Actor, Moment
from .avatars import load_avatar
from .clip_files import ClipFiles, packed, publish, write_pictures, write_truth
from .encode import Encoder
from .geometry import View, robot_at, view_at
from .label_image import Labels, face_mask
from .lights import picture_gains
from .pixels import pixel
from .scene import Scene
from .sensor import SensorModel
from .skin_tone import skin_tone
from .skinning import Mesh
from .stage import Stage, subframes_for
from .truth import SIDES, Seen, TruthWriter
from .truth_meta import meta_truth

Picture = NDArray[np.uint8]


def render_clip(
    scene: Scene, folder: Path, workplace: Path, *, labels: bool = False, on_frame: Callable[[], None] = lambda: None
) -> None:
    """Render a scene into a folder; files are made in `workplace`, on the same disk, and moved there when all are whole.

    Raises RenderError without OpenGL, AvatarError for unknown people, OSError where files cannot be written.
    """
    made = ClipFiles(workplace, scene.name)
    camera, images = scene.camera, []
    clip = _Clip(scene)
    try:
        with Encoder(made.video, camera.width, camera.height, scene.fps, scene.sensor.quality_crf) as encoder:
            for number in range(scene.frames):
                picture, seen = clip.render(number)
                encoder.write(picture)
                if labels:
                    images.append(packed(seen))
                on_frame()
    finally:
        clip.close()
    if labels:
        write_pictures(made.pictures, images)
    write_truth(made.truth, meta_truth(scene, clip.skin_tones), clip.truth)
    publish(made, folder)


class _Clip:
    """The frames of a scene, one after the other. truth: of those that are rendered; skin_tones: of the first, by person."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._avatars = [load_avatar(person.avatar) for person in scene.people]
        self._actors = [Actor(person, scene, number) for number, person in enumerate(scene.people)]
        self._stage = Stage(scene, self._avatars)
        self._sensor = SensorModel(scene)
        self._gains = picture_gains(scene)
        self._writer = TruthWriter(scene)
        self.truth: list[dict[str, Any]] = []
        self.skin_tones: dict[int, dict[str, Any]] = {}

    def close(self) -> None:
        """Give the renderer back."""
        self._stage.close()

    def render(self, number: int) -> tuple[Picture, Labels]:
        """Picture and label image of the next frame; time 0 is the middle of the first exposure."""
        time_s = number / self._scene.fps
        robot = robot_at(self._scene.robot_path, time_s)
        view = view_at(self._scene.camera, robot)
        moments = self._moments(time_s)
        meshes = self._meshes(moments)
        light = self._stage.picture(view, self._exposure(time_s, view, meshes))
        if number == 0:
            self._sensor.meter(light)
        picture = self._sensor.expose(light, number, self._gains[number])
        labels = self._stage.labels(view, meshes)
        seen = [Seen(*person) for person in zip(self._avatars, moments, (mesh.vertices for mesh in meshes), strict=True)]
        self.truth.append(self._writer.frame(number, view, robot, seen, labels, self._gains[number]))
        if number == 0:
            self.skin_tones = {person: skin_tone(picture, face_mask(labels, person)) for person in range(len(seen))}
        return picture, labels

    def _exposure(self, time_s: float, view: View, middle: list[Mesh]) -> list[list[Mesh]]:
        """The people at moments spread over the time that the shutter is open; one alone is the middle."""
        count = subframes_for(self._motion_px(time_s, view))
        shutter_s = self._scene.sensor.shutter_s
        times = [time_s + ((number + 0.5) / count - 0.5) * shutter_s for number in range(count)]
        return [middle] if count == 1 else [self._meshes(self._moments(at_s)) for at_s in times]

    def _moments(self, time_s: float) -> list[Moment]:
        return [actor.moment(max(time_s, 0.0)) for actor in self._actors]

    def _meshes(self, moments: Sequence[Moment]) -> list[Mesh]:
        return [actor.mesh(moment) for actor, moment in zip(self._actors, moments, strict=True)]

    def _motion_px(self, time_s: float, view: View) -> float:
        """Way of the fastest head or hand in the picture while the shutter is open."""
        half_s = self._scene.sensor.shutter_s / 2
        begin, end = (_limb_pixels(self._moments(time_s + step_s), view) for step_s in (-half_s, half_s))
        return float(np.abs(end - begin).max(initial=0.0))


def _limb_pixels(moments: Sequence[Moment], view: View) -> NDArray[np.float64]:
    points = [point for moment in moments for point in (moment.head_centre, *(moment.fingertip[side] for side in SIDES))]
    return np.array([pixel(point, view, 3) for point in points])
