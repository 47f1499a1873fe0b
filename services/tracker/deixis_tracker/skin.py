"""Bayesian skin colour: P(skin | colour), adapted to the person and the room (Pateraki et al. 2011, sec. 4, [2]).

Colours are judged in a space of log ratios, log(R/G) and log(G/B), which a change of brightness leaves alone, with the log
of the brightness as a weak third axis. The densities of skin and of everything else are mixtures of Gaussians
(`skin_prior.py`); the skin of a detected face and the colours of the room are mixed in. The posterior lives in a table of
32 x 32 x 32 colours, so a frame costs one look-up per pixel.
"""

from __future__ import annotations

from functools import cache
from typing import Any, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from deixis_tracker.frame import COARSE, Image, Mask, around
from deixis_tracker.skin_prior import OTHER, SKIN, Gaussian

Array = NDArray[np.float64]
T = TypeVar("T", bound=np.generic)

BINS = 32
OFFSET = 6.0  # keeps the ratios of dark pixels, which are mostly noise, near 1
# Spread that is always granted to a person's skin: hands are lit otherwise than the face, and palms are paler.
SPREAD_FLOOR = np.diag([0.075**2, 0.075**2, 0.55**2])
PERSON_SHARE = 0.75
ROOM_SHARE = 0.5
CLOTHES_SHARE = 0.35
# A palm held toward a lamp runs into the limit of the sensor and turns nearly white: it may extend a blob, not start one.
OVEREXPOSED_SKIN = 0.45
GREY_LEVELS, GREY_SHARE = 6, 0.995  # channels that differ so little, in so much of the picture: no colour


def chroma_features(bgr: Array) -> Array:
    """(N, 3) colours -> (N, 3): log(R/G), log(G/B), log brightness."""
    b, g, r = (bgr.T + OFFSET)[:3]
    return np.stack(
        [np.log(r / g), np.log(g / b), np.log((r + g + b) / 3)]
    ).T  # each axis in a row: they are quicker to go over


def gaussian_densities(x: Array, mean: Array, covariance: Array) -> Array:
    """Densities of a Gaussian at (N, D) points."""
    offset = (x - mean).T
    # Not by @, which starts threads for so long a product.
    distance = np.einsum("dn,dn->n", np.einsum("de,en->dn", np.linalg.inv(covariance), offset), offset)
    norm = np.sqrt((2 * np.pi) ** x.shape[1] * np.linalg.det(covariance))
    return np.asarray(np.exp(-0.5 * distance) / norm, np.float64)


def is_grey(image: Image) -> bool:
    """Whether a picture (H, W, 3) has no colour, which says then nothing of skin."""
    some = image[::4, ::4].astype(np.int16)
    return float(np.mean(np.ptp(some, axis=2) <= GREY_LEVELS)) >= GREY_SHARE


def colour_table(values: NDArray[T]) -> NDArray[T]:
    """`values` (N, N, N) over B, G, R, N a power of two up to 32, as `look_up` takes them."""
    fine = values
    for axis in range(3):
        fine = fine.repeat(BINS // values.shape[axis], axis)
    return np.ascontiguousarray(fine.transpose(2, 1, 0)).ravel()


def look_up(table: NDArray[T], image: Image) -> NDArray[T]:
    """A `colour_table` applied to (H, W, 3): (H, W). It runs on every pixel of every frame.

    OpenCV packs a colour into 15 bits, five of each channel, red the highest. (cv2.calcBackProject cannot do it: the Python
    binding takes a table of three dimensions for one of two with channels.)
    """
    packed = cv2.cvtColor(image, cv2.COLOR_BGR2BGR555).view(np.uint16)
    return np.asarray(np.take(table, packed[..., 0], mode="clip"))


def _mixture(x: Array, parts: tuple[Gaussian, ...]) -> Array:
    total = np.zeros(len(x))
    for part in parts:
        total += part.weight * gaussian_densities(x, np.array(part.mean), np.array(part.covariance))
    return total


def _table_colours() -> Array:
    centres = np.arange(BINS) * (256 / BINS) + 128 / BINS
    b, g, r = np.meshgrid(centres, centres, centres, indexing="ij")
    return np.stack([b.ravel(), g.ravel(), r.ravel()], axis=1)


def _overexposed_skin(bgr: Array) -> NDArray[np.bool_]:
    b, g, r = bgr.T
    return np.asarray((r > 244) & (g > 180) & (b > 140) & (r > b) & (g >= b), np.bool_)


@cache
def _prior_densities() -> tuple[Array, Array, Array]:
    """(features, density of skin, density of everything else) of each colour of the table; the same for every model."""
    features = chroma_features(_table_colours())
    return features, _mixture(features, SKIN), _mixture(features, OTHER)


class SkinModel:
    """P(skin | colour) as a table. `adapt_person` and `adapt_room` change it; `probability` applies it."""

    def __init__(self, prior_skin: float) -> None:
        """`prior_skin`: share of skin among the pixels looked at, 0 to 1 (exclusive)."""
        self._prior = prior_skin
        self._features, self._skin_prior, self._other_prior = _prior_densities()
        self._volume = self._cell_volume()
        self._person: dict[int, tuple[Array, Array]] = {}
        self._person_density: dict[int, Array] = {}
        self._room: Array | None = None
        self._clothes: dict[int, Array] = {}
        self._overexposed = _overexposed_skin(_table_colours())
        self._table: Image | None = None

    def probability(self, image: Image) -> Image:
        """P(skin) of each pixel of an (H, W, 3) BGR image as (H, W) uint8, 255 = certain."""
        if self._table is None:  # several densities may have changed since: one table for all of them
            self._table = self._posterior()
        return look_up(self._table, image)

    def adapt_person(self, person_id: int, pixels: NDArray[np.uint8], rate: float) -> None:
        """Move the skin colour of one person toward (N, 3) BGR pixels of the face, by `rate` (0 to 1)."""
        if len(pixels) < 30:
            return
        x = chroma_features(pixels.astype(float))
        # The face box also holds brows, beard and shadow: keep what lies near the median.
        half = len(x) // 2
        middle = [half - 1, half] if len(x) % 2 == 0 else [half]
        centre = np.partition(x.T, middle, axis=1)[:, middle].mean(axis=1)  # their median
        near = np.all(np.abs(x - centre) < np.array([0.25, 0.25, 0.9]), axis=1)
        if near.sum() < 20:
            return
        mean, covariance = x[near].mean(axis=0), np.cov(x[near].T)
        if person_id in self._person:
            old_mean, old_covariance = self._person[person_id]
            mean = old_mean + rate * (mean - old_mean)
            covariance = old_covariance + rate * (covariance - old_covariance)
        self._person[person_id] = mean, covariance
        self._person_density[person_id] = gaussian_densities(self._features, mean, covariance + SPREAD_FLOOR)
        self._table = None

    def brightness(self, person_id: int) -> float | None:
        """Grey level of a person's face as it was seen from the front; none before it was."""
        known = self._person.get(person_id)
        return None if known is None else float(np.exp(known[0][2])) - OFFSET

    def adapt_room(self, image: Image, room: Mask) -> None:
        """Learn the colours of the room, where `room` (H, W) is not 0: what is no skin here."""
        density = self._density_of(image, room)
        if density is None:
            return
        self._room = density if self._room is None else 0.7 * self._room + 0.3 * density
        self._table = None

    def adapt_clothes(self, person_id: int, torso: Image) -> None:
        """Learn the colours of a person's clothes from a piece of the picture (H, W, 3): a brown shirt is nearly skin."""
        density = self._density_of(torso, None)
        if density is None:
            return
        known = self._clothes.get(person_id)
        self._clothes[person_id] = density if known is None else 0.7 * known + 0.3 * density
        self._table = None

    def _density_of(self, image: Image, mask: Mask | None) -> Array | None:
        if image.size == 0:
            return None
        counts = cv2.calcHist([image], [0, 1, 2], mask, [BINS] * 3, [0, 256] * 3).astype(np.float64)
        if counts.sum() < 100:
            return None
        return np.asarray((smoothed(counts, 0.25) / counts.sum()).ravel() / self._volume, np.float64)

    def forget_person(self, person_id: int) -> None:
        """Drop the colour of a person who left."""
        self._person.pop(person_id, None)
        self._clothes.pop(person_id, None)
        if self._person_density.pop(person_id, None) is not None:
            self._table = None

    def _posterior(self) -> Image:
        skin, other = self._skin_prior, self._other_prior
        if self._person_density:
            person = np.max(list(self._person_density.values()), axis=0)
            skin = (1 - PERSON_SHARE) * skin + PERSON_SHARE * person
        if self._room is not None:
            other = (1 - ROOM_SHARE) * other + ROOM_SHARE * self._room
        if self._clothes:
            other = (1 - CLOTHES_SHARE) * other + CLOTHES_SHARE * np.max(list(self._clothes.values()), axis=0)
        joint = self._prior * skin
        posterior = joint / np.maximum(joint + (1 - self._prior) * other, 1e-12)
        if self._person:
            posterior = np.where(self._overexposed, np.maximum(posterior, OVEREXPOSED_SKIN), posterior)
        return colour_table((255 * posterior).reshape(BINS, BINS, BINS).astype(np.uint8))

    def _cell_volume(self) -> Array:
        """Volume of each table cell in feature space; the Jacobian of the three logs is 1 / (R G B)."""
        b, g, r = (_table_colours().T + OFFSET)[:3]
        return np.asarray((256 / BINS) ** 3 / (r * g * b), np.float64)


def skin_share(skin: Image, x: float, y: float, width: float) -> float:
    """Mean P(skin), 0 to 1, of a coarse map (H, W) in the middle of a head; place and width: pixels of the working picture."""
    half = 0.25 * width
    rows, columns = around(x, y, half, half, half, half).scaled(COARSE).window(*skin.shape)
    return float(skin[rows, columns].mean()) / 255 if skin[rows, columns].size else 0.0


def smoothed(counts: Array, beside: float) -> Array:
    """A histogram (N, N, N) of which each bin gives the share `beside` to both its neighbours along each axis.

    What the outermost bins would give away, they keep. (Products of matrices would do it, but numpy's start threads.)
    """
    kernel, bins = np.array([beside, 1 - 2 * beside, beside]), counts.shape[0]
    two = cv2.sepFilter2D(counts, -1, kernel, kernel, borderType=cv2.BORDER_REPLICATE)
    three = cv2.sepFilter2D(two.reshape(-1, bins), -1, kernel, np.ones(1), borderType=cv2.BORDER_REPLICATE)
    return np.asarray(three.reshape(counts.shape), np.float64)


def hysteresis(probability: Image, low: int, high: int, min_area: int) -> tuple[NDArray[Any], NDArray[np.int32], list[int]]:
    """Connected components of probability >= `low` that hold a pixel >= `high` and at least `min_area` pixels.

    Returns (labels, stats, kept): labels (H, W), stats as of cv2.connectedComponentsWithStats, and the labels kept.
    """
    weak = np.asarray(probability >= low, np.uint8)
    # Regions have four pixels each at least, with those between them; short labels are quicker.
    short = weak.size < 4 * np.iinfo(np.uint16).max
    _, labels, stats, _ = cv2.connectedComponentsWithStats(weak, connectivity=8, ltype=cv2.CV_16U if short else cv2.CV_32S)
    kept = []
    for k in (int(k) for k in 1 + np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] >= min_area)):
        x, y, w, h = stats[k, :4]
        window = np.s_[y : y + h, x : x + w]
        if np.any((labels[window] == k) & (probability[window] >= high)):
            kept.append(k)
    return labels, np.asarray(stats, np.int32), kept
