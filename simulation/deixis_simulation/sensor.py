"""From linear light to the picture that a webcam gives: lens, sensor noise, demosaicing, processing."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from .scene import Scene

FloatPicture = NDArray[np.float32]
Picture = NDArray[np.uint8]

COLOUR_GAINS = np.array((1.7, 1.0, 1.5), np.float32)
"""What the white balance multiplies red, green, blue of the raw sensor with; the noise of red and blue grows with it."""
SHOT_NOISE = 2.2e-4
READ_NOISE = 1.8e-3
PIXEL_RESPONSE = 0.006
VIGNETTE = 0.18
RAW_SCALE, RAW_BLACK = 60000.0, 1500.0
HIGHLIGHTS_FROM = 0.75
COLOUR_BLUR_PX = 0.9
MEAN_LUMINANCE = 0.25
"""Mean linear luminance of a well exposed picture."""


class SensorModel:
    """Turns the pictures of one scene into frames; the noise of a frame depends on the scene's seed and its number alone."""

    def __init__(self, scene: Scene) -> None:
        width, height = scene.camera.width, scene.camera.height
        self._sensor = scene.sensor
        self._seed = scene.seed
        rng = np.random.default_rng([scene.seed, 1])
        self._response = (1 + PIXEL_RESPONSE * rng.standard_normal((height, width))).astype(np.float32)
        y, x = np.mgrid[0:height, 0:width]
        radius2 = ((x - width / 2) ** 2 + (y - height / 2) ** 2) / (0.625 * width) ** 2
        self._vignette = (1 - VIGNETTE * radius2)[..., None].astype(np.float32)
        self._metered = 1.0

    def meter(self, light: FloatPicture) -> None:
        """Set the exposure by a typical picture (h, w, 3), linear."""
        luminance = np.clip(light @ np.array((0.21, 0.72, 0.07), np.float32), 0, 1.2)
        self._metered = MEAN_LUMINANCE / max(float(luminance.mean()), 1e-3)

    def expose(self, light: FloatPicture, frame: int, gain: float = 1.0) -> Picture:
        """A frame (h, w, 3) BGR of linear light (h, w, 3) RGB."""
        sensor = self._sensor
        blurred = cv2.GaussianBlur(light, (0, 0), sensor.blur_px) * self._vignette
        raw = self._raw(blurred * np.float32(self._metered * sensor.exposure * gain), frame)
        colour = cv2.cvtColor(raw, cv2.COLOR_BayerBG2RGB_EA).astype(np.float32)
        balance = COLOUR_GAINS * np.array(sensor.white_balance, np.float32)
        linear = np.maximum((colour - RAW_BLACK) / RAW_SCALE * balance, 0)
        rolled = linear / (1 + 0.55 * np.maximum(linear - HIGHLIGHTS_FROM, 0))
        return self._processed(np.clip(rolled, 0, 1))

    def _raw(self, light: FloatPicture, frame: int) -> NDArray[np.uint16]:
        height, width = light.shape[:2]
        split = light / COLOUR_GAINS
        mosaic = np.empty((height, width), np.float32)
        mosaic[0::2, 0::2] = split[0::2, 0::2, 0]
        mosaic[0::2, 1::2] = split[0::2, 1::2, 1]
        mosaic[1::2, 0::2] = split[1::2, 0::2, 1]
        mosaic[1::2, 1::2] = split[1::2, 1::2, 2]
        grain = np.random.default_rng([self._seed, 2, frame]).standard_normal((height, width), dtype=np.float32)
        noise = self._sensor.noise
        deviation = np.sqrt(np.maximum(mosaic, 0) * np.float32(SHOT_NOISE * noise) + np.float32((READ_NOISE * noise) ** 2))
        noisy = mosaic * self._response + grain * deviation
        raw: NDArray[np.uint16] = np.clip(noisy * RAW_SCALE + RAW_BLACK, 0, 65535).astype(np.uint16)
        return raw

    def _processed(self, linear: FloatPicture) -> Picture:
        sensor = self._sensor
        display = np.power(linear, np.float32(1 / 2.2))
        curved = display + np.float32(sensor.contrast) * (display - 0.5) * (1 - np.abs(2 * display - 1))
        ycc = cv2.cvtColor(np.clip(curved, 0, 1), cv2.COLOR_RGB2YCrCb)
        chroma = (ycc[..., 1:] - 0.5) * np.float32(sensor.saturation) + 0.5
        ycc[..., 1:] = cv2.GaussianBlur(chroma, (0, 0), COLOUR_BLUR_PX)
        luma = ycc[..., 0].copy()
        ycc[..., 0] = luma + np.float32(sensor.sharpening) * (luma - cv2.GaussianBlur(luma, (0, 0), 1.0))
        picture: Picture = np.clip(cv2.cvtColor(ycc, cv2.COLOR_YCrCb2BGR) * 255 + 0.5, 0, 255).astype(np.uint8)
        return picture
