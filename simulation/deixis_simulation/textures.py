"""Textures from noise: walls, wood, brick, books, boards, posters, paintings. All are RGB uint8 images."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from .scene import Tone

Picture = NDArray[np.uint8]
Rng = np.random.Generator
FloatPicture = NDArray[np.float32]


def fractal_noise(height: int, width: int, rng: Rng, octaves: int = 5, base: int = 4) -> FloatPicture:
    """Smooth noise of several scales, mean 0, of the order of 1."""
    total, weight = np.zeros((height, width), np.float32), 0.0
    for octave in range(octaves):
        cells = base * 2**octave + 2
        layer = rng.standard_normal((cells, cells)).astype(np.float32)
        amplitude = 0.5**octave
        total += amplitude * cv2.resize(layer, (width, height), interpolation=cv2.INTER_CUBIC)
        weight += amplitude
    return total / np.float32(weight)


def toned(tone: Tone, brightness: FloatPicture) -> Picture:
    """One colour, brighter and darker."""
    picture: Picture = np.clip(np.array(tone, np.float32) * brightness[..., None], 0, 255).astype(np.uint8)
    return picture


def plaster(tone: Tone, rng: Rng, size: int = 512, rough: float = 0.035) -> Picture:
    """A painted wall; mirrored at its edges, so that it repeats without a seam."""
    grain = cv2.GaussianBlur(rng.standard_normal((size, size)).astype(np.float32), (0, 0), 1.2)
    tile = 1 + rough * fractal_noise(size, size, rng, base=3) + 0.02 * grain
    row = np.hstack([tile, tile[:, ::-1]])
    return toned(tone, np.vstack([row, row[::-1]]))


def wood(tone: Tone, rng: Rng, planks: int = 3, size: int = 512) -> Picture:
    """Upright planks with grain."""
    noise = fractal_noise(size, size, rng, octaves=4, base=3)
    y, x = np.mgrid[0:size, 0:size].astype(np.float32) / size
    along = x * planks
    number = np.floor(along).astype(int)
    offset = (10 * rng.random(planks + 1).astype(np.float32))[number]
    rings = np.sin(2.2 * (22 * x + 7 * offset + 2.2 * noise + 0.6 * np.sin(5 * y + offset)))
    streaks = cv2.resize(rng.standard_normal((size // 16, size)).astype(np.float32), (size, size))
    value = 1 + 0.10 * rings + 0.06 * streaks + 0.07 * noise + 0.012 * (offset - 5)
    to_gap = np.minimum(along - number, number + 1 - along) * size / planks / 2
    return toned(tone, (value * (0.55 + 0.45 * np.clip(to_gap, 0, 1))).astype(np.float32))


def brick(tone: Tone, rng: Rng, size: int = 1024, rows: int = 14, columns: int = 5) -> Picture:
    """Bricks in running bond with grey mortar."""
    tall, wide = size / rows, size / columns
    y, x = np.mgrid[0:size, 0:size].astype(np.float32)
    row = np.floor(y / tall).astype(int)
    shifted = (x + (row % 2) * wide / 2) % size
    column = np.floor(shifted / wide).astype(int) % columns
    across, down = np.minimum(shifted % wide, wide - shifted % wide), np.minimum(y % tall, tall - y % tall)
    noise = fractal_noise(size, size, rng, base=6)
    inside = np.clip((np.minimum(across, down) - 3.5 + 1.5 * noise) / 2.5, 0, 1)[..., None]
    shade = 1 + 0.13 * rng.standard_normal((rows, columns))[row, column] + 0.10 * noise
    bricks = np.array(tone, float) * shade[..., None]
    mortar = np.array((176.0, 170.0, 160.0)) * (1 + 0.06 * noise[..., None])
    mixed = (bricks * inside + mortar * (1 - inside)).astype(np.float32)
    picture: Picture = np.clip(cv2.GaussianBlur(mixed, (0, 0), 0.8), 0, 255).astype(np.uint8)
    return picture


def panels(tone: Tone, rng: Rng, size: int = 512, count: int = 4) -> Picture:
    """Smooth upright panels with joints."""
    x = np.mgrid[0:size, 0:size][1].astype(np.float32) / size * count
    joint = np.minimum(x % 1, 1 - x % 1) * size / count < 1.5
    shade = (1 + 0.03 * rng.standard_normal(count + 1)).astype(np.float32)[np.floor(x).astype(int)]
    return toned(tone, np.where(joint, 0.6, shade + 0.01 * fractal_noise(size, size, rng)).astype(np.float32))


def carpet(tone: Tone, rng: Rng, size: int = 512) -> Picture:
    """Fine speckle."""
    speckle = cv2.GaussianBlur(rng.standard_normal((size, size)).astype(np.float32), (0, 0), 1.0)
    return toned(tone, 1 + 0.15 * speckle + 0.05 * fractal_noise(size, size, rng))


def books(rng: Rng, width: int = 512, height: int = 768, shelves: int = 5) -> Picture:
    """Shelves of book spines."""
    picture = np.full((height, width, 3), (58, 40, 28), np.uint8)
    room = height // shelves
    for shelf in range(shelves):
        floor = (shelf + 1) * room - 10
        x = 6
        while x < width - 16:
            thick = int(rng.integers(10, 30))
            colour = rng.integers(20, 220, 3).astype(float)
            colour = colour if rng.random() > 0.4 else 0.4 * colour + 0.6 * colour.mean()
            top = floor - int(room * rng.uniform(0.6, 0.9))
            right = min(x + thick, width - 6)
            cv2.rectangle(picture, (x, top), (right, floor), colour.tolist(), -1)
            cv2.rectangle(picture, (x, top), (right, floor), (colour / 2).tolist(), 1)
            x = right + 1
        cv2.rectangle(picture, (0, floor), (width, floor + 10), (120, 84, 52), -1)
    return cv2.GaussianBlur(picture, (3, 3), 0).astype(np.uint8)


def board(rng: Rng, width: int = 640, height: int = 384) -> Picture:
    """A white board with writing and sketches."""
    picture = np.full((height, width, 3), (232, 234, 236), np.uint8)
    inks = ((30, 60, 160), (170, 30, 40), (20, 20, 20), (20, 110, 60))
    for text in ("m(A)", "p(z|x)", "tour 14:00", "robot", "map", "left", "2011", "sum = 1"):
        place = int(rng.integers(20, width - 180)), int(rng.integers(40, height - 20))
        ink, size = inks[int(rng.integers(4))], float(rng.uniform(0.7, 1.4))
        cv2.putText(picture, text, place, cv2.FONT_HERSHEY_SCRIPT_SIMPLEX, size, ink, 2, cv2.LINE_AA)
    for _ in range(4):
        centre = int(rng.integers(60, width - 60)), int(rng.integers(60, height - 60))
        axes = int(rng.integers(15, 60)), int(rng.integers(15, 40))
        cv2.ellipse(picture, centre, axes, 0, 0, 360, inks[0], 2, cv2.LINE_AA)
    return picture


def poster(tone: Tone, rng: Rng, width: int = 360, height: int = 512) -> Picture:
    """A printed sheet: heading, two discs, lines."""
    picture = np.full((height, width, 3), tone, np.uint8)
    cv2.putText(picture, "EXPO", (20, 90), cv2.FONT_HERSHEY_DUPLEX, 2.6, (240, 235, 220), 5, cv2.LINE_AA)
    for _ in range(2):
        centre = int(rng.integers(90, width - 90)), int(rng.integers(200, height - 140))
        cv2.circle(picture, centre, int(rng.integers(40, 90)), rng.integers(60, 240, 3).tolist(), -1, cv2.LINE_AA)
    for line in range(5):
        right = width - 30 - int(rng.integers(0, 120))
        cv2.rectangle(picture, (30, height - 72 + 12 * line), (right, height - 66 + 12 * line), (220, 220, 220), -1)
    return picture


def painting(rng: Rng, width: int = 384, height: int = 288) -> Picture:
    """A landscape of sorts: sky, hills one before the other, a sun. Its colours may be like skin, as those of paintings are."""
    sky, ground = rng.integers(90, 235, 3).astype(np.float32), rng.integers(40, 180, 3).astype(np.float32)
    down = np.linspace(0, 1, height, dtype=np.float32)[:, None, None]
    picture = np.broadcast_to(sky * (1 - 0.4 * down), (height, width, 3)).copy()
    cv2.circle(picture, (int(rng.integers(40, width - 40)), height // 4), int(rng.integers(12, 30)), (250.0, 225.0, 170.0), -1)
    rows = np.arange(height, dtype=np.float32)[:, None]
    for layer in range(4):
        ridge = height * (0.4 + 0.15 * layer) + 22 * fractal_noise(1, width, rng, octaves=3, base=2)[0]
        shade = ground * (0.6 + 0.2 * layer) + 15 * rng.standard_normal(3).astype(np.float32)
        picture = np.where((rows > ridge)[..., None], shade, picture)
    strokes = 1 + 0.06 * fractal_noise(height, width, rng, base=16)[..., None]
    painted: Picture = np.clip(picture * strokes, 0, 255).astype(np.uint8)
    return painted
