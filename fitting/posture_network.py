"""The network of hand postures in PyTorch, to be fitted; OpenCV evaluates it (`deixis_gesture/hand_posture.py`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from deixis_gesture.hand_posture import NAMED, SIDE
from numpy.typing import NDArray
from torch import nn
from torch.nn import functional as fn

RATE, BATCH = 4e-3, 256
CHANNELS, HIDDEN = (16, 32, 64), 64
TURNED, SCALED, SHIFTED = 0.12, 0.06, 0.03
"""Each time a hand is seen it is turned (radians), scaled (logarithm), shifted (half sides) otherwise: standard deviations."""


class PostureNetwork(nn.Module):  # type: ignore[misc]  # where PyTorch is not installed its types are not known
    """Three convolutions that halve the size, two full layers: log odds of the postures (n, 5) of rasters (n, 1, 32, 32)."""

    def __init__(self) -> None:
        super().__init__()
        layers: list[nn.Module] = []
        for inputs, outputs in zip((1, *CHANNELS), CHANNELS, strict=False):
            layers += [nn.Conv2d(inputs, outputs, 4, 2, 1), nn.ReLU()]
        flat = CHANNELS[-1] * (SIDE // 8) ** 2
        self.layers = nn.Sequential(
            *layers,
            nn.Flatten(),
            nn.Dropout(0.3),
            nn.Linear(flat, HIDDEN),
            nn.ReLU(),
            nn.Dropout(0.2),
            nn.Linear(HIDDEN, len(NAMED)),
        )

    def forward(self, rasters: torch.Tensor) -> torch.Tensor:
        """Log odds."""
        told: torch.Tensor = self.layers(rasters)
        return told


class PostureFit:
    """A network while it is fitted, in so many rounds of so many hands."""

    def __init__(self, rounds: int, hands: int) -> None:
        self._network = PostureNetwork()
        self._optimiser = torch.optim.AdamW(self._network.parameters(), lr=RATE, weight_decay=0.02)
        steps = rounds * -(-hands // BATCH)
        self._schedule = torch.optim.lr_scheduler.OneCycleLR(self._optimiser, RATE, total_steps=steps)

    def round(self, rasters: NDArray[np.uint8], shapes: NDArray[np.int64]) -> float:
        """See all hands once. Gives the mean loss."""
        self._network.train()
        losses = []
        for rows in torch.randperm(len(rasters)).split(BATCH):
            told = self._network(_moved(_tensor(rasters[rows.numpy()])))
            loss = fn.cross_entropy(told, torch.from_numpy(shapes[rows.numpy()]))
            self._optimiser.zero_grad()
            loss.backward()
            self._optimiser.step()
            self._schedule.step()
            losses.append(float(loss.detach()))
        return float(np.mean(losses))

    def loss(self, rasters: NDArray[np.uint8], shapes: NDArray[np.int64]) -> float:
        """Mean -log P of what each hand is, nats."""
        shares = self.shares(rasters)
        return float(-np.log(np.maximum(shares[np.arange(len(shapes)), shapes], 1e-9)).mean())

    def shares(self, rasters: NDArray[np.uint8]) -> NDArray[Any]:
        """How likely each posture is (n, postures)."""
        self._network.eval()
        with torch.no_grad():
            told = torch.cat([self._network(_tensor(part)) for part in np.array_split(rasters, 16)])
            return np.asarray(torch.softmax(told, dim=1).numpy())

    def export(self, path: Path) -> None:
        """Write the network as ONNX for one hand."""
        self._network.eval()
        one = torch.zeros(1, 1, SIDE, SIDE)
        torch.onnx.export(
            self._network, (one,), str(path), input_names=["hand"], output_names=["postures"], opset_version=13, dynamo=False
        )


def _moved(seen: torch.Tensor) -> torch.Tensor:
    """A batch turned, scaled and shifted a little, each hand otherwise."""
    count = len(seen)
    turn, scale = torch.randn(count) * TURNED, torch.exp(torch.randn(count) * SCALED)
    cosine, sine = scale * torch.cos(turn), scale * torch.sin(turn)
    shift = torch.randn(count, 2) * SHIFTED
    warp = torch.stack([torch.stack([cosine, -sine, shift[:, 0]], 1), torch.stack([sine, cosine, shift[:, 1]], 1)], 1)
    return fn.grid_sample(seen, fn.affine_grid(warp, [count, 1, SIDE, SIDE], align_corners=False), align_corners=False)


def _tensor(rasters: NDArray[np.uint8]) -> torch.Tensor:
    return torch.from_numpy(rasters.astype(np.float32) / 255)[:, None]
