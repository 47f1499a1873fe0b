import numpy as np
import pytest
from deixis_headpose.initialise import Initialiser, frontal_pose
from deixis_runtime.lens import Lens
from deixis_schemas.anatomy import FACE_WIDTH_M
from deixis_schemas.messages import FrontalFace

CENTRE = (100.0, 80.0)
S = 10**9


def sighting(x: float = 100.0, width: float = 50.0) -> FrontalFace:
    return FrontalFace(centre_px=(x, 80.0), width_px=width)


def test_one_sighting_that_lands_elsewhere_does_not_start_a_head_nor_spoil_the_others() -> None:
    start = Initialiser(3)
    faces = [sighting(), sighting(130.0), sighting(101.0)]
    assert [start.update(face, CENTRE, k) for k, face in enumerate(faces)] == [None] * 3
    agreed = start.update(sighting(102.0, 51.0), CENTRE, 3)
    assert agreed is not None
    assert agreed.centre_px == pytest.approx((101.0, 80.0))
    assert agreed.width_px == pytest.approx(151 / 3)


def test_frames_in_which_the_tracker_did_not_look_neither_help_nor_harm() -> None:
    start = Initialiser(2)
    assert [start.update(face, CENTRE, k) for k, face in enumerate([sighting(), None, None])] == [None] * 3
    assert start.update(sighting(), CENTRE, 3) is not None


def test_a_sighting_of_long_ago_does_not_count() -> None:
    start = Initialiser(2)
    assert start.update(sighting(), CENTRE, 0) is None
    assert start.update(sighting(), CENTRE, 3 * S) is None
    assert start.update(sighting(), CENTRE, 4 * S) is not None


def test_a_person_may_walk_while_the_sightings_are_collected() -> None:
    start = Initialiser(3)
    agreed = [start.update(sighting(100.0 + 30 * k), (100.0 + 30 * k, 80.0), k) for k in range(3)]
    assert agreed[-1] is not None
    assert agreed[-1].centre_px[0] == pytest.approx(160.0)


@pytest.mark.parametrize("distortion", [(), (-0.3, 0.08, 0.0, 0.0, 0.0)])
@pytest.mark.parametrize("focal_px", [300.0, 560.0])
def test_a_head_is_placed_where_the_lens_says_and_looks_into_the_camera(focal_px: float, distortion: tuple[float, ...]) -> None:
    lens, size = Lens(640, 480, (focal_px, focal_px, 319.5, 239.5), "plumb_bob", distortion), (640, 480)
    camera = lens.pinhole_at((500.0, 200.0), size)
    face = FrontalFace(centre_px=(500.0, 200.0), width_px=camera.focal_px * FACE_WIDTH_M / 2.0)
    pose = frontal_pose(face, camera)
    assert pose.position_m[2] == pytest.approx(2.0)
    assert pose.position_m[:2] / 2.0 == pytest.approx(np.array(lens.ray((500.0, 200.0), size)), abs=1e-6)
    assert pose.angles_deg() == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
