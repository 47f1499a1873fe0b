"""What is drawn over the picture: outlines, fingertips and heads where the stages saw them, POIs where the lens puts them."""

import struct

import cv2
import numpy as np
import pytest
from deixis_schemas.messages import CameraInfo, Frame, FrameId, Gestures, HeadPoses, Poi, RobotPose, Tracks
from deixis_view.frame_view import FrameView
from deixis_view.known import Known
from deixis_view.overlay import MOST_CORNERS, draw_overlay, outline, size_shown
from deixis_view.pictures import reduced

MADE = {"stage": "tracker", "instance": "t", "stamp_ns": 10, "run": 1, "seq": 2}


def packed(*points):
    return b"".join(struct.pack("<hh", *point) for point in points)


def track(kind, box, contour=b"", person=0):
    made = {"track_id": 1, "person_id": person, "kind": kind, "kind_probabilities": {}, "centroid_px": (0, 0)}
    return {**made, "bbox_px": box, "velocity_px_s": (0, 0), "contour": contour}


def seen(*tracks, yaw=None, tips=()):
    view = FrameView(FrameId(1, 2), 10)
    view.tracks = Tracks.model_validate({**MADE, "width": 640, "height": 480, "tracks": list(tracks)})
    if yaw is not None:
        pose = {"person_id": 0, "status": "tracking", "yaw_deg": yaw, "yaw_sigma_deg": 5}
        view.poses = HeadPoses.model_validate({**MADE, "poses": [pose]})
    gesture = {"person_id": 0, "phase": "stroke", "gesture": "point_left", "hand": "left", "fingertips_px": list(tips)}
    view.gestures = Gestures.model_validate({**MADE, "gestures": [gesture]})
    return view


def at(drawings, path):
    return next(drawing.what for drawing in drawings if drawing.path == path)


def camera(**more):
    lens = {"width": 640, "height": 480, "camera_matrix": (500, 0, 320, 0, 500, 240, 0, 0, 1)}
    made = {"stage": "camera", "instance": "t", "stamp_ns": 0, "state": "streaming", "source": "x"}
    return CameraInfo.model_validate({**made, **lens, "mount": {"position_m": (0, 0, 1)}, **more})


def test_all_is_drawn_where_it_was_seen_made_smaller_with_the_picture():
    hand = track("left_hand", (100, 200, 40, 60), packed((100, 200), (140, 200), (140, 260)))
    drawings = draw_overlay(seen(hand, tips=[(100, 200)]), Known(), 0.5)
    assert at(drawings, "picture/tracks").xywh == [(50, 100, 20, 30)]
    assert at(drawings, "picture/contours").strips == [[(50, 100), (70, 100), (70, 130), (50, 100)]]
    assert at(drawings, "picture/fingertips").points == [(50, 100)]
    assert at(drawings, "picture/edge").strips[0][2] == (320, 240)


def test_a_head_turned_to_the_persons_left_points_to_the_images_right():
    face = track("face", (300, 100, 40, 50))
    for yaw, sign in ((60.0, 1), (-60.0, -1)):
        drawings = draw_overlay(seen(face, yaw=yaw), Known(), 1.0)
        (arrow,) = at(drawings, "picture/yaw").vectors
        assert arrow[0] * sign > 0
        assert at(drawings, "picture/tracks").labels == [f"{yaw:+.0f}°"]


def test_a_long_outline_is_thinned_and_closed():
    strip = outline(packed(*((i, i) for i in range(2000))))
    assert len(strip) <= MOST_CORNERS + 1
    assert strip[0] == strip[-1]
    assert outline(b"") == []


@pytest.mark.parametrize(
    "model", [{}, {"distortion_model": "plumb_bob", "distortion": [0.0] * 5}, {"distortion_model": "equidistant"}]
)
def test_a_poi_stands_in_the_picture_where_the_lens_puts_it_and_one_behind_the_robot_nowhere(model):
    if model.get("distortion_model") == "equidistant":
        model = {**model, "distortion": [0.0] * 4}
    pois = [Poi(poi_id="ahead", position_m=(2, 4, 1)), Poi(poi_id="behind", position_m=(-1, 2, 1))]
    robot = RobotPose(stage="robot", instance="t", stamp_ns=0, x_m=2, y_m=0, yaw_deg=90)
    known = Known(pois, robot=robot)
    known.camera = camera(**model)
    dots = at(draw_overlay(seen(), known, 1.0), "picture/pois")
    assert dots.labels == ["ahead"]
    assert dots.points[0] == pytest.approx((320, 240), abs=0.01)


def test_a_poi_to_the_left_and_above_is_so_in_the_picture_too():
    robot = RobotPose(stage="robot", instance="t", stamp_ns=0, x_m=0, y_m=0, yaw_deg=0)
    known = Known([Poi(poi_id="lamp", position_m=(5, 1, 2))], robot=robot)
    known.camera = camera()
    assert at(draw_overlay(seen(), known, 1.0), "picture/pois").points[0] == pytest.approx((220, 140), abs=0.01)


def test_pictures_are_made_no_wider_than_asked_and_no_larger():
    image = np.full((60, 80, 3), 200, np.uint8)
    frame = Frame.model_validate({**MADE, "width": 80, "height": 60, "encoding": "bgr8", "data": image.tobytes()})
    for asked, width in ((40, 40), (640, 80)):
        shown = cv2.imdecode(np.frombuffer(reduced(frame, asked), np.uint8), cv2.IMREAD_COLOR)
        assert shown.shape[:2] == (width * 3 // 4, width)
        assert abs(int(shown.mean()) - 200) < 3
    known = Known()
    assert size_shown(known, 320) is None
    known.camera = camera()
    assert size_shown(known, 320) == (320, 240)
