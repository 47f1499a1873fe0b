"""The guest's core: a picture and the faces in it -> head poses. One instance per camera."""

from __future__ import annotations

from collections.abc import Sequence

from deixis_runtime.lens import Lens
from deixis_schemas.messages import HeadPose, Track

from .angles import yaw_of
from .config import HeadposeConfig
from .head import Head
from .mesh import FaceMesh, Picture


class HeadPoseEstimator:
    """Reads the head of each person that has a face track."""

    def __init__(self, config: HeadposeConfig) -> None:
        self._config = config
        self._run: int | None = None
        # A graph takes a tenth of a second to make: the first one now, and not within a frame.
        self._free = [FaceMesh(config.mesh_confidence)]
        self._meshes: dict[int, FaceMesh] = {}
        self._heads: dict[int, Head] = {}
        self.left_out = 0  # faces of the last frame beyond `max_persons`

    def update(self, image: Picture, tracks: Sequence[Track], lens: Lens, run: int) -> list[HeadPose]:
        """The heads in a picture (H, W, 3) uint8 BGR taken through `lens`. Another run of the camera starts anew."""
        if run != self._run:
            self._run, self._heads = run, {}
            self._release(set())
        faces = {track.person_id: track for track in tracks if track.kind == "face" and track.person_id is not None}
        largest = sorted(faces.items(), key=lambda item: -item[1].bbox_px[2])
        chosen = dict(largest[: self._config.max_persons])
        self.left_out = len(faces) - len(chosen)
        self._release(set(chosen))
        size = image.shape[1], image.shape[0]
        return [self._look(image, person_id, chosen[person_id], lens, size) for person_id in sorted(chosen)]

    def _look(self, image: Picture, person_id: int, face: Track, lens: Lens, size: tuple[int, int]) -> HeadPose:
        head = self._heads.setdefault(person_id, Head(person_id, self._config))
        mesh = self._mesh_of(person_id).find(image, face.bbox_px)
        return head.look(None if mesh is None else yaw_of(mesh, lens.pinhole_at(face.centroid_px, size)))

    def _mesh_of(self, person_id: int) -> FaceMesh:
        if person_id not in self._meshes:
            self._meshes[person_id] = self._free.pop() if self._free else FaceMesh(self._config.mesh_confidence)
        return self._meshes[person_id]

    def _release(self, still_there: set[int]) -> None:
        """Take back the graphs of people who are gone, and forget their heads."""
        for person_id in self._meshes.keys() - still_there:
            mesh = self._meshes.pop(person_id)
            mesh.forget()
            self._free.append(mesh)
            self._heads.pop(person_id, None)
