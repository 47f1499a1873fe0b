"""The map from above: where things stand in the view, which way sight lines go, and how belief colours POIs."""

import math

import pytest
from deixis_schemas.messages import Belief, CameraInfo, FrameId, Gestures, HeadPoses, PersonBelief, Poi, PoiBelief, RobotPose
from deixis_view import colours
from deixis_view.floor import bounds, camera_place, direction, draw_people, draw_place, shown, sight_line
from deixis_view.frame_view import FrameView
from deixis_view.known import Known

MADE = {"stage": "fusion", "instance": "t", "stamp_ns": 10, "run": 1, "seq": 2}


def pose(x=0.0, y=0.0, yaw=0.0):
    return RobotPose(stage="robot", instance="t", stamp_ns=0, x_m=x, y_m=y, yaw_deg=yaw)


def poi(poi_id, x, y):
    return Poi(poi_id=poi_id, name=f"the {poi_id}", position_m=(x, y, 1.0))


def standing(poi_id, probability):
    return PoiBelief(poi_id=poi_id, mass=0, belief=0, plausibility=1, pignistic=0.5, probability=probability)


def person(*pois, at=(3.0, 0.0, 1.5)):
    return PersonBelief(person_id=0, position_m=at, pois=list(pois))


def view(*persons, yaw=None, bearing=None):
    made = FrameView(FrameId(1, 2), 10, belief=Belief(**MADE, persons=list(persons)))
    if yaw is not None:
        head = {"person_id": 0, "status": "tracking", "yaw_deg": yaw, "yaw_sigma_deg": 5}
        made.poses = HeadPoses.model_validate({**MADE, "poses": [head]})
    if bearing is not None:
        hand = {"person_id": 0, "phase": "stroke", "gesture": "point_left", "hand": "left"}
        made.gestures = Gestures.model_validate(
            {**MADE, "gestures": [{**hand, "bearing_deg": bearing, "bearing_sigma_deg": 10}]}
        )
    return made


def at(drawings, path):
    return next(drawing.what for drawing in drawings if drawing.path == path)


def test_ahead_of_the_robot_is_up_and_its_left_is_left():
    assert shown(2.0, 0.0) == (0.0, -2.0)  # the view's y axis goes down
    assert shown(0.0, 1.0) == (-1.0, 0.0)


def test_a_positive_bearing_is_to_the_persons_own_left_which_is_the_images_right():
    # The person stands before the robot and looks at it; its right is the person's left.
    assert direction((3.0, 0.0), (0.0, 0.0), 0.0) == pytest.approx(math.pi)
    end = sight_line((3.0, 0.0), direction((3.0, 0.0), (0.0, 0.0), 90.0), 2.0)[1]
    assert end == pytest.approx(shown(3.0, -2.0))


def test_the_camera_stands_where_robot_and_mount_put_it():
    camera = CameraInfo(
        stage="camera",
        instance="t",
        stamp_ns=0,
        state="streaming",
        source="x",
        mount={"position_m": (0.2, 0.1, 1), "yaw_deg": 10},
    )
    place, looks = camera_place(pose(1.0, 2.0, 90.0), camera)
    assert place == pytest.approx((0.9, 2.2))
    assert math.degrees(looks) == pytest.approx(100.0)


def test_sight_lines_go_from_the_person_along_the_bearing_with_a_sigma_to_either_side():
    known = Known([poi("vase", 3.0, -2.0)], robot=pose())
    drawings = draw_people(view(person(standing("vase", 0.9)), yaw=0.0, bearing=90.0), known)
    hands, heads = at(drawings, "map/hands"), at(drawings, "map/heads")
    assert [len(lines.strips) for lines in (hands, heads)] == [3, 3]
    assert hands.colours[0] == colours.LEFT_HAND
    start, end = hands.strips[0]
    assert start == pytest.approx(shown(3.0, 0.0))
    assert end == pytest.approx(shown(3.0, -2.0))  # as long as the way to the farthest POI
    turned = [math.degrees(math.atan2(b[0] - a[0], a[1] - b[1])) for a, b in hands.strips]
    assert sorted(abs(angle - turned[0]) for angle in turned[1:]) == pytest.approx([10.0, 10.0])
    start, end = heads.strips[0]
    assert end[1] > start[1]  # down, to the robot
    assert end[0] == pytest.approx(start[0])


def test_nobody_whose_place_is_unknown_is_drawn_nor_a_head_that_is_not_read():
    known = Known([poi("vase", 3.0, -2.0)], robot=pose())
    drawings = draw_people(view(person(standing("vase", 0.9), at=None), yaw=0.0), known)
    assert at(drawings, "map/people").points == []
    assert at(drawings, "map/heads").strips == []


def test_belief_colours_pois_and_the_answer_is_ringed():
    known = Known([poi("vase", 1.0, 1.0), poi("door", 2.0, 1.0), poi("far", 3.0, 1.0)], robot=pose())
    dots = at(draw_people(view(person(standing("vase", 1.0), standing("door", 0.4))), known), "map/pois")
    assert dots.colours[0] == colours.FULL_BELIEF
    assert dots.colours[2] == colours.NO_BELIEF
    between = list(zip(colours.NO_BELIEF, dots.colours[1], colours.FULL_BELIEF, strict=True))
    assert all(min(low, high) < value < max(low, high) for low, value, high in between)
    assert dots.radii[0] > dots.radii[1] > dots.radii[2]
    assert dots.labels == ["the vase 1.00", "the door 0.40", "the far"]


def test_of_two_people_a_poi_has_the_colour_of_the_likelier():
    known = Known([poi("vase", 1.0, 1.0)], robot=pose())
    dots = at(draw_people(view(person(standing("vase", 0.2)), person(standing("vase", 0.9))), known), "map/pois")
    assert dots.colours == [colours.of_belief(0.9)]


def test_walls_and_robot_stand_in_the_place_and_the_view_takes_in_all_pois():
    known = Known([poi("vase", 4.0, 2.0)], [((5.0, -1.0), (5.0, 1.0))], pose(1.0, 0.0, 90.0))
    drawings = draw_place(known)
    assert at(drawings, "map/walls").strips == [[(1.0, -5.0), (-1.0, -5.0)]]
    tip, *_ = at(drawings, "map/robot").strips[0]
    assert tip == pytest.approx(shown(1.0, 0.3))  # it looks along the map's y axis
    left, top, right, bottom = bounds(known)
    for x, y in (shown(4.0, 2.0), shown(1.0, 0.0)):
        assert left < x < right
        assert top < y < bottom


def test_of_a_thousand_pois_only_the_probable_are_written_to():
    known = Known([poi(f"p{i}", i % 30, i // 30) for i in range(1000)], robot=pose())
    labels = at(draw_people(view(person(standing("p7", 0.9))), known), "map/pois").labels
    assert [label for label in labels if label] == ["the p7 0.90"]
