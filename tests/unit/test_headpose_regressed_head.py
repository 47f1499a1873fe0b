from dataclasses import replace

import numpy as np
import pytest
from deixis_headpose.config import HeadposeConfig
from deixis_headpose.head import rotation_of
from deixis_headpose.head_crop import CROP_M, HeadPlace, crop_to_picture
from deixis_headpose.head_reader import HeadReader, found_by
from deixis_headpose.regressed_head import CALIBRATION, RegressedHead
from deixis_headpose.regression import EARS_APART_M, Look, Regression
from deixis_headpose.sight import HeadState, Sight, centre_of
from deixis_runtime.lens import Pinhole
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import Track
from face_track import face_track

CAMERA = Pinhole(500.0, 319.5, 239.5)
PICTURE = np.full((480, 640, 3), 90, np.uint8)
FRAME_NS = 33_333_333
CONFIG = HeadposeConfig()


def a_look(yaw_deg: float, sigma_deg: float = 3.0, offset: tuple[float, float] = (0.0, 0.0), head: float = 0.99) -> Look:
    sigma = np.full(3, np.radians(sigma_deg))
    return Look(rotation_of(np.radians(yaw_deg), 0.0), sigma, 0.01, np.array(offset), EARS_APART_M / CROP_M, head)


def followed(looks: list[Look | None]) -> list[HeadState]:
    head = RegressedHead(CONFIG, Regression())
    return [head.take(look, number * FRAME_NS) for number, look in enumerate(looks)]


def a_face(x: float = 300, y: float = 200, width: float = 60) -> Track:
    return face_track(x, y, width)


class Shown(Regression):
    """Sees a head at an offset from wherever it looks; counts how often it was asked."""

    def __init__(self, offset: tuple[float, float] = (0.0, 0.0), head: float = 0.99) -> None:
        self.offset, self.head, self.asked = offset, head, 0

    def look(self, crop: np.ndarray) -> Look:
        assert crop.shape == (64, 64, 3)
        self.asked += 1
        return replace(a_look(0.0, offset=self.offset), head=self.head)


class Bright(Regression):
    """Sees a head as wide as what is bright in the crop."""

    def __init__(self) -> None:
        pass

    def look(self, crop: np.ndarray) -> Look:
        wide = float((crop[32, :, 0] > 172).mean())
        return replace(a_look(0.0), breadth=wide * EARS_APART_M / FACE_WIDTH_M, head=0.99 if wide else 0.0)


class Unreasonable(Regression):
    """Sees a head of that breadth wherever it looks."""

    def __init__(self, breadth: float) -> None:
        self.breadth = breadth

    def look(self, crop: np.ndarray) -> Look:
        assert crop.shape == (64, 64, 3)
        return replace(a_look(0.0), breadth=self.breadth)


# --- through time ---------------------------------------------------------------------------------------------------------


def test_one_look_is_enough_also_in_profile() -> None:
    state = followed([a_look(-85)])[0]
    assert state.status == "tracking"
    assert state.angles_deg is not None
    assert state.angles_deg[0] == pytest.approx(-85)


def test_beyond_its_range_the_side_is_said() -> None:
    states = followed([a_look(150)] * 5 + [a_look(-150)] * 40)
    assert (states[4].status, states[4].side, states[4].beyond_deg) == ("out_of_range", "left", HeadposeConfig().range_deg)
    assert (states[-1].status, states[-1].side) == ("out_of_range", "right")


def test_a_look_that_may_lie_within_the_range_is_not_called_beyond_it() -> None:
    """Seen at the border of the picture: a sliver of a head at -58 was read as beyond 130, and fusion took that as certain."""
    state = followed([a_look(145, sigma_deg=35)])[0]
    assert state.status == "tracking"
    assert (state.sigma_deg or 0) > 15


def test_a_head_that_is_not_seen_is_held_and_then_lost_and_never_called_far() -> None:
    states = followed([a_look(60)] * 5 + [None] * 15)
    held = [state for state in states[5:] if state.status == "tracking"]
    assert [state.status for state in states[5:]] == ["tracking"] * len(held) + ["lost"] * (15 - len(held))
    assert 0.2 < len(held) * FRAME_NS * 1e-9 < 0.3
    sigmas = [state.sigma_deg for state in held]
    assert sigmas == sorted(sigmas)


def test_a_head_never_seen_is_initialising() -> None:
    assert {state.status for state in followed([None] * 20)} == {"initialising"}


def test_a_head_found_again_is_read_anew_and_not_drawn_from_where_it_was() -> None:
    state = followed([a_look(-70)] * 5 + [None] * 15 + [a_look(50)])[-1]
    assert state.angles_deg is not None
    assert state.angles_deg[0] == pytest.approx(50)


@pytest.mark.parametrize(("hold_s", "frame_s"), [(0.0, 1 / 30), (0.01, 1 / 30), (0.25, 1 / 3), (0.25, 1.0)])
def test_looks_one_after_the_other_are_weighed_together_however_short_a_head_is_held(hold_s: float, frame_s: float) -> None:
    """A hold shorter than from frame to frame switched the filter off, and single looks were told as they were."""
    head, rng = RegressedHead(HeadposeConfig(hold_s=hold_s), Regression()), np.random.default_rng(4)
    looks = 20 + rng.normal(0, 2, 200)
    states = [head.take(a_look(yaw), round(number * frame_s * 1e9)) for number, yaw in enumerate(looks)]
    apart = [abs(state.angles_deg[0] - yaw) for state, yaw in zip(states, looks, strict=True) if state.angles_deg is not None]
    assert len(apart) == 200
    assert np.count_nonzero(apart) > 190
    yaws = [state.angles_deg[0] for state in states[20:] if state.angles_deg is not None]
    assert np.std(yaws) < np.std(looks[20:])


def test_an_old_look_does_not_draw_a_head_that_is_seen_again_after_seconds_without_a_frame() -> None:
    head = RegressedHead(CONFIG, Regression())
    head.take(a_look(60), 0)
    state = head.take(a_look(0.0), 3_000_000_000)
    assert state.angles_deg is not None
    assert abs(state.angles_deg[0]) < 1


def test_a_look_that_is_hardly_sure_is_no_answer() -> None:
    assert followed([a_look(10, sigma_deg=57)])[0].status == "lost"


def test_a_head_resting_for_an_hour_returns_within_two_degrees() -> None:
    """Looks are absolute, so nothing can drift; held to it at one look each half minute, as a starved stage takes them."""
    rng = np.random.default_rng(5)
    head = RegressedHead(CONFIG, Regression())
    for number in range(120):
        head.take(a_look(30 + rng.normal(0, 1)), number * 30_000_000_000)
    for number in range(30):
        state = head.take(a_look(0.0), 3_600_000_000_000 + number * FRAME_NS)
    assert state.angles_deg is not None
    assert abs(state.angles_deg[0]) < 2


def test_the_variances_are_those_of_the_message() -> None:
    message = followed([a_look(20)] * 3)[-1].of_person(4)
    assert message.covariance_deg2 is not None
    assert message.yaw_sigma_deg == pytest.approx(message.covariance_deg2[0] ** 0.5)


def test_a_head_that_is_turned_is_less_sure_than_the_network_says() -> None:
    """Its yaw in profile by more than from the front, with the same look otherwise; a yaw beyond 90 as one before it."""
    front, aside, behind = (CALIBRATION.variances(a_look(yaw))[1][0] for yaw in (0.0, 60.0, 120.0))
    assert aside > 2 * front
    assert behind == pytest.approx(aside)


def test_many_looks_at_a_resting_head_do_not_make_it_surer_than_its_face_allows() -> None:
    _, lasting = CALIBRATION.variances(a_look(20))
    state = followed([a_look(20)] * 200)[-1]
    assert state.sigma_deg is not None
    assert state.sigma_deg**2 >= lasting[0]


# --- where to look --------------------------------------------------------------------------------------------------------


def test_a_new_head_is_looked_for_first_and_then_read() -> None:
    shown = Shown()
    reader = HeadReader(shown)
    assert reader.read(Sight(PICTURE, CAMERA, a_face(), [], 0)) is not None
    assert shown.asked == 2
    reader.read(Sight(PICTURE, CAMERA, a_face(), [], FRAME_NS))
    assert shown.asked == 3


def test_a_track_that_jumps_to_another_head_is_looked_at_anew() -> None:
    shown = Shown(offset=(0.2, 0.0))  # the head lies well beside the middle of the track's box
    reader = HeadReader(shown)
    for number in range(6):
        reader.read(Sight(PICTURE, CAMERA, a_face(), [], number * FRAME_NS))
    assert shown.asked > 7


def test_what_is_no_head_is_not_read() -> None:
    assert HeadReader(Shown(head=0.1)).read(Sight(PICTURE, CAMERA, a_face(), [], 0)) is None


def test_the_place_found_is_where_the_look_says() -> None:
    place = HeadPlace((400.0, 180.0), 50.0)
    found = found_by(a_look(0, offset=(0.25, -0.125)), place, CAMERA)
    x, y, w = crop_to_picture(place, CAMERA) @ np.array([31.5 + 16, 31.5 - 8, 1.0])
    assert found.centre_px == pytest.approx((x / w, y / w))
    assert found.face_width_px == pytest.approx(place.face_width_px, rel=0.01)


@pytest.mark.parametrize("box_px", [48, 60, 75])
def test_the_width_told_is_that_of_the_face_where_the_tracks_box_is_not(box_px: int) -> None:
    """By a fifth: hair, and a profile, change a box by as much."""
    picture = PICTURE.copy()
    picture[:, 270:330] = 255
    head, width_px = RegressedHead(CONFIG, Bright()), None
    for number in range(60):
        width_px = head.update(Sight(picture, CAMERA, a_face(width=box_px), [], number * FRAME_NS)).face_width_px
    assert width_px == pytest.approx(60, rel=0.04)
    unseen = head.update(Sight(PICTURE, CAMERA, a_face(width=box_px), [], 60 * FRAME_NS))
    assert unseen.face_width_px is None


@pytest.mark.parametrize(("breadth", "times"), [(1e12, 1.33), (1e-12, 0.75)])
def test_a_width_read_out_of_all_reason_is_held_to_that_of_the_track(breadth: float, times: float) -> None:
    """From the first frame on: no message could say it, and the stage would end."""
    head = RegressedHead(CONFIG, Unreasonable(breadth))
    for number in range(3):
        pose = head.update(Sight(PICTURE, CAMERA, a_face(width=60), [], number * FRAME_NS)).of_person(1)
        assert pose.face_width_px == pytest.approx(times * 60)


def test_the_centre_of_a_face_is_that_of_its_pixels() -> None:
    assert centre_of(a_face(300, 200, 61)) == pytest.approx((300, 200))
