"""Pictures, lenses and stamps of ROS 2 as frames."""

import math
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from deixis_camera.config import CameraConfig
from deixis_ros2.config import DEVICE_ONLY, RosAnswerConfig, RosCameraConfig
from deixis_ros2.intrinsics import LensRefused, assumed, of_camera_info
from deixis_ros2.names import Endpoint
from deixis_ros2.pictures import LAYOUTS, Jpeg, PictureRefused, of_compressed, of_image
from deixis_ros2.preparation import prepare
from deixis_ros2.robot_pose import PoseRefused, of_message
from deixis_ros2.ros_sources import why_silent
from deixis_ros2.stamping import Stamping
from deixis_runtime.images import decode_image
from deixis_schemas.messages import Frame
from pydantic import ValidationError

BGR = cv2.applyColorMap(np.tile(np.arange(0, 256, 2, dtype=np.uint8), (96, 1)), cv2.COLORMAP_JET)
BGR = np.ascontiguousarray(BGR)  # 128 x 96
GREY = cv2.cvtColor(BGR, cv2.COLOR_BGR2GRAY)


def image(samples, encoding, *, padding=0, **changes):
    rows = np.ascontiguousarray(samples).view(np.uint8).reshape(samples.shape[0], -1)
    data = np.pad(rows, ((0, 0), (0, padding)))
    fields = {"width": samples.shape[1], "height": samples.shape[0], "step": data.shape[1], "encoding": encoding}
    return SimpleNamespace(**{**fields, "is_bigendian": 0, "data": data.reshape(-1), **changes})


@pytest.mark.parametrize(
    ("encoding", "samples"),
    [
        ("bgr8", BGR),
        ("8UC3", BGR),
        ("rgb8", BGR[:, :, ::-1]),
        ("bgra8", np.dstack([BGR, GREY])),
        ("rgba8", np.dstack([BGR[:, :, ::-1], GREY])),
        ("bgr16", BGR.astype("<u2") << 8),
        ("rgb16", (BGR[:, :, ::-1].astype("<u2") << 8) + 5),
    ],
)
def test_colours_come_out_as_they_were(encoding, samples):
    assert np.array_equal(of_image(image(samples, encoding)), BGR)


@pytest.mark.parametrize("padding", [0, 1, 64])
def test_rows_may_be_padded(padding):
    assert np.array_equal(of_image(image(BGR, "bgr8", padding=padding)), BGR)
    without_the_last = image(BGR, "bgr8", padding=padding)
    without_the_last.data = without_the_last.data[: without_the_last.data.size - padding]
    assert np.array_equal(of_image(without_the_last), BGR)


def test_grey_stays_grey_at_8_bits_and_at_16_of_either_byte_order():
    for encoding in ("mono8", "8UC1"):
        assert np.array_equal(of_image(image(GREY, encoding)), GREY)
    assert np.array_equal(of_image(image(GREY.astype("<u2") << 8, "mono16")), GREY)
    assert np.array_equal(of_image(image((GREY.astype(np.uint16) << 8).astype(">u2"), "mono16", is_bigendian=1)), GREY)


@pytest.mark.parametrize("encoding", ["yuv422", "uyvy", "yuv422_yuy2", "yuyv"])
def test_yuv_is_close_to_what_it_was_made_of(encoding):
    smooth = cv2.GaussianBlur(BGR, (0, 0), 4)
    y, u, v = cv2.split(cv2.cvtColor(smooth, cv2.COLOR_BGR2YUV))
    luma, scaled = 16 + y * (219 / 255), 128 + (np.dstack([u, v]) - 128.0) * (224 / 255)
    chroma = np.where(np.arange(128) % 2, scaled[:, :, 1], scaled[:, :, 0])
    pair = [chroma, luma] if encoding in ("yuv422", "uyvy") else [luma, chroma]
    got = of_image(image(np.dstack(pair).round().astype(np.uint8), encoding)).astype(int)
    # Studio and full range differ between conversions by a few per cent; swapped bytes would be off by far more.
    assert np.abs(got - smooth).mean() < 16


@pytest.mark.parametrize(("pattern", "rows"), {"rggb": "rggb", "bggr": "bggr", "gbrg": "gbrg", "grbg": "grbg"}.items())
def test_a_bayer_pattern_gives_its_colour_back(pattern, rows):
    colour = {"r": 200, "g": 120, "b": 30}
    mosaic = np.tile(np.array([[colour[rows[0]], colour[rows[1]]], [colour[rows[2]], colour[rows[3]]]], np.uint8), (48, 64))
    got = of_image(image(mosaic, f"bayer_{pattern}8"))
    assert np.array_equal(np.median(got.reshape(-1, 3), axis=0), [30, 120, 200])


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"encoding": "32FC1"}, "encoding '32FC1' is none of bgr8, "),
        ({"encoding": "16UC1"}, "encoding '16UC1'"),  # depth: no picture
        ({"step": 100}, "step"),
        ({"height": 97}, "data"),
        ({"width": 0}, "width and height: 0 x 96"),
        ({"width": 9000}, "8192"),
        ({"height": 2**32 - 1}, "8192"),
        ({"step": 2**32 - 1}, "data"),
    ],
)
def test_pictures_that_cannot_be_are_refused_by_name(changes, says):
    with pytest.raises(PictureRefused, match=says):
        of_image(image(BGR, **{"encoding": "bgr8", **changes}))


def test_colours_in_pairs_need_an_even_width():
    with pytest.raises(PictureRefused, match="127 is odd"):
        of_image(image(np.zeros((96, 127, 2), np.uint8), "uyvy"))


def test_every_encoding_that_is_named_is_converted():
    for encoding, layout in LAYOUTS.items():
        samples = np.zeros((64, 64, layout.channels), "<u2" if layout.depth_bytes == 2 else np.uint8)
        assert of_image(image(samples, encoding)).shape[:2] == (64, 64)


def compressed(data, text="jpeg"):
    return SimpleNamespace(data=np.frombuffer(data, np.uint8), format=text)


def test_a_jpeg_goes_on_as_it_came_and_a_png_as_its_pixels():
    jpeg = cv2.imencode(".jpg", BGR)[1].tobytes()
    picture = of_compressed(compressed(jpeg, "rgb8; jpeg compressed bgr8"))
    assert picture == Jpeg(128, 96, jpeg)
    assert prepare(picture, "auto", 85, 1280).data == jpeg
    assert np.array_equal(of_compressed(compressed(cv2.imencode(".png", BGR)[1].tobytes(), "png")), BGR)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "neither"),
        (b"\xff\xd8\xff", "JPEG"),
        (b"\x89PNG\r\n\x1a\n", "neither"),
        (b"RIFF" + bytes(40), "neither JPEG nor PNG"),
        (b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR" + b"\0\0\xff\xff\0\0\xff\xff" + bytes(20), "65535 x 65535"),
        (b"\xff\xd8\xff\xc0\0\x11\x08\xff\xff\xff\xff" + bytes(20), "65535 x 65535"),
        (b"\x89PNG\r\n\x1a\n" + b"\0\0\0\rIHDR" + b"\0\0\1\0\0\0\1\0" + bytes(20), "cannot be read"),
    ],
)
def test_a_compressed_picture_that_is_none_is_refused_before_it_fills_the_memory(data, says):
    with pytest.raises(PictureRefused, match=says):
        of_compressed(compressed(data))


def as_frame(prepared):
    return Frame(run=0, seq=0, stamp_ns=1, stage="camera", instance="i", **prepared.__dict__)


def test_pictures_are_published_raw_scaled_or_as_jpeg():
    assert np.array_equal(decode_image(as_frame(prepare(BGR, "auto", 85, 1280))), BGR)
    assert as_frame(prepare(GREY, "auto", 85, 1280)).encoding == "mono8"
    assert prepare(cv2.resize(BGR, (1920, 1080)), "auto", 85, 1280).__dict__.items() >= {"width": 1280, "height": 720}.items()
    jpeg = as_frame(prepare(BGR, "jpeg", 95, 1280))
    assert jpeg.encoding == "jpeg"
    assert np.abs(decode_image(jpeg).astype(int) - BGR).mean() < 4
    large = Jpeg(256, 192, cv2.imencode(".jpg", cv2.resize(BGR, (256, 192)))[1].tobytes())
    assert (prepare(large, "auto", 85, 128).width, prepare(large, "auto", 85, 128).encoding) == (128, "jpeg")
    assert prepare(large, "bgr8", 85, 1280).encoding == "bgr8"


def test_a_picture_too_small_to_see_anybody_in_is_refused():
    with pytest.raises(PictureRefused, match="smaller than 64"):
        prepare(BGR[:60], "auto", 85, 1280)
    with pytest.raises(PictureRefused, match="smaller than 64"):
        prepare(cv2.resize(BGR, (2000, 64)), "auto", 85, 1000)


# --- the lens ---------------------------------------------------------------------------------------------------------


def camera_info(**changes):
    roi = SimpleNamespace(x_offset=0, y_offset=0, width=0, height=0, do_rectify=False)
    fields = {
        "width": 640, "height": 480, "distortion_model": "plumb_bob", "d": [0.1, -0.2, 0.001, 0.002, 0.0],
        "k": [560.0, 0, 320, 0, 561, 240, 0, 0, 1], "p": [500.0, 0, 310, 0, 0, 500, 230, 0, 0, 0, 1, 0],
        "binning_x": 0, "binning_y": 0, "roi": roi,
    }  # fmt: skip
    return SimpleNamespace(**{**fields, **changes})


def test_the_lens_is_k_and_of_rectified_pictures_p():
    lens = of_camera_info(camera_info(), False, "/camera_info")
    assert (lens.camera_matrix, lens.distortion_model) == ((560, 0, 320, 0, 561, 240, 0, 0, 1), "plumb_bob")
    assert lens.distortion == (0.1, -0.2, 0.001, 0.002, 0.0)
    assert "/camera_info" in lens.source
    assert lens.fits(320, 240)
    assert not lens.fits(640, 360)
    rectified = of_camera_info(camera_info(), True, "/camera_info")
    assert (rectified.camera_matrix, rectified.distortion_model, rectified.distortion) == (
        (500, 0, 310, 0, 500, 230, 0, 0, 1), "none", (),
    )  # fmt: skip


def test_a_camera_without_distortion_may_leave_the_model_empty():
    assert of_camera_info(camera_info(distortion_model="", d=[]), False, "t").distortion_model == "none"
    assert of_camera_info(camera_info(distortion_model="x", d=[0.0] * 5), False, "t").distortion == ()


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"k": [0.0] * 9}, "k: .*uncalibrated"),
        ({"k": [math.nan, 0, 320, 0, 561, 240, 0, 0, 1]}, "k: holds what is no number"),
        ({"d": [math.inf] * 5}, "d: holds what is no number"),
        ({"distortion_model": "fov"}, "distortion_model: 'fov'"),
        ({"d": [0.1] * 3}, "d: 3 numbers"),
        ({"binning_x": 2, "binning_y": 2}, "binning"),
        ({"roi": SimpleNamespace(x_offset=10, y_offset=0, width=100, height=100)}, "roi"),
        ({"width": 0}, "k: "),
    ],
)
def test_a_lens_that_cannot_be_used_is_refused_by_field(changes, says):
    with pytest.raises(LensRefused, match=says):
        of_camera_info(camera_info(**changes), False, "t")


def test_without_a_lens_a_field_of_view_stands_in():
    lens = assumed(640, 480, 60.0)
    assert lens.camera_matrix[0] == pytest.approx(320 / math.tan(math.radians(30)))
    assert "assumed" in lens.source


# --- stamps -----------------------------------------------------------------------------------------------------------

NOW = 1_800_000_000 * 10**9


def test_a_picture_is_stamped_by_its_header():
    stamped = Stamping(by_header=True, most_off_s=5.0).stamp(NOW - 30_000_000, NOW)
    assert (stamped.stamp_ns, stamped.new_run, stamped.complaint) == (NOW - 30_000_000, False, "")


@pytest.mark.parametrize(
    ("header_ns", "says"), [(0, "not set"), (NOW - 6 * 10**9, "6.0 s behind"), (NOW + 7 * 10**9, "7.0 s ahead")]
)
def test_a_stamp_of_another_clock_is_not_used_and_that_is_said(header_ns, says):
    stamped = Stamping(by_header=True, most_off_s=5.0).stamp(header_ns, NOW)
    assert stamped.stamp_ns == NOW
    assert says in stamped.complaint


def test_by_arrival_no_header_is_complained_of():
    assert Stamping(by_header=False, most_off_s=5.0).stamp(0, NOW).complaint == ""


def test_a_header_that_goes_back_begins_another_run_and_stamps_rise_within_one():
    stamping = Stamping(by_header=True, most_off_s=5.0)
    got = [stamping.stamp(NOW + ms * 10**6, NOW) for ms in (0, 33, 33, 66, 10, 43)]
    assert [item.new_run for item in got] == [False, False, False, False, True, False]
    assert got[1].stamp_ns < got[2].stamp_ns < got[3].stamp_ns
    assert got[4].stamp_ns == NOW + 10 * 10**6


# --- what is wrong where nothing comes --------------------------------------------------------------------------------


def test_it_is_said_why_no_picture_comes():
    def why(*publishers):
        return why_silent("/camera/image_raw", "sensor_msgs/msg/Image", "RIHS01_d3", publishers)

    image_type = "sensor_msgs::msg::dds_::Image_"
    assert "no ROS node publishes /camera/image_raw" in why()
    other = Endpoint("/driver", "/camera/image_raw", "sensor_msgs::msg::dds_::CompressedImage_", "RIHS01_15")
    assert "carries sensor_msgs::msg::dds_::CompressedImage_ by /driver" in why(other)
    older = Endpoint("/driver", "/camera/image_raw", image_type, "TypeHashNotSupported")
    assert "ros.distribution" in why(older)
    assert "/driver sends nothing" in why(older, Endpoint("/driver", "/camera/image_raw", image_type, "RIHS01_d3"))


# --- the robot's pose -------------------------------------------------------------------------------------------------


LEFT_40_DEG = (0.0, 0.0, math.sin(math.radians(20)), math.cos(math.radians(20)))


def pose(frame_id="map", x=1.5, turn=LEFT_40_DEG):
    position = SimpleNamespace(x=x, y=-2.0, z=0.0)
    orientation = SimpleNamespace(**dict(zip("xyzw", turn, strict=True)))
    inner = SimpleNamespace(position=position, orientation=orientation)
    return SimpleNamespace(header=SimpleNamespace(frame_id=frame_id), pose=SimpleNamespace(pose=inner))


def test_the_robots_pose_is_its_place_and_its_yaw():
    x, y, yaw = of_message(pose(), "map")
    assert (x, y) == (1.5, -2.0)
    assert yaw == pytest.approx(40.0)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"frame_id": "odom"}, "'odom' is not 'map'"),
        ({"x": math.nan}, "no number"),
        ({"x": 1e9}, "away"),
        ({"turn": (0.0, 0.0, 0.0, 0.0)}, "length 1"),
    ],
)
def test_a_pose_that_cannot_be_is_refused_by_field(changes, says):
    with pytest.raises(PoseRefused, match=says):
        of_message(pose(**changes), "map")


# --- settings ---------------------------------------------------------------------------------------------------------


def test_a_site_made_for_our_own_camera_serves_this_one_and_a_misspelt_name_is_refused():
    assert set(CameraConfig.model_fields) - set(RosCameraConfig.model_fields) == DEVICE_ONLY
    config = RosCameraConfig.model_validate({"source": "0", "calibration": "x.yaml", "mount": {"yaw_deg": 3.0}})
    assert config.mount.yaw_deg == 3.0
    with pytest.raises(ValidationError, match="imagee"):
        RosCameraConfig.model_validate({"imagee": "/a"})


def test_the_domain_is_that_of_the_environment_unless_it_is_set(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert RosAnswerConfig().ros.domain == 7
    assert RosAnswerConfig.model_validate({"ros": {"domain": 3}}).ros.domain == 3
    monkeypatch.setenv("ROS_DOMAIN_ID", "seven")
    with pytest.raises(ValidationError, match="domain"):
        RosAnswerConfig()


@pytest.mark.parametrize("name", ["camera image", "/a/*", "a//b", ""])
def test_a_name_that_is_no_topics_is_refused(name):
    with pytest.raises(ValidationError, match="no name of a ROS topic"):
        RosCameraConfig.model_validate({"image": name})
