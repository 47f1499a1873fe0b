"""How a head is turned, from one look at it: a small convolutional network, evaluated with numpy.

It was fitted on heads that the simulator rendered (fitting/fit_regression.py wrote `regression.npz`). What comes out is
absolute, for any turn of the head: nobody has to look into the camera first. How far it errs is said in this stage's README.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import resources
from io import BytesIO

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from .head import Array

Floats = NDArray[np.float32]
LEAK = np.float32(0.1)
LEAST_DEVIATION = 4.0
"""In crops with less contrast than this, grey levels, there is nothing but noise, and no head."""
EARS_APART_M = 0.185
"""Ear to ear of the people that it was fitted on, mean (tests/unit/test_headpose_regression.py measures it): what it takes a
breadth for. A face (anatomy.py) is less wide."""
BREADTH_MIDDLE, BREADTH_GAIN = -0.7, 2.0
"""The network tells the breadth as (log(breadth / side of the crop) - middle) * gain."""

MIRRORED = np.ones(29, np.float32)
"""Signs that turn what is read from a mirror image back: of all that points across the picture. Landmarks are not used."""
MIRRORED[[0, 3, 6]] = -1.0


@dataclass(frozen=True)
class Look:
    """What the network says of one crop.

    rotation: (3, 3) head axes to those of a camera that looks at the head, see head.py. sigma: (3,) of yaw, pitch, roll as the
    network tells it, radians, not calibrated. apart: angle between the nose as read from the crop and from its mirror image,
    radians. offset: (2,) from the crop's middle to the head's, in sides of the crop.
    breadth: ear to ear, in sides of the crop. head: how sure it is that there is a head, 0 to 1.
    """

    rotation: Array
    sigma: Array
    apart: float
    offset: Array
    breadth: float
    head: float


class Regression:
    """The network with its weights."""

    def __init__(self) -> None:
        self._weights = _load()
        self._blas = ThreadpoolController().select(user_api="blas")

    def look(self, crop: NDArray[np.uint8]) -> Look:
        """Read a crop (INPUT_PX, INPUT_PX, 3) of head_crop.py and its mirror image, which errs otherwise; their mean."""
        both = np.stack([crop, crop[:, ::-1]])
        # On two threads these small products take ten times the processor time: the threads wait for each other, busily.
        with self._blas.limit(limits=1):
            straight, mirrored = _forward(self._weights, standardised(both))
        look = _look_of(straight, mirrored * MIRRORED)
        return look if crop.std() >= LEAST_DEVIATION else replace(look, head=0.0)


def standardised(crops: NDArray[np.uint8]) -> Floats:
    """Crops (n, h, w, 3) with mean 0 and deviation 1 each, so that gain and offset of the camera do not matter."""
    values = crops.astype(np.float32)
    mean = values.mean(axis=(1, 2, 3), keepdims=True)
    deviation = values.std(axis=(1, 2, 3), keepdims=True)
    return np.asarray((values - mean) / np.maximum(deviation, LEAST_DEVIATION), np.float32)


def _look_of(one: Floats, other: Floats) -> Look:
    """From two readings (29,) of the same head."""
    out = (0.5 * (one + other)).astype(float)
    nose, crown = out[0:3], out[3:6]
    back = -nose / np.linalg.norm(nose)
    down = -crown - back * float(-crown @ back)
    down /= np.linalg.norm(down)
    return Look(
        rotation=np.stack([np.cross(down, back), down, back], axis=1),
        sigma=np.exp(np.clip(out[25:28], -4.0, 1.0)),
        apart=float(_angle_between(one[0:3], other[0:3])),
        offset=out[6:8],
        breadth=float(np.exp(out[8] / BREADTH_GAIN + BREADTH_MIDDLE)),
        head=float(1 / (1 + np.exp(-out[28]))),
    )


def _angle_between(one: Floats, other: Floats) -> float:
    cosine = float(one @ other) / max(float(np.linalg.norm(one) * np.linalg.norm(other)), 1e-6)
    return float(np.arccos(min(max(cosine, -1.0), 1.0)))


# --- layers ---------------------------------------------------------------------------------------------------------------


def _forward(weights: dict[str, tuple[Floats, Floats]], values: Floats) -> Floats:
    """Outputs (n, 29) for standardised crops (n, 64, 64, 3)."""
    values = _leaky(_convolved(values, *weights["c1"], 2))
    values = _leaky(_convolved(values, *weights["c2"], 2))
    values = _leaky(values + _convolved(values, *weights["r2"], 1))
    values = _leaky(_convolved(values, *weights["c3"], 2))
    values = _leaky(values + _convolved(values, *weights["r3"], 1))
    values = _leaky(_convolved(values, *weights["c4"], 2))
    values = _leaky(values + _convolved(values, *weights["r4"], 1))
    flat = values.reshape(len(values), -1)
    hidden = _leaky(flat @ weights["f1"][0] + weights["f1"][1])
    return np.asarray(hidden @ weights["f2"][0] + weights["f2"][1], np.float32)


def _leaky(values: Floats) -> Floats:
    return np.asarray(np.maximum(values, LEAK * values), np.float32)


def _convolved(values: Floats, kernel: Floats, bias: Floats, stride: int) -> Floats:
    """Values (n, h, w, c) convolved with (k, k, c, d), padded by 1 before and k - 2 after: (n, h / stride, w / stride, d).

    As one product of matrices, which numpy leaves to BLAS.
    """
    count, height, width, channels = values.shape
    size = kernel.shape[0]
    padded = np.zeros((count, height + size - 1, width + size - 1, channels), np.float32)
    padded[:, 1 : height + 1, 1 : width + 1] = values
    by_image, by_row, by_column, by_channel = padded.strides
    shape = (count, height // stride, width // stride, size, size, channels)
    steps = (by_image, by_row * stride, by_column * stride, by_row, by_column, by_channel)
    rows = as_strided(padded, shape, steps).reshape(-1, size * size * channels)
    out = rows @ kernel.reshape(-1, kernel.shape[-1]) + bias
    return np.asarray(out.reshape(*shape[:3], -1), np.float32)


@lru_cache(maxsize=1)
def _load() -> dict[str, tuple[Floats, Floats]]:
    return weights_of((resources.files(__package__) / "regression.npz").read_bytes())


def weights_of(packed: bytes) -> dict[str, tuple[Floats, Floats]]:
    """Kernel and bias of each layer, from a file that fitting/fit_regression.py wrote."""
    with np.load(BytesIO(packed), allow_pickle=False) as arrays:
        names = {key.split("_")[0] for key in arrays.files}
        return {name: (arrays[f"{name}_w"].astype(np.float32), arrays[f"{name}_b"].astype(np.float32)) for name in names}
