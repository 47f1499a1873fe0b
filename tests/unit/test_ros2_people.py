"""Answers and people as ROS 2 hears them."""

import math

import numpy as np
import pytest
from deixis_ros2.people import head_places, people_of
from deixis_ros2.ros_types import RosTypes, stamp_ns
from deixis_ros2.targets import POINTED_TARGET, pointed_target
from deixis_runtime.lens import Lens
from deixis_runtime.mount import to_base
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import CameraMount, HeadPose, KindProbabilities, Target, Track, Tracks
from deixis_schemas.samples import SAMPLES
from hypothesis import given, settings
from hypothesis import strategies as st

JAZZY = RosTypes("jazzy")
LENS = Lens.assumed(640, 480, 60.0)
TARGET = next(message for message in SAMPLES if isinstance(message, Target))


def track(kind, person_id, bbox, confidence=1.0):
    x, y, w, h = bbox
    return Track(
        track_id=1, person_id=person_id, kind=kind, kind_probabilities=KindProbabilities(), centroid_px=(x + w / 2, y + h / 2),
        bbox_px=bbox, velocity_px_s=(0, 0), confidence=confidence,
    )  # fmt: skip


def tracks(*items):
    return Tracks(run=1, seq=2, stamp_ns=3, stage="tracker", instance="i", width=640, height=480, tracks=list(items))


def pose(person_id, yaw_deg, **more):
    return HeadPose(person_id=person_id, status="tracking", yaw_deg=yaw_deg, yaw_sigma_deg=3.0, **more)


def turned(quaternion, vector):
    """A vector turned by a quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    axis = np.array([x, y, z])
    across = 2 * np.cross(axis, vector)
    return np.asarray(vector) + w * across + np.cross(axis, across)


# --- answers ----------------------------------------------------------------------------------------------------------


def test_a_target_says_the_same_to_ros():
    target = TARGET
    message = JAZZY.decode(POINTED_TARGET, JAZZY.encode(pointed_target(JAZZY, target, "map")))
    assert stamp_ns(message.header) == target.stamp_ns
    assert message.header.frame_id == "map"
    assert (message.episode_id, message.is_final, message.poi_ids) == (target.episode_id, target.final, target.poi_ids)
    assert (message.reason, message.person_id) == (target.reason, f"p{target.person_id}")
    assert message.latency_ms == target.latency_ms
    assert [poi.poi_id for poi in message.pois] == [poi.poi_id for poi in target.pois]
    for told, known in zip(message.pois, target.pois, strict=True):
        assert told.mass == known.mass
        assert told.probability == known.probability or (known.probability is None and math.isnan(told.probability))


@settings(max_examples=40)
@given(
    st.lists(st.text("aZ0_.-", min_size=1, max_size=20), max_size=5),
    st.text(st.characters(exclude_characters="\0", codec="utf-8"), max_size=50),
    st.integers(0, (2**31 - 1) * 10**9),
)
def test_any_answer_comes_back_as_it_went(poi_ids, reason, ended_ns):
    target = TARGET.model_copy(update={"poi_ids": poi_ids, "reason": reason, "ended_ns": ended_ns})
    message = JAZZY.decode(POINTED_TARGET, JAZZY.encode(pointed_target(JAZZY, target, "map")))
    assert (message.poi_ids, message.reason) == (poi_ids, reason)
    assert message.ended.sec * 10**9 + message.ended.nanosec == ended_ns


def test_a_time_beyond_what_ros_can_say_is_its_last_second():
    far = TARGET.model_copy(update={"stamp_ns": 2**63 - 1, "started_ns": 2**63 - 1})
    message = JAZZY.decode(POINTED_TARGET, JAZZY.encode(pointed_target(JAZZY, far, "map")))
    assert message.header.stamp.sec == message.started.sec == 2**31 - 1


# --- who is seen where ------------------------------------------------------------------------------------------------


def test_faces_and_bodies_have_their_boxes_as_shares_of_the_picture():
    people = people_of(
        tracks(
            track("face", 3, (320, 120, 64, 96), 0.9),
            track("left_hand", 3, (480, 240, 32, 48), 0.5),
            track("right_hand", None, (0, 0, 10, 10)),
            track("unknown", 3, (0, 0, 600, 400)),
            track("right_hand", 4, (-10, 470, 20, 40)),
        )
    )
    assert set(people.faces) == {"p3"}
    face, body = people.faces["p3"], people.bodies["p3"]
    assert (face.xmin, face.ymin, face.xmax, face.ymax) == (0.5, 0.25, 0.6, 0.45)
    assert face.confidence == 0.9
    assert (body.xmin, body.ymin, body.xmax, body.ymax) == (0.5, 0.25, 0.8, 0.6)
    assert body.confidence == 0.5
    outside = people.bodies["p4"]
    assert (outside.xmin, outside.ymax) == (0.0, 1.0)


def test_a_head_stands_where_its_width_and_the_lens_say():
    mount = CameraMount()
    face = track("face", 0, (319.5 - 30, 239.5 - 40, 60, 80))
    (place,) = head_places(tracks(face), [pose(0, 0.0)], LENS, mount).values()
    assert place.position_m == pytest.approx((0, 0, LENS.matrix[0] * FACE_WIDTH_M / 60), abs=1e-9)
    (nearer,) = head_places(tracks(face), [pose(0, 0.0, face_width_px=120)], LENS, mount).values()
    assert nearer.position_m[2] == pytest.approx(place.position_m[2] / 2)


@pytest.mark.parametrize(
    ("yaw_deg", "looks"), [(0, (0, 0, -1)), (90, (1, 0, 0)), (-90, (-1, 0, 0)), (180, (0, 0, 1)), (45, (0.7071, 0, -0.7071))]
)
def test_a_head_looks_by_its_yaw_positive_toward_the_images_right(yaw_deg, looks):
    face = track("face", 0, (319.5 - 30, 239.5 - 40, 60, 80))
    (place,) = head_places(tracks(face), [pose(0, yaw_deg)], LENS, CameraMount()).values()
    assert turned(place.face, (1, 0, 0)) == pytest.approx(looks, abs=1e-4)  # x out of the face
    assert turned(place.face, (0, 0, 1)) == pytest.approx((0, -1, 0), abs=1e-9)  # z up
    assert turned(place.gaze, (0, 0, 1)) == pytest.approx(looks, abs=1e-4)  # z along the look
    assert turned(place.gaze, (0, 1, 0)) == pytest.approx((0, 1, 0), abs=1e-9)  # y down


@given(st.floats(-180, 180), st.floats(-40, 40), st.floats(-30, 30), st.floats(20, 600), st.floats(20, 440), st.floats(10, 100))
def test_turns_are_turns_and_heads_upright_however_the_camera_is_mounted(yaw_deg, pitch, roll, x, y, width):
    mount = CameraMount(pitch_up_deg=pitch, roll_deg=roll, yaw_deg=12.0)
    face = track("face", 0, (x - width / 2, y - width / 2, width, width))
    (place,) = head_places(tracks(face), [pose(0, yaw_deg)], LENS, mount).values()
    for quaternion in (place.face, place.gaze):
        assert math.hypot(*quaternion) == pytest.approx(1)
    assert to_base(tuple(turned(place.face, (0, 0, 1))), mount) == pytest.approx((0, 0, 1), abs=1e-6)
    # The angle seen from above between the look and the way to the camera is the yaw.
    look, back = to_base(tuple(turned(place.gaze, (0, 0, 1))), mount), to_base(tuple(-np.array(place.position_m)), mount)
    angle = math.degrees(math.atan2(back[0] * look[1] - back[1] * look[0], back[0] * look[0] + back[1] * look[1]))
    assert (angle - yaw_deg + 180) % 360 - 180 == pytest.approx(0, abs=1e-5)


def test_who_has_no_known_yaw_has_no_transform():
    face = track("face", 0, (300, 200, 60, 80))
    lost = HeadPose(person_id=0, status="lost")
    assert head_places(tracks(face), [lost], LENS, CameraMount()) == {}
    assert head_places(tracks(face), [pose(1, 0.0)], LENS, CameraMount()) == {}
    assert head_places(tracks(track("face", 0, (300, 200, 0, 0))), [pose(0, 0.0)], LENS, CameraMount()) == {}
