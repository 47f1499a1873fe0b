"""The codec refuses what it must and gives back what it got."""

import contextlib
import math

import msgpack
import pytest
from deixis_schemas import codec
from deixis_schemas import messages as m
from deixis_schemas.samples import FRAME, SAMPLES
from hypothesis import given
from hypothesis import strategies as st

TRACKS = m.Tracks.derive(FRAME, m.Producer("tracker", "t"), width=4, height=4)
LABEL = codec.encoding_of(m.Tracks)
finite = st.floats(-1000, 1000)


def changed(message, **fields):
    return msgpack.packb({**message.model_dump(), **fields})


@given(
    st.lists(
        st.builds(
            m.Track,
            track_id=st.integers(0, 2**40),
            person_id=st.none() | st.integers(0, 100),
            kind=st.sampled_from(["face", "left_hand", "right_hand", "unknown"]),
            kind_probabilities=st.just(m.KindProbabilities(face=1.0)),
            centroid_px=st.tuples(finite, finite),
            bbox_px=st.tuples(finite, finite, st.floats(0, 1000), st.floats(0, 1000)),
            velocity_px_s=st.tuples(finite, finite),
            contour=st.binary(max_size=40).map(lambda data: data[: len(data) // 4 * 4]),
        ),
        max_size=4,
    )
)
def test_tracks_come_back_as_they_were_sent(tracks):
    message = m.Tracks.derive(FRAME, m.Producer("tracker", "t"), width=4, height=4, tracks=tracks)
    assert codec.decode(m.Tracks, codec.encode(message), LABEL) == message


@given(st.binary(max_size=200))
def test_random_bytes_are_refused_or_valid_never_a_crash(payload):
    with contextlib.suppress(codec.Malformed):
        assert isinstance(codec.decode(m.Tracks, payload, LABEL), m.Tracks)


@given(st.sampled_from(SAMPLES), st.data())
def test_a_truncated_message_is_malformed(sample, data):
    payload = codec.encode(sample)
    cut = data.draw(st.integers(0, len(payload) - 1))
    with pytest.raises(codec.Malformed):
        codec.decode(type(sample), payload[:cut], codec.encoding_of(type(sample)))


def test_another_version_is_told_from_another_type():
    payload = codec.encode(TRACKS)
    with pytest.raises(codec.WrongVersion, match="version '3'"):
        codec.decode(m.Tracks, payload, "application/msgpack;Tracks/3")
    with pytest.raises(codec.WrongType, match="expected 'application/msgpack;Tracks/2'"):
        codec.decode(m.Tracks, payload, "application/msgpack;Frame/1")
    with pytest.raises(codec.WrongType):
        codec.decode(m.Tracks, payload, "zenoh/bytes")


def test_unknown_fields_are_ignored():
    assert codec.decode(m.Tracks, changed(TRACKS, colour="red"), LABEL) == TRACKS


@pytest.mark.parametrize(
    ("message", "fields", "named"),
    [
        (TRACKS, {"seq": -1}, "seq"),
        (TRACKS, {"seq": None}, "seq"),
        (TRACKS, {"stage": "a/b"}, "stage"),
        (TRACKS, {"tracks": [{}]}, "tracks.0"),
        (TRACKS, {"tracks": 3}, "tracks"),
        (TRACKS, {"width": 100000}, "width"),
        (FRAME, {"data": b"123"}, "data"),
        (FRAME, {"encoding": "yuv"}, "encoding"),
        (m.Poi(poi_id="a", position_m=(0, 0, 0)), {"position_m": [math.nan, 0, 0]}, "position_m.0"),
        (m.Poi(poi_id="a", position_m=(0, 0, 0)), {"position_m": [math.inf, 0, 0]}, "position_m.0"),
        (m.Poi(poi_id="a", position_m=(0, 0, 0)), {"position_m": [0, 0]}, "position_m"),
        (m.Poi(poi_id="a", position_m=(0, 0, 0)), {"poi_id": "a/*"}, "poi_id"),
    ],
)
def test_a_field_out_of_bounds_is_named(message, fields, named):
    type_ = type(message)
    with pytest.raises(codec.Malformed, match=named.replace(".", r"\.")):
        codec.decode(type_, changed(message, **fields), codec.encoding_of(type_))


def test_a_pose_that_tracks_needs_its_sigma():
    with pytest.raises(codec.Malformed, match="yaw_sigma_deg"):
        codec.validate(m.HeadPose, {"person_id": 0, "status": "tracking", "yaw_deg": 3.0})


@pytest.mark.parametrize("angle", ["bearing", "elevation"])
def test_an_angle_of_a_gesture_and_its_sigma_come_together(angle):
    stroke = {"person_id": 0, "phase": "stroke", "gesture": "point_left"}
    for name in ("deg", "sigma_deg"):
        with pytest.raises(codec.Malformed, match=f"{angle}_sigma_deg: .* come together"):
            codec.validate(m.Gesture, stroke | {f"{angle}_{name}": 3.0})
    codec.validate(m.Gesture, stroke | {f"{angle}_deg": 3.0, f"{angle}_sigma_deg": 3.0})


def test_a_gesture_points_no_higher_than_straight_up():
    stroke = {"person_id": 0, "phase": "stroke", "gesture": "point_left", "elevation_sigma_deg": 3.0}
    with pytest.raises(codec.Malformed, match="elevation_deg"):
        codec.validate(m.Gesture, stroke | {"elevation_deg": 90.1})


HEAD = {"person_id": 0, "status": "tracking", "yaw_deg": 3.0, "yaw_sigma_deg": 2.0, "pitch_deg": 1.0, "roll_deg": 0.0}


def test_a_head_without_covariance_decodes_as_before():
    message = m.HeadPoses.derive(FRAME, m.Producer("headpose", "h"), poses=[m.HeadPose(**HEAD)])
    content = message.model_dump()
    del content["poses"][0]["covariance_deg2"]
    assert codec.decode(m.HeadPoses, msgpack.packb(content), codec.encoding_of(m.HeadPoses)) == message


def test_a_covariance_comes_back_as_it_was_sent():
    pose = m.HeadPose(**HEAD, covariance_deg2=(4.0, -1.0, 0.5, 9.0, 0.0, 1.0))
    message = m.HeadPoses.derive(FRAME, m.Producer("headpose", "h"), poses=[pose])
    back = codec.decode(m.HeadPoses, codec.encode(message), codec.encoding_of(m.HeadPoses))
    assert back.poses[0].covariance_deg2 == (4.0, -1.0, 0.5, 9.0, 0.0, 1.0)


def test_a_covariance_may_be_of_full_correlation_and_its_sigma_rounded():
    edge = m.HeadPose(**HEAD | {"yaw_sigma_deg": 2.0 * 1.0009}, covariance_deg2=(4.0, 6.0, 2.0, 9.0, 3.0, 1.0))
    assert edge.covariance_deg2 is not None
    tiny = m.HeadPose(**HEAD | {"yaw_sigma_deg": 1e-4}, covariance_deg2=(1e-8, 0.0, 0.0, 32400.0, 0.0, 1e-8))
    assert tiny.covariance_deg2 is not None


@pytest.mark.parametrize(
    ("covariance", "named"),
    [
        ((0.0, 0.0, 0.0, 1.0, 0.0, 1.0), "covariance_deg2.0: .*greater than 0"),
        ((4.0, 0.0, 0.0, -1.0, 0.0, 1.0), "covariance_deg2.3: .*greater than 0"),
        ((4.0, 0.0, 0.0, 1.0, 0.0, 32401.0), "covariance_deg2.5: .*less than or equal to 32400"),
        ((4.0, 0.0, math.nan, 1.0, 0.0, 1.0), "covariance_deg2.2: .*finite"),
        ((4.0, 0.0, 0.0, math.inf, 0.0, 1.0), "covariance_deg2.3: "),
        ((4.0, 0.0, 0.0, 1.0, 0.0), "covariance_deg2"),
        ((4.0, 2.1, 0.0, 1.0, 0.0, 1.0), "covariance_deg2: not positive semidefinite"),
        # Each pair of angles could be so, the three of them cannot.
        ((4.0, 1.8, 1.8, 1.0, -0.9, 1.0), "covariance_deg2: not positive semidefinite"),
        ((4.0, 2.0, 0.0, 5e-324, 0.0, 5e-324), "covariance_deg2: not positive semidefinite"),
        ((4.1, 0.0, 0.0, 1.0, 0.0, 1.0), "yaw_sigma_deg: 2, but the variance of yaw in covariance_deg2 makes it 2.02"),
    ],
)
def test_what_is_no_covariance_is_refused_and_named(covariance, named):
    with pytest.raises(codec.Malformed, match=named):
        codec.validate(m.HeadPose, HEAD | {"covariance_deg2": covariance})


def test_too_many_bytes_are_refused_before_they_are_read():
    with pytest.raises(codec.Malformed, match="more than the 100 allowed"):
        codec.decode(m.Tracks, bytes(101), LABEL, max_bytes=100)


def test_derived_messages_cannot_forget_frame_and_producer():
    derived = m.Gestures.derive(FRAME, m.Producer("gesture", "g-1"), seq=99, stage="else")
    assert (derived.frame_id, derived.stage, derived.instance) == (FRAME.frame_id, "gesture", "g-1")


def test_json_reads_well_in_a_terminal_and_holds_the_same():
    state = next(sample for sample in SAMPLES if isinstance(sample, m.State))
    lines = codec.encode_json(state).decode().splitlines()
    assert 20 < len(lines) < 120
    assert max(map(len, lines)) < 180
    assert any(line.strip().startswith('{"poi_id": "vase", "mass": 0.9, "belief": 0.9') for line in lines)
    assert codec.decode_json(m.State, "\n".join(lines)) == state


def test_json_of_a_number_has_six_digits_after_the_point():
    pose = m.RobotPose(stamp_ns=1, stage="robot", instance="r", x_m=0.1 + 0.2, y_m=12345.6789012, yaw_deg=1e-7)
    assert '"x_m": 0.3, "y_m": 12345.678901, "yaw_deg": 1e-07' in codec.encode_json(pose).decode()


def test_json_that_nobody_reads_through_is_one_line():
    frame = next(sample for sample in SAMPLES if isinstance(sample, m.Frame))
    large = frame.model_copy(update={"data": bytes(1 << 20)})
    assert codec.encode_json(large).count(b"\n") == 0
