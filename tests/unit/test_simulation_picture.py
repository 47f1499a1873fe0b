"""Pictures of a scene: shapes, lamps, sensor, film, and the renderer on a body of two boxes."""

from dataclasses import dataclass
from typing import get_args

import numpy as np
import pytest

pytest.importorskip("moderngl", reason="deixis-simulation is not installed")

import av
from deixis_simulation import shapes, textures
from deixis_simulation.encode import EncodeError, Encoder
from deixis_simulation.geometry import RobotState, to_world, view_at
from deixis_simulation.lights import light_gain_at, lighting, picture_gains
from deixis_simulation.renderer import Renderer, Tints, over
from deixis_simulation.room import build_room, is_drawn
from deixis_simulation.scene import (
    Camera,
    ExhibitKind,
    Furniture,
    FurnitureKind,
    Light,
    LightChange,
    Person,
    Room,
    Scene,
    ScenePoi,
    Sensor,
    Walk,
    Waypoint,
)
from deixis_simulation.sensor import SensorModel
from deixis_simulation.shadows import coarse_triangles
from deixis_simulation.stage import Stage
from simulation_ready import needs_renderer

CAMERA = Camera(width=160, height=120)
UP = np.array((0.0, 1.0, 0.0))


def scene(**changes):
    return Scene(**{"duration_s": 1.0, "seed": 7, "camera": CAMERA} | changes)


@dataclass
class BoxBody:
    """A stand-in for a person: a box with a head; `part` 7 and 1, all of it skin-masked white."""

    mesh: shapes.Shape
    colours: np.ndarray
    normal_map: np.ndarray
    skin_mask: np.ndarray
    part: np.ndarray

    @property
    def is_eye(self):
        return np.zeros(len(self.part), bool)

    @property
    def triangles(self):
        return self.mesh.triangles

    @property
    def texture_coordinates(self):
        return self.mesh.texture_coordinates

    @property
    def vertices(self):
        return self.mesh.vertices.astype(np.float32)

    @property
    def normals(self):
        return self.mesh.normals.astype(np.float32)


class EyedBody(BoxBody):
    """Its head is one large eye."""

    @property
    def is_eye(self):
        return self.part == 1


def body(place=(2.0, 0.0)):
    foot = to_world(place)
    trunk, head = shapes.box(foot + UP * 0.75, (0.4, 1.5, 0.25)), shapes.box(foot + UP * 1.65, (0.18, 0.24, 0.2))
    both = shapes.joined([trunk, head])
    part = np.r_[np.full(len(trunk.vertices), 7), np.full(len(head.vertices), 1)]
    plain = np.full((8, 8, 3), 180, np.uint8)
    return BoxBody(both, plain, np.full((8, 8, 3), (128, 128, 255), np.uint8), np.full((8, 8), 255, np.uint8), part)


PERSON = Person(avatar="box", place_m=(2.0, 0.0))


@pytest.mark.parametrize(
    "shape",
    [
        shapes.quad((0, 0, 0), (1, 0, 0), (0, 2, 0)),
        shapes.box((1, 2, 3), (1, 2, 3), 30),
        shapes.sphere((0, 1, 0), 0.3),
        shapes.lathe((0, 0, 0), [(0.001, 0), (0.1, 0.1), (0.05, 0.3)]),
        shapes.plant((0, 0, 0), 0.8, np.random.default_rng(2)),
    ],
)
def test_a_shape_has_unit_normals_and_triangles_of_its_own_vertices(shape):
    assert np.allclose(np.linalg.norm(shape.normals, axis=1), 1, atol=1e-6)
    assert len(shape.vertices) == len(shape.normals) == len(shape.texture_coordinates)
    assert 0 <= shape.triangles.min() <= shape.triangles.max() < len(shape.vertices)


@pytest.mark.parametrize("shape", [shapes.box((0, 0, 0), (1, 2, 3), 30), shapes.sphere((0, 0, 0), 0.3)])
def test_normals_point_outward(shape):
    assert (np.einsum("ij,ij->i", shape.vertices, shape.normals) > 0).all()


def test_coarse_triangles_are_fewer_and_of_one_part_each():
    ball = shapes.sphere((0, 0, 0), 0.1)
    part = (ball.vertices[:, 1] > 0).astype(int)
    coarse = coarse_triangles(ball.vertices, ball.triangles, part, 0.03)
    assert 20 < len(coarse) < len(ball.triangles) / 2
    assert np.ptp(ball.vertices[np.unique(coarse)], axis=0) == pytest.approx([0.2] * 3, abs=0.06)
    assert (coarse[:, 0] != coarse[:, 1]).all()


@pytest.mark.parametrize("kind", ["plaster", "brick", "wood", "panel"])
@pytest.mark.parametrize("floor", ["wood", "stone", "carpet"])
def test_every_wall_floor_and_piece_of_furniture_can_be_built(kind, floor):
    furniture = [Furniture(kind=piece, along_m=index - 4) for index, piece in enumerate(get_args(FurnitureKind))]
    pois = [
        ScenePoi(poi_id=f"p{i}", position_m=(4.0, i - 3, 1.2), exhibit=exhibit)
        for i, exhibit in enumerate(get_args(ExhibitKind))
    ]
    surfaces = build_room(scene(room=Room(wall=kind, floor=floor, furniture=furniture), pois=pois))
    assert len(surfaces) > 30
    low = np.min([surface.shape.vertices.min(0) for surface in surfaces], axis=0)
    high = np.max([surface.shape.vertices.max(0) for surface in surfaces], axis=0)
    assert low[1] >= -0.02
    assert high[1] <= 3.05
    assert -5.1 <= low[2] <= high[2] <= 3.6, "inside the room"


def test_a_texture_is_the_same_for_the_same_seed():
    for make in (textures.books, textures.board, textures.painting):
        assert np.array_equal(make(np.random.default_rng(3)), make(np.random.default_rng(3)))


@pytest.mark.parametrize(
    ("place", "drawn"), [((3.5, 1.5, 1.2), True), ((1.0, 0.1, 1.2), False), ((0.5, 0.4, 1.0), False), ((9.0, 0.0, 1.2), False)]
)
def test_an_exhibit_is_drawn_in_the_room_and_not_before_a_person_or_at_the_lens(place, drawn):
    poi = ScenePoi(poi_id="a", position_m=place, exhibit="vase")
    assert is_drawn(poi, scene(pois=[poi], people=[PERSON])) is drawn


def test_an_exhibit_is_not_drawn_where_the_robot_will_drive_or_before_who_will_stand_there():
    poi = ScenePoi(poi_id="a", position_m=(2.0, 1.0, 1.2), exhibit="vase")
    assert is_drawn(poi, scene(pois=[poi]))
    path = [Waypoint(at_s=0), Waypoint(at_s=4, x_m=4.0, y_m=2.0)]
    assert not is_drawn(poi, scene(pois=[poi], robot_path=path)), "the way leads through it"
    walker = Person(avatar="box", place_m=(2.0, -2.0), actions=[Walk(start_s=0, to_m=(3.0, 1.5))])
    assert not is_drawn(poi, scene(pois=[poi], people=[walker]))


def test_light_goes_where_a_change_says_and_flicker_takes_from_it():
    light = Light(changes=[LightChange(at_s=1.0, gain=0.5, over_s=1.0)])
    assert [round(light_gain_at(light, t), 3) for t in (0.0, 1.5, 2.0, 9.0)] == [1.0, 0.75, 0.5, 0.5]
    flickering = [light_gain_at(Light(flicker_depth=0.4, flicker_hz=5), t / 100) for t in range(100)]
    assert (min(flickering), max(flickering)) == (pytest.approx(0.6, abs=0.01), pytest.approx(1.0))


def test_the_automatic_exposure_brings_a_dimmed_picture_back_and_without_it_it_stays_dim():
    dimmed = [LightChange(at_s=0.5, gain=0.5, over_s=0)]
    gains = picture_gains(scene(duration_s=4.0, light=Light(changes=dimmed)))
    assert gains[0] == 1.0
    assert min(gains) == pytest.approx(0.5, abs=0.03)
    assert gains[-1] == pytest.approx(1.0, abs=0.05)
    assert picture_gains(scene(duration_s=4.0, light=Light(changes=dimmed, auto_exposure=False)))[-1] == 0.5


def test_a_grey_picture_is_exposed_as_asked_and_the_same_each_time():
    grey = np.full((120, 160, 3), 0.6, np.float32)
    model = SensorModel(scene())
    model.meter(grey)
    picture = model.expose(grey, 3)
    centre = picture[40:80, 50:110].mean(axis=(0, 1))
    assert centre == pytest.approx([255 * 0.25 ** (1 / 2.2)] * 3, abs=10)
    assert np.array_equal(picture, model.expose(grey, 3))
    assert not np.array_equal(picture, model.expose(grey, 4)), "the noise is another in each frame"
    assert model.expose(grey, 3, gain=0.5).mean() < picture.mean() - 20


def test_a_wrong_white_balance_shifts_the_channels_as_it_says():
    grey = np.full((120, 160, 3), 0.25, np.float32)
    picture = SensorModel(scene(sensor=Sensor(white_balance=(1.2, 1.0, 0.8)))).expose(grey, 0)
    blue, green, red = picture[40:80, 50:110].mean(axis=(0, 1))
    assert red > green + 8 > blue + 16


def test_a_film_gives_back_its_frames_at_its_rate(tmp_path):
    path = tmp_path / "film.mp4"
    with Encoder(path, 160, 120, 25, crf=20) as film:
        for level in range(0, 200, 10):
            film.write(np.full((120, 160, 3), level, np.uint8))
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        levels = [float(frame.to_ndarray(format="bgr24").mean()) for frame in film.decode(stream)]
        assert (stream.average_rate, stream.codec_context.name) == (25, "h264")
    assert levels == pytest.approx(list(range(0, 200, 10)), abs=5)


def test_a_film_that_cannot_be_written_is_an_error_that_names_it(tmp_path):
    with pytest.raises(EncodeError, match="no_such"):
        Encoder(tmp_path / "no_such" / "film.mp4", 160, 120, 25, 20)


@needs_renderer
class TestRendering:
    """On this machine's OpenGL."""

    def test_labels_lie_where_the_vertices_are_projected(self):
        person = body()
        stage = Stage(scene(people=[PERSON]), [person])
        view = view_at(CAMERA, RobotState())
        labels = stage.labels(view, [person])
        stage.close()
        places = view.project(person.vertices[-24:].astype(float))
        rows, columns = np.nonzero((labels & 15) == 1)
        assert (columns.min(), columns.max()) == pytest.approx((places[:, 0].min(), places[:, 0].max()), abs=1.0)
        assert (rows.min(), rows.max()) == pytest.approx((places[:, 1].min(), places[:, 1].max()), abs=1.0)
        assert set(np.unique(labels)) == {0, 7, 1 | 16}, "the head is skin, clothes are not, and it is person 0"

    def test_the_same_scene_gives_the_same_bytes(self):
        pictures = []
        for _ in range(2):
            stage = Stage(scene(people=[PERSON]), [body()])
            pictures.append(stage.picture(view_at(CAMERA, RobotState()), [[body()]]))
            stage.close()
        assert np.array_equal(*pictures)

    def test_a_person_hides_the_room_and_throws_a_shadow_on_the_floor(self):
        empty, full = Stage(scene(), []), Stage(scene(people=[PERSON]), [body()])
        view = view_at(CAMERA.model_copy(update={"pitch_up_deg": -20.0}), RobotState())
        without, with_person = empty.picture(view, [[]]), full.picture(view, [[body()]])
        labels = full.labels(view, [body()])
        inside = labels > 0
        assert np.abs(with_person - without)[inside].mean() > 0.03
        beside = ~inside
        beside[:70] = False
        assert (with_person - without)[beside].mean() < 0, "floor lies in the shadow"
        empty.close()
        full.close()

    def test_shadows_of_the_room_stay_where_they_are_when_a_person_walks(self):
        furniture = [Furniture(kind="cabinet", along_m=0.8), Furniture(kind="bench", along_m=-0.8, off_wall_m=0.1)]
        stage = Stage(scene(people=[PERSON], room=Room(front_x_m=3.6, furniture=furniture)), [body()])
        view = view_at(CAMERA, RobotState())
        far, near = (stage.picture(view, [[body((x, 6.0))]]) for x in (-3.0, 3.0))
        stage.close()
        assert np.abs(far - near).max() < 0.02, "the person is beside the picture, however near to the furniture"

    def test_everyone_of_a_group_throws_a_shadow(self):
        people = [Person(avatar="box", place_m=(3.0, y)) for y in (1.5, -1.5)]
        looking_down = CAMERA.model_copy(update={"pitch_up_deg": -20.0, "horizontal_fov_deg": 90.0})
        stage = Stage(scene(people=people), [body(), body()])
        view = view_at(looking_down, RobotState())
        meshes = [body((3.0, 1.5)), body((3.0, -1.5))]
        shadowed, labels = stage.picture(view, [meshes]), stage.labels(view, meshes)
        stage.close()
        empty = Stage(scene(people=[]), [])
        plain = empty.picture(view, [[]])
        empty.close()
        darker = (plain - shadowed).mean(axis=2) * (labels == 0)
        assert min(darker[:, :80].max(), darker[:, 80:].max()) > 0.01

    def test_eyes_are_no_skin(self):
        person = body()
        with_eyes = EyedBody(person.mesh, person.colours, person.normal_map, person.skin_mask, person.part)
        stage = Stage(scene(people=[PERSON]), [with_eyes])
        labels = stage.labels(view_at(CAMERA, RobotState()), [with_eyes])
        stage.close()
        assert set(np.unique(labels)) == {0, 7, 1}, "head, but not skin"

    def test_motion_between_the_subframes_blurs(self):
        stage = Stage(scene(people=[PERSON]), [body()])
        view = view_at(CAMERA, RobotState())
        sharp = stage.picture(view, [[body((2.0, 0.1))]])
        blurred = stage.picture(view, [[body((2.0, y))] for y in (0.0, 0.1, 0.2)])
        stage.close()
        assert np.abs(np.diff(blurred[50], axis=0)).max() < np.abs(np.diff(sharp[50], axis=0)).max()

    def test_a_camera_that_drives_sees_the_room_from_each_place(self):
        path = [Waypoint(at_s=0), Waypoint(at_s=1, x_m=0.5)]
        stage = Stage(scene(robot_path=path), [])
        one, other = (stage.picture(view_at(CAMERA, RobotState(x)), [[]]) for x in (0.0, 0.5))
        stage.close()
        assert np.abs(one - other).mean() > 0.01

    def test_the_room_for_a_camera_that_moves_is_that_of_one_that_stands(self):
        renderer = Renderer(160, 120)
        renderer.add_room(build_room(scene(room=Room(furniture=[Furniture(kind="door", along_m=0.5)]))))
        centre = to_world((2.0, 0.0))
        renderer.light(lighting(Light(), centre), centre + UP * 1.05)
        view = view_at(CAMERA, RobotState())
        fine, quick = renderer.room(view), renderer.room_at_once(view)
        renderer.close()
        assert np.abs(fine - quick).mean() < 0.02
        assert np.abs((fine - quick).mean()) < 0.002, "no shift, no change of brightness"

    def test_people_smooth_over_the_room_at_their_edges(self):
        renderer = Renderer(160, 120)
        renderer.add_room(build_room(scene()))
        renderer.add_person(body(), Tints(skin=(1.0, 0.5, 0.5)))
        renderer.pose([body()])
        centre = to_world((2.0, 0.0))
        renderer.light(lighting(Light(), centre), centre + UP * 1.05)
        renderer.cast_people(centre + UP * 1.05, 1.3)
        people = renderer.people(view_at(CAMERA.model_copy(update={"roll_deg": 5.0}), RobotState()))
        renderer.close()
        cover = people[..., 3]
        assert ((cover > 0.05) & (cover < 0.95)).sum() > 20
        assert people.max() <= 30
        assert (over(people, np.zeros((120, 160, 3), np.float32)) >= 0).all()
