"""Renders room and people on the CPU: OpenGL over EGL with Mesa's software renderer, no display and no GPU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

import cv2
import moderngl
import numpy as np
from numpy.typing import NDArray

from .avatars import Avatar
from .geometry import Floats, View
from .lights import MAX_LAMPS, Lighting
from .shadows import ShadowAtlas, coarse_triangles
from .shapes import Shape, joined
from .skinning import Mesh
from .surface import Surface

FloatPicture = NDArray[np.float32]

SAMPLES = 4
NEAR_M, FAR_M = 0.05, 40.0
BRIGHTEST = 30.0
ROOM_SHADOW_RADIUS_M = 3.5
"""Around the middle of the lamps: where furniture and exhibits cast shadows."""
SHADOW_CELL_M = 0.012
"""Details of people that are smaller cast no shadow."""
EYE = 99
"""Stands for the part of the body where it is an eye; the shaders know it as more than 90."""
ROOM_PASSES = 6
"""Passes, each shifted within a pixel, that are averaged for a room that is rendered once: cheaper than samples in each."""
GOLDEN = 0.618034
EDGE_FROM = 0.1
"""Difference among neighbours, of the square root of light, from which on they are an edge."""
SHADE_SCALE = 4
"""Shadows of people on the room are soft: they are rendered at a quarter of the size."""


class RenderError(RuntimeError):
    """The renderer cannot work here; the text says what to install."""


@dataclass(frozen=True)
class Tints:
    """Factors of a person's colours, red, green, blue."""

    skin: Sequence[float] = (1.0, 1.0, 1.0)
    hair: Sequence[float] = (1.0, 1.0, 1.0)
    clothes: Sequence[float] = (1.0, 1.0, 1.0)


@dataclass
class _Drawn:
    """Something on the graphics side. `person` is 0 for the room."""

    positions: moderngl.Buffer
    normals: moderngl.Buffer
    arrays: dict[str, moderngl.VertexArray]
    """By the name of the program."""
    maps: tuple[moderngl.Texture, moderngl.Texture, moderngl.Texture]
    uniforms: dict[str, Any]
    person: int


@dataclass(frozen=True)
class _PeopleTargets:
    """Where people are drawn, for one size of the window around them.

    sampled, cover: how much of a pixel they cover, several samples a pixel and their mean; body, made_of: what they are
    made of; lit: with the light on it.
    """

    sampled: moderngl.Framebuffer
    cover: moderngl.Framebuffer
    body: moderngl.Framebuffer
    made_of: tuple[moderngl.Texture, ...]
    lit: moderngl.Framebuffer
    labels: moderngl.Framebuffer

    @classmethod
    def of(cls, context: moderngl.Context, size: tuple[int, int]) -> _PeopleTargets:
        """New ones."""
        grey = context.renderbuffer(size, 1, samples=SAMPLES)
        made_of = tuple(context.texture(size, 4, dtype=kind) for kind in ("f2", "f2", "f2", "f4"))
        return cls(
            sampled=context.framebuffer([grey], context.depth_renderbuffer(size, samples=SAMPLES)),
            cover=context.framebuffer([context.texture(size, 1)]),
            body=context.framebuffer(made_of, context.depth_renderbuffer(size)),
            made_of=made_of,
            lit=context.framebuffer([context.texture(size, 4, dtype="f2")]),
            labels=context.framebuffer([context.texture(size, 4)], context.depth_renderbuffer(size)),
        )


class Renderer:
    """One scene's room and people. Not to be shared among threads or processes."""

    def __init__(self, width: int, height: int) -> None:
        """Raises RenderError where there is no OpenGL over EGL."""
        self._size = width, height
        try:
            self._context = moderngl.create_context(standalone=True, backend="egl")  # type: ignore[arg-type]
        except Exception as error:  # moderngl raises bare Exception, whatever the cause is
            raise RenderError(
                f"no OpenGL over EGL here ({error}); on Debian: apt-get install libegl1 libgl1-mesa-dri"
            ) from None
        context = self._context
        # Any: moderngl's types do not tell a uniform from a varying.
        self._programs: dict[str, Any] = {
            "room": self._program("surface.vert", "room.frag"),
            "shade": self._program("surface.vert", "shade.frag"),
            "body": self._program("surface.vert", "body.frag"),
            "person": self._program("screen.vert", "person.frag"),
            "cover": self._program("depth.vert", "cover.frag"),
            "depth": self._program("depth.vert", "depth.frag"),
            "label": self._program("surface.vert", "label.frag"),
        }
        self._whole = context.framebuffer([context.texture(self._size, 4, dtype="f2")], context.depth_renderbuffer(self._size))
        self._targets: dict[tuple[int, int], _PeopleTargets] = {}
        corners = context.buffer(_uniform([[-1, -1], [3, -1], [-1, 3]]))
        self._screen = context.vertex_array(self._programs["person"], [(corners, "2f", "in_place")])
        small = width // SHADE_SCALE, height // SHADE_SCALE
        self._small = context.framebuffer([context.texture(small, 4, dtype="f2")], context.depth_renderbuffer(small))
        self._room_shadows, self._people_shadows = ShadowAtlas(context), ShadowAtlas(context)
        self._white = self._texture(np.full((4, 4, 3), 255, np.uint8))
        self._flat = self._texture(np.full((4, 4, 3), (128, 128, 255), np.uint8))
        context.enable(moderngl.DEPTH_TEST)
        context.depth_func = "<="
        self._room: list[_Drawn] = []
        self._room_depth: list[moderngl.VertexArray] = []
        self._room_shadow: list[moderngl.VertexArray] = []
        self._people: list[_Drawn] = []
        self._lighting: Lighting | None = None
        self._people_casting: list[moderngl.VertexArray] = []
        self._jitters = np.random.default_rng(5).integers(0, 300, (12, 2)).astype(float)

    def take_over(self) -> None:
        """Make this the renderer that draws, where a process has several: OpenGL goes by the thread, not by the object."""
        self._context.__enter__()  # type: ignore[no-untyped-call]

    def close(self) -> None:
        """Give the context's memory back."""
        self._context.release()

    # --- what is in the scene -----------------------------------------------------------------------------------------

    def add_room(self, surfaces: Sequence[Surface]) -> None:
        """Add what stands still."""
        for surface in surfaces:
            shape = surface.shape
            uniforms = {
                "tint": tuple(surface.tint),
                "roughness_of_surface": surface.roughness,
                "gloss_of_surface": surface.gloss,
                "emission": tuple(surface.emission),
            }
            look = self._white if surface.texture is None else self._texture(surface.texture)
            mesh = shape.vertices, shape.normals, shape.texture_coordinates, np.zeros(len(shape.vertices)), shape.triangles
            self._room.append(self._drawn(mesh, (look, self._flat, self._white), uniforms, 0))
        # Where only its depth counts, the room is one shape: a call for each of its hundred parts takes longer than they do.
        self._room_depth += self._depth_of([surface.shape for surface in surfaces])
        self._room_shadow += self._depth_of([surface.shape for surface in surfaces if surface.casts_shadow])

    def add_person(self, look: Avatar, tints: Tints) -> None:
        """Add a person; its number is the count of those before it."""
        maps = self._texture(look.colours), self._texture(look.normal_map), self._texture(look.skin_mask)
        part = np.where(look.is_eye, EYE, look.part)
        mesh = look.vertices, np.zeros((len(part), 3)), look.texture_coordinates, part, look.triangles
        person = self._drawn(mesh, maps, {}, len(self._people) + 1)
        self._people.append(person)
        self.tint(len(self._people) - 1, tints)
        coarse = coarse_triangles(look.vertices, look.triangles, look.part, SHADOW_CELL_M)
        places = [(person.positions, "3f", "in_position")]
        index = self._context.buffer(coarse.tobytes())
        self._people_casting.append(self._context.vertex_array(self._programs["depth"], places, index))

    def tint(self, number: int, tints: Tints) -> None:
        """Give a person other colours."""
        self._people[number].uniforms = {
            "skin_tint": tuple(tints.skin),
            "hair_tint": tuple(tints.hair),
            "clothes_tint": tuple(tints.clothes),
        }

    def repaint(self, number: int, look: Avatar) -> None:
        """Give a person other pictures, of the same sizes as its own."""
        for texture, picture in zip(self._people[number].maps[::2], (look.colours, look.skin_mask), strict=True):
            texture.write(np.ascontiguousarray(picture).tobytes(), alignment=1)
            texture.build_mipmaps()

    def pose(self, meshes: Sequence[Mesh]) -> None:
        """Put the people where they are now, in their order."""
        for drawn, mesh in zip(self._people, meshes, strict=True):
            drawn.positions.write(np.ascontiguousarray(mesh.vertices, np.float32).tobytes())
            drawn.normals.write(np.ascontiguousarray(mesh.normals, np.float32).tobytes())

    def light(self, lighting: Lighting, centre: Floats) -> None:
        """Set the lamps, and draw the shadows of the room around `centre` (world). After add_room()."""
        self._lighting = lighting
        program = self._programs["depth"]
        self._room_shadows.draw(program, lighting.lamps, centre, ROOM_SHADOW_RADIUS_M, self._room_shadow)

    def cast_people(self, centre: Floats, radius_m: float) -> None:
        """Draw the shadows of people, as they stand, in a ball around `centre` (world). After light()."""
        self._people_shadows.draw(self._programs["depth"], self._lit().lamps, centre, radius_m, self._people_casting)

    # --- pictures -----------------------------------------------------------------------------------------------------

    def room(self, view: View) -> FloatPicture:
        """The room without people and their shadows (h, w, 3), linear, smooth at edges: for a camera that stands."""
        passes = zip(_shifts(ROOM_PASSES), self._jitters, strict=False)
        pictures = [self._pass(_shifted(view, shift), "room", self._whole, jitter) for shift, jitter in passes]
        mean: FloatPicture = np.mean(pictures, axis=0, dtype=np.float32)
        return mean

    def room_at_once(self, view: View) -> FloatPicture:
        """As room(), in one pass, with edges softened afterwards: for a camera that moves."""
        return _softened(self._pass(view, "room", self._whole, self._jitters[0]))

    def shade(self, view: View) -> FloatPicture:
        """Share of the room's light that people leave to it (h / 4, w / 4, 3). After cast_people()."""
        pictures = [self._pass(view, "shade", self._small, jitter) for jitter in self._jitters[:2]]
        mean: FloatPicture = np.mean(pictures, axis=0, dtype=np.float32)
        return mean

    def people(self, view: View, jitter: int = 0, *, smooth: bool = True) -> FloatPicture:
        """The people alone (h, w, 4), linear and premultiplied by their cover, hidden by what stands before them.

        The view may be a window of the picture: the time is that of its pixels. Not smooth: edges are stair-stepped, in half
        the time where the window is small.
        """
        matrix = _view_projection(view)
        targets = self._people_targets(view)
        cover = self._cover(matrix, targets) if smooth else None
        self._draw_bodies(matrix, view, targets)
        targets.lit.use()
        self._context.disable(moderngl.DEPTH_TEST)
        program, turn = self._programs["person"], self._jitters[jitter % len(self._jitters)]
        self._set_light(program, matrix, view, turn, self._people_shadows)
        names = "albedo_map", "normal_map", "flat_map", "position_map"
        for unit, (name, content) in enumerate(zip(names, targets.made_of, strict=True)):
            content.use(unit + 4)
            program[name] = unit + 4
        self._screen.render()
        self._context.enable(moderngl.DEPTH_TEST)
        light = self._read(targets.lit)
        return light if cover is None else _edged(light, cover)

    def labels(self, view: View) -> NDArray[np.uint8]:
        """Per pixel person << 5 | skin << 4 | part (h, w); 0 where there is nobody."""
        target, matrix = self._people_targets(view).labels, _view_projection(view)
        target.use()
        target.clear(0.0, 0.0, 0.0, 0.0)
        self._hide_behind_room(matrix)
        program = self._programs["label"]
        program["view_projection"].write(_uniform(matrix.T))
        program["skin_mask"] = 2
        for drawn in self._people:
            drawn.maps[2].use(2)
            program["person"] = float(drawn.person)
            drawn.arrays["label"].render()
        raw = _bytes_of(target, 4)
        part, person, skin = raw[..., 0], raw[..., 1], raw[..., 2] > 127
        packed = (np.maximum(person, 1) - 1) << 5 | skin.astype(np.uint8) << 4 | np.minimum(part, 15)
        return np.where(person > 0, packed, 0).astype(np.uint8)

    # --- inside -------------------------------------------------------------------------------------------------------

    def _pass(self, view: View, kind: str, target: moderngl.Framebuffer, jitter: Floats) -> FloatPicture:
        program, matrix = self._programs[kind], _view_projection(view)
        target.use()
        self._context.viewport = (0, 0, *target.size)
        empty = 0.0 if kind == "room" else 1.0
        target.clear(empty, empty, empty, empty)
        self._hide_behind_room(matrix)  # so that what lies behind is not lit in vain
        self._set_light(program, matrix, view, jitter, self._room_shadows if kind == "room" else self._people_shadows)
        for item in self._room:
            self._set_look(program, item)
            item.arrays[kind].render()
        return self._read(target)[..., :3]

    def _people_targets(self, view: View) -> _PeopleTargets:
        size = view.width, view.height
        if size not in self._targets:
            self._targets[size] = _PeopleTargets.of(self._context, size)
        self._context.viewport = (0, 0, *size)
        return self._targets[size]

    def _cover(self, matrix: Floats, targets: _PeopleTargets) -> FloatPicture:
        """Share of each pixel (h, w, 1) that people cover."""
        targets.sampled.use()
        targets.sampled.clear(0.0, 0.0, 0.0, 0.0)
        self._hide_behind_room(matrix)
        self._programs["cover"]["view_projection"].write(_uniform(matrix.T))
        for item in self._people:
            item.arrays["cover"].render()
        self._context.copy_framebuffer(targets.cover, targets.sampled)
        return _bytes_of(targets.cover, 1).astype(np.float32) / np.float32(255)

    def _draw_bodies(self, matrix: Floats, view: View, targets: _PeopleTargets) -> None:
        targets.body.use()
        targets.body.clear(0.0, 0.0, 0.0, 0.0)
        self._hide_behind_room(matrix)
        program = self._programs["body"]
        program["view_projection"].write(_uniform(matrix.T))
        program["camera"] = tuple(view.centre)
        for item in self._people:
            self._set_look(program, item)
            item.arrays["body"].render()

    def _hide_behind_room(self, matrix: Floats) -> None:
        self._programs["depth"]["view_projection"].write(_uniform(matrix.T))
        for shape in self._room_depth:
            shape.render()

    def _depth_of(self, shapes: Sequence[Shape]) -> list[moderngl.VertexArray]:
        """The shapes as one, for their depth alone; none where there are none."""
        if not shapes:
            return []
        whole = joined(shapes)
        at = self._context.buffer(_uniform(whole.vertices))
        index = self._context.buffer(np.ascontiguousarray(whole.triangles, np.int32).tobytes())
        return [self._context.vertex_array(self._programs["depth"], [(at, "3f", "in_position")], index)]

    def _set_look(self, program: Any, item: _Drawn) -> None:
        for unit, (name, look) in enumerate(zip(("albedo_map", "normal_map", "skin_mask"), item.maps, strict=True)):
            look.use(unit)
            if name in program:
                program[name] = unit
        for key, value in item.uniforms.items():
            if key in program:
                program[key] = value

    def _read(self, target: moderngl.Framebuffer) -> FloatPicture:
        width, height = target.size
        raw = np.frombuffer(target.read(components=4, dtype="f2"), np.float16).reshape(height, width, 4)[::-1]
        return np.clip(np.nan_to_num(raw.astype(np.float32), posinf=BRIGHTEST), 0, BRIGHTEST)

    def _set_light(self, program: Any, matrix: Floats, view: View, jitter: Floats, shadows: ShadowAtlas) -> None:
        lighting = self._lit()
        lamps = lighting.lamps
        padded = MAX_LAMPS - len(lamps)
        values: dict[str, Any] = {
            "view_projection": _uniform(matrix.T),
            "lamp_position": _uniform([*(lamp.position for lamp in lamps), *np.zeros((padded, 3))]),
            "lamp_colour": _uniform([*(lamp.colour for lamp in lamps), *np.zeros((padded, 3))]),
            "lamp_matrix": _uniform([*(m.T for m in shadows.matrices), *np.tile(np.eye(4), (padded, 1, 1))]),
            "lamp_softness": _uniform([*shadows.softness, *np.zeros(padded)]),
            "lamp_reach2": _uniform([*(lamp.reach2_m2 for lamp in lamps), *np.zeros(padded)]),
            "camera": _uniform(view.centre),
            "ambient_up": _uniform(lighting.ambient_up),
            "ambient_down": _uniform(lighting.ambient_down),
            "jitter": _uniform(jitter),
            "shadow_raise": _uniform(shadows.raised_m),
        }
        for name, value in values.items():
            if name in program:
                program[name].write(value)
        shadows.texture.use(3)
        program["lamps"], program["key_lamps"] = len(lamps), sum(lamp.key for lamp in lamps)
        program["shadow_map"] = 3

    def _lit(self) -> Lighting:
        if self._lighting is None:
            raise RuntimeError("light() comes before any picture")
        return self._lighting

    def _drawn(
        self,
        mesh: tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]],
        maps: tuple[moderngl.Texture, moderngl.Texture, moderngl.Texture],
        uniforms: dict[str, Any],
        person: int,
    ) -> _Drawn:
        positions, normals, coordinates, part, triangles = mesh
        buffer = self._context.buffer
        at = buffer(_uniform(positions), dynamic=bool(person))
        up = buffer(_uniform(normals), dynamic=bool(person))
        fixed = buffer(_uniform(np.hstack([coordinates, np.asarray(part, float)[:, None]])))
        index = buffer(np.ascontiguousarray(triangles, np.int32).tobytes())
        places = [(at, "3f", "in_position")]
        whole = [*places, (up, "3f", "in_normal"), (fixed, "2f 1f", "in_texture", "in_part")]
        wanted = {"body": whole, "cover": places, "label": whole} if person else {"room": whole, "shade": whole}
        arrays = {
            name: self._context.vertex_array(self._programs[name], content, index, skip_errors=True)
            for name, content in wanted.items()
        }
        return _Drawn(at, up, arrays, maps, uniforms, person)

    def _texture(self, picture: NDArray[np.uint8]) -> moderngl.Texture:
        content = np.ascontiguousarray(picture if picture.ndim == 3 else picture[..., None])
        height, width, channels = content.shape
        texture = self._context.texture((width, height), channels, content.tobytes(), alignment=1)
        texture.build_mipmaps()
        texture.filter = moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR
        return texture

    def _program(self, vertex: str, fragment: str) -> moderngl.Program:
        return self._context.program(vertex_shader=_source(vertex), fragment_shader=_source(fragment))


def _source(name: str) -> str:
    """A shader of this package, with the files that it includes."""
    folder = files(__package__) / "shaders"
    lines = (folder / name).read_text(encoding="utf-8").splitlines()
    return "\n".join(_source(line.split()[1]) if line.startswith("#include ") else line for line in lines) + "\n"


def _bytes_of(target: moderngl.Framebuffer, components: int) -> NDArray[np.uint8]:
    width, height = target.size
    content = target.read(components=components, alignment=1)
    return np.frombuffer(content, np.uint8).reshape(height, width, components)[::-1]


def _edged(light: FloatPicture, cover: FloatPicture) -> FloatPicture:
    """Light of whole pixels (h, w, 4) with smooth edges: pixels whose centre is free take the light of their neighbours."""
    inside = light[..., 3:]
    nearby = cv2.blur(light, (3, 3))
    filled = np.where(inside > 0.5, light[..., :3], nearby[..., :3] / np.maximum(nearby[..., 3:], 1e-3))
    return np.concatenate([filled * cover, cover], axis=2)


def _shifts(count: int) -> Floats:
    """Offsets (count, 2) within a pixel, evenly spread, mean 0."""
    number = np.arange(count)
    spread = np.stack([(number + 0.5) / count, (number * GOLDEN) % 1.0], axis=1)
    return np.asarray(spread - spread.mean(axis=0))


def _shifted(view: View, shift_px: Floats) -> View:
    matrix = view.matrix.copy()
    matrix[:2, 2] += shift_px
    return replace(view, matrix=matrix)


def _softened(light: FloatPicture) -> FloatPicture:
    """Light (h, w, 3) whose stair-stepped edges are blurred a little; even surfaces stay as they are."""
    grey = np.sqrt(light @ np.array((0.21, 0.72, 0.07), np.float32))
    box = np.ones((3, 3), np.uint8)
    contrast = cv2.dilate(grey, box) - cv2.erode(grey, box)
    share = np.clip((contrast - EDGE_FROM) / EDGE_FROM, 0, 1)[..., None]
    softer: FloatPicture = (light + share * (cv2.GaussianBlur(light, (3, 3), 0.7) - light)).astype(np.float32)
    return softer


def shadows_on(room: FloatPicture, share: FloatPicture) -> FloatPicture:
    """The room (h, w, 3) with people's shadows, of which `share` (h / 4, w / 4, 3) is left; see Renderer.shade."""
    height, width = room.shape[:2]
    soft = cv2.resize(cv2.GaussianBlur(share, (0, 0), 0.9), (width, height), interpolation=cv2.INTER_LINEAR)
    return (room * soft).astype(np.float32)


def over(people: FloatPicture, room: FloatPicture) -> FloatPicture:
    """People (h, w, 4) in front of the room (h, w, 3)."""
    return people[..., :3] + room * (1 - people[..., 3:])


def _uniform(value: Any) -> bytes:
    return np.ascontiguousarray(value, "f4").tobytes()


def _view_projection(view: View) -> Floats:
    """OpenCV's pinhole, pixel centres at integers, as OpenGL's clip space (row 0 of the read-back picture is flipped)."""
    focal_x, focal_y, centre_x, centre_y = view.matrix[0, 0], view.matrix[1, 1], view.matrix[0, 2], view.matrix[1, 2]
    projection = np.zeros((4, 4))
    projection[0, 0], projection[0, 2] = 2 * focal_x / view.width, 2 * (centre_x + 0.5) / view.width - 1
    projection[1, 1], projection[1, 2] = -2 * focal_y / view.height, 1 - 2 * (centre_y + 0.5) / view.height
    projection[2, 2], projection[2, 3] = (FAR_M + NEAR_M) / (FAR_M - NEAR_M), -2 * FAR_M * NEAR_M / (FAR_M - NEAR_M)
    projection[3, 2] = 1
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = view.rotation, view.translation
    return projection @ pose
