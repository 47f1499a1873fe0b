"""From portraits to what the regression is fitted on: crops as a tracker and a camera would give them.

Crops miss the head by as much as tracks do, heads are small, turned in the picture, blurred, noisy, in odd light; some crops
show no head at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from deixis_headpose.head_crop import CROP_M, INPUT_PX
from deixis_simulation.portraits import LANDMARKS, SIDE_M, SIDE_PX, Portrait
from fit_disguises import disguised
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
SWAPPED = np.array([1, 0, 2, 3, 4, 6, 5, 7])
"""Landmarks of the mirrored face: eyes and ears change places."""
NO_HEAD, GREY, MIRRORED = 0.08, 0.35, 0.5
"""Shares of crops."""
SCALE_SPREAD, TURN_DEG = 0.12, 9.0
USUAL_MISS, FAR_MISS, FAR_MISSES = 0.06, 0.13, 0.25
"""How far crops lie off the head, in sides (standard deviation), and the share that lies far off."""
SMALLEST_PX = 18
"""The smallest crops are of so many pixels, scaled up."""
DARK, SMEARED = 0.15, 0.2
"""Shares of crops from pictures that are under-exposed, with their noise, and that were packed so hard that nothing fine is
left: dark faces of 20 pixels in such pictures were read 30 degrees aside, and called sure (s1005)."""
GREY_OF_BGR = np.array([0.114, 0.587, 0.299], np.float32)
MIRROR = np.diag([-1.0, 1.0, 1.0])


@dataclass(frozen=True)
class Portraits:
    """Many portraits: pictures (n, h, w, 3), rotations (n, 3, 3), landmarks (n, 8, 2), centres (n, 2), breadths (n,)."""

    pictures: NDArray[np.uint8]
    rotations: Floats
    landmarks_px: Floats
    centres_px: Floats
    breadths_px: Floats

    def __len__(self) -> int:
        return len(self.pictures)

    @classmethod
    def of(cls, portraits: Sequence[Portrait]) -> Portraits:
        """From the simulator's."""
        return cls(
            np.array([p.picture for p in portraits]),
            np.array([p.rotation for p in portraits], np.float32),
            np.array([p.landmarks_px for p in portraits], np.float32),
            np.array([p.centre_px for p in portraits], np.float32),
            np.array([p.breadth_px for p in portraits], np.float32),
        )

    def save(self, path: Path) -> None:
        """Write a file, whole or not at all: a cut one would be taken for good by the next run."""
        part = path.with_suffix(".part")
        with part.open("wb") as file:
            np.savez(file, **vars(self))
        part.replace(path)

    @classmethod
    def load(cls, paths: Sequence[Path]) -> Portraits:
        """All portraits of some files."""
        files = [np.load(path) for path in paths]
        return cls(**{name: np.concatenate([file[name] for file in files]) for name in files[0].files})


@dataclass(frozen=True)
class Crops:
    """A batch. pixels: (n, 64, 64, 3). rotations: (n, 3, 3). places: (n, 9, 2) of landmarks and middle, breadths: (n,), both
    in sides of the crop from its middle. head: (n,), whether one is in it.
    """

    pixels: NDArray[np.uint8]
    rotations: Floats
    places: Floats
    breadths: Floats
    head: NDArray[np.bool_]

    def only(self, rows: NDArray[np.bool_]) -> Crops:
        """Some of them."""
        return Crops(**{name: values[rows] for name, values in vars(self).items()})


def crops_of(portraits: Portraits, rows: NDArray[np.integer[Any]], rng: np.random.Generator) -> Crops:
    """A crop of each of these portraits."""
    made = [_crop(portraits, int(row), rng) for row in rows]
    return Crops(*(np.array(values) for values in zip(*made, strict=True)))


def _crop(portraits: Portraits, row: int, rng: np.random.Generator) -> tuple[Any, ...]:
    centre, rotation = portraits.centres_px[row].astype(float), portraits.rotations[row].astype(float)
    side = CROP_M * SIDE_PX / SIDE_M * np.exp(rng.normal(0, SCALE_SPREAD))
    head = rng.random() >= NO_HEAD
    miss = rng.normal(0, FAR_MISS if rng.random() < FAR_MISSES else USUAL_MISS, 2) if head else _beside(rng)
    turn_deg = rng.normal(0, TURN_DEG)
    scale, middle = INPUT_PX / side, (INPUT_PX - 1) / 2
    cosine, sine = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    turn = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    linear = turn[:2, :2] * scale
    shift = middle - linear @ (centre + miss * side)
    breadth, crown = float(portraits.breadths_px[row]), portraits.landmarks_px[row, LANDMARKS.index("crown")]
    picture = disguised(portraits.pictures[row], rotation, centre, breadth, crown, rng)
    pixels = _cut(picture, linear, shift, rng)
    places = np.vstack([portraits.landmarks_px[row], centre]) @ linear.T + shift
    places, rotation = (places - middle) / INPUT_PX, turn @ rotation
    if rng.random() < MIRRORED:
        pixels, rotation, places = pixels[:, ::-1], MIRROR @ rotation @ MIRROR, places * (-1, 1)
        places[:8] = places[SWAPPED]
    return pixels, rotation, places, breadth * scale / INPUT_PX, head


def _beside(rng: np.random.Generator) -> Floats:
    """An offset that leaves the head out, in sides."""
    away = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(away), np.sin(away)]) * rng.uniform(0.62, 1.1)


def _cut(picture: NDArray[np.uint8], linear: Floats, shift: Floats, rng: np.random.Generator) -> NDArray[np.uint8]:
    """The crop as a picture of fewer pixels would give it, as often as not."""
    low = INPUT_PX if rng.random() < 0.4 else int(np.exp(rng.uniform(np.log(SMALLEST_PX), np.log(INPUT_PX))))
    share = low / INPUT_PX
    coarse = float(np.sqrt(np.linalg.det(linear))) * share
    if coarse < 0.7:
        picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.45 / coarse), np.uint8)
    warp = np.hstack([linear * share, ((shift + 0.5) * share - 0.5)[:, None]])
    crop = cv2.warpAffine(picture, warp, (low, low), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    crop = taken(np.asarray(crop, np.uint8), rng)
    if low != INPUT_PX:
        crop = cv2.resize(crop, (INPUT_PX, INPUT_PX), interpolation=cv2.INTER_LINEAR)
    return np.asarray(crop, np.uint8)


def taken(crop: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """What a camera does to it: motion and lens blur, gamma, contrast, white balance, noise, compression."""
    if rng.random() < 0.25:
        crop = _moved(crop, rng)
    image: Floats = crop.astype(np.float32)
    if rng.random() < 0.3:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), rng.uniform(0.3, 1.3)), np.float32)
    image = 255 * np.power(np.clip(image / 255, 0, 1), np.exp(rng.normal(0, 0.35)))
    image = (image - 128) * np.exp(rng.normal(0, 0.25)) + 128 + rng.normal(0, 18)
    image = _coloured(image, rng)
    if rng.random() < 0.4:
        # Light from one side.
        angle, strength = rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.5)
        y, x = np.mgrid[-1 : 1 : image.shape[0] * 1j, -1 : 1 : image.shape[1] * 1j]
        image = image * (1 + strength * (np.cos(angle) * x + np.sin(angle) * y))[..., None]
    if rng.random() < DARK:
        image = image * rng.uniform(0.15, 0.6)
    if rng.random() < 0.6:
        image = image + rng.normal(0, rng.uniform(0, 9), image.shape)
    crop = np.clip(image, 0, 255).astype(np.uint8)
    if rng.random() < SMEARED:
        crop = _packed(crop, int(rng.integers(5, 25)))
        return np.asarray(cv2.GaussianBlur(crop, (0, 0), rng.uniform(0.4, 0.9)), np.uint8)
    return _packed(crop, int(rng.integers(25, 90))) if rng.random() < 0.4 else crop


def _packed(crop: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    packed = cv2.imencode(".jpg", crop, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8)


def _moved(crop: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Blurred along a line of 2 to 5 pixels."""
    size, angle = int(rng.integers(2, 6)), rng.uniform(0, np.pi)
    along, half = np.array([np.cos(angle), np.sin(angle)]), (size - 1) / 2
    start, end = (np.round(half + sign * half * along).astype(int).tolist() for sign in (-1, 1))
    kernel = cv2.line(np.zeros((size, size), np.float32), start, end, 1.0)
    return np.asarray(cv2.filter2D(crop, -1, kernel / kernel.sum()), np.uint8)


def _coloured(image: Floats, rng: np.random.Generator) -> Floats:
    """Grey, or with another white balance and saturation."""
    if rng.random() < GREY:
        return np.repeat((image @ GREY_OF_BGR)[..., None], 3, axis=2)
    image = image * np.exp(rng.normal(0, 0.12, 3)).astype(np.float32)
    grey = image.mean(axis=2, keepdims=True)
    return np.asarray(grey + (image - grey) * rng.uniform(0.5, 1.4))
