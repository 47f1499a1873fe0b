import numpy as np
import pytest
from deixis_simulation.avatars import FITTING_AVATARS, HEAD, WIGGED, Avatar, AvatarError, load_avatar
from deixis_simulation.head_atlas import ATLAS_PX
from deixis_simulation.mixed_heads import mixed_head, reduced

BASE = FITTING_AVATARS[1]


def mixed(seed: int, base: str = BASE) -> Avatar:
    return mixed_head(base, FITTING_AVATARS, np.random.default_rng(seed))


def faces_at(avatar: Avatar) -> np.ndarray:
    return avatar.vertices[load_avatar(BASE).face_vertices]


@pytest.mark.parametrize("base", FITTING_AVATARS)
def test_a_mixed_head_fits_the_renderer_of_its_base(base: str) -> None:
    """Portraits repaint and pose a body that was loaded once: sizes, triangles and coordinates must be its own."""
    head, plain = mixed(1, base), reduced(load_avatar(base))
    assert head.colours.shape == plain.colours.shape
    assert head.skin_mask.shape == plain.skin_mask.shape == plain.colours.shape[:2]
    assert head.vertices.shape == plain.vertices.shape
    assert np.isfinite(head.vertices).all()
    assert head.triangles is load_avatar(base).triangles


def test_only_the_head_changes_and_the_eyes_stay() -> None:
    plain, head = load_avatar(BASE), mixed(2)
    moved = np.linalg.norm(head.vertices - plain.vertices, axis=1)
    assert moved[plain.part != HEAD].max() < 1e-6
    assert moved[plain.is_eye].max() < 1e-6
    assert moved[plain.face_vertices].mean() > 0.0005
    assert moved[plain.is_body].max() < 0.12


def test_the_same_seed_gives_the_same_head_and_others_other_ones() -> None:
    assert (mixed(3).colours == mixed(3).colours).all()
    assert (mixed(3).vertices == mixed(3).vertices).all()
    pairs = [(one, two) for one in range(6) for two in range(one)]
    faces = [faces_at(mixed(seed)) for seed in range(6)]
    assert min(np.abs(faces[one] - faces[two]).mean() for one, two in pairs) > 0.0003


def test_the_face_is_still_where_it_was_in_the_picture() -> None:
    """The same texel is the same point of any face: else features were blurred, or a mouth stood on a cheek."""
    plain = reduced(load_avatar(BASE))
    at = plain.texture_coordinates[plain.face_vertices] * ATLAS_PX
    left, top = np.quantile(at, 0.2, axis=0).astype(int)
    right, bottom = np.quantile(at, 0.8, axis=0).astype(int)
    alike = []
    for seed in range(8):
        greys = [avatar.colours[top:bottom, left:right].mean(axis=2).ravel() for avatar in (plain, mixed(seed))]
        alike.append(np.corrcoef(greys[0], greys[1])[0, 1])
    assert np.median(alike) > 0.5


def test_some_heads_are_bald_and_some_have_hair_that_hides_one_side() -> None:
    """Share of scalp and of either cheek that is skin, over many heads."""
    avatar = load_avatar(BASE)
    own = avatar.vertices - avatar.eyes
    scalp = np.flatnonzero((avatar.part == HEAD) & (own[:, 1] > 0.06) & (own[:, 2] < -0.06))
    temples = [
        np.flatnonzero((avatar.part == HEAD) & (side * own[:, 0] > 0.05) & (np.abs(own[:, 1]) < 0.04)) for side in (-1, 1)
    ]
    on_top, apart = [], []
    for seed in range(40):
        mask = mixed(seed).skin_mask
        on_top.append(skin_at(avatar, mask, scalp))
        apart.append(abs(skin_at(avatar, mask, temples[0]) - skin_at(avatar, mask, temples[1])))
    assert min(on_top) < 0.1
    assert max(on_top) > 0.8
    assert max(apart) > 0.3


def skin_at(avatar: Avatar, mask: np.ndarray, rows: np.ndarray) -> float:
    x, y = np.clip(avatar.texture_coordinates[rows] * ATLAS_PX, 0, ATLAS_PX - 1).astype(int).T
    return float(mask[y, x].mean() / 255)


def test_long_hair_is_combed_behind_one_ear_or_into_the_face_and_cut() -> None:
    """How far ahead hair hangs below the eyes on either side, and how far down, over many heads."""
    plain = load_avatar(WIGGED)
    wig = (plain.part == HEAD) & ~plain.is_body & ~plain.is_eye
    apart, lowest = [], []
    for seed in range(60):
        hair = mixed(seed, WIGGED).vertices[wig] - plain.eyes
        hanging = hair[hair[:, 1] < -0.02]
        if len(hanging) > 500:  # else it is bald, or wears its hair short
            left, right = (np.quantile(hanging[side * hanging[:, 0] > 0.03, 2], 0.9) for side in (1, -1))
            apart.append(abs(left - right))
            lowest.append(hanging[:, 1].min())
    assert len(apart) > 20
    assert max(apart) > 0.05
    assert min(lowest) < -0.25
    assert max(lowest) > -0.2


def test_of_one_avatar_alone_no_head_is_mixed() -> None:
    with pytest.raises(AvatarError, match="mixed of two"):
        mixed_head(BASE, [BASE], np.random.default_rng(0))
