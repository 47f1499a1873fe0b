"""The regression's network in PyTorch, to be fitted; `deixis_headpose/regression.py` evaluates it with numpy."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import torch
from deixis_headpose.regression import BREADTH_GAIN, BREADTH_MIDDLE, LEAK, standardised, weights_of
from fit_crops import Crops
from numpy.typing import NDArray
from torch import nn
from torch.nn import functional as fn

RATE, WARM_STEPS = 1.5e-3, 200
SLOW_MEAN = 0.998
"""Weights are averaged over some hundred steps; the mean is what counts."""
LEAK_SHARE = float(LEAK)
LAYERS = ("c1", "c2", "r2", "c3", "r3", "c4", "r4")


class Network(nn.Module):  # type: ignore[misc]  # where PyTorch is not installed its types are not known
    """Convolutions that halve the size (c) or add to it (r), each normalised over the batch; two full layers."""

    def __init__(self) -> None:
        super().__init__()
        self.c1, self.c2, self.r2 = _layer(3, 24, 4, 2), _layer(24, 32, 3, 2), _layer(32, 32, 3, 1)
        self.c3, self.r3 = _layer(32, 64, 3, 2), _layer(64, 64, 3, 1)
        self.c4, self.r4 = _layer(64, 128, 3, 2), _layer(128, 128, 3, 1)
        self.f1, self.f2 = nn.Linear(2048, 128), nn.Linear(128, 29)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Outputs (n, 29): nose 3, crown 3, middle 2, breadth, landmarks 16, log sigmas 3, head."""
        x = _leaky(self.c2(_leaky(self.c1(x))))
        x = _leaky(self.c3(_leaky(x + self.r2(x))))
        x = _leaky(self.c4(_leaky(x + self.r3(x))))
        x = _leaky(x + self.r4(x)).flatten(1)
        return self.f2(_leaky(self.f1(fn.dropout(x, 0.1, self.training))))


class Fit:
    """A network while it is fitted."""

    def __init__(self, start: Path | None = None, pixels: NDArray[np.uint8] | None = None, rate: float = RATE) -> None:
        """Begin anew; or go on from a checkpoint (.pt), or from weights of the stage (.npz) with some crops as they come."""
        self._rate = rate
        self._network = Network().to(memory_format=torch.channels_last)
        if start is not None and start.suffix == ".npz":
            if pixels is None:
                raise ValueError("pixels: weights of the stage need crops to be normalised by")
            _unfold(self._network, weights_of(start.read_bytes()), pixels)
        elif start is not None:
            self._network.load_state_dict(torch.load(start))
        self._mean = {name: values.clone() for name, values in self._network.state_dict().items()}
        self._optimiser = torch.optim.AdamW(self._network.parameters(), lr=rate, weight_decay=1e-3)
        self._steps = 0

    def step(self, crops: Crops, share: float) -> float:
        """Learn from a batch; `share` of the training is done. Gives the loss."""
        for group in self._optimiser.param_groups:
            group["lr"] = self._rate * min(1, (self._steps + 1) / WARM_STEPS) * (0.5 * (1 + math.cos(math.pi * share)) + 0.005)
        self._network.train()
        loss = loss_of(self._network(_tensor(crops.pixels)), crops)
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._network.parameters(), 1.0)
        self._optimiser.step()
        self._steps += 1
        self._average(min(SLOW_MEAN, 1 - 1 / (self._steps + 9)))
        return float(loss.detach())

    def noses(self, pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Directions (n, 3) of the nose that the mean network reads."""
        network = Network()
        network.load_state_dict(self._mean)
        network.eval()
        with torch.no_grad():
            return np.concatenate([network(_tensor(part))[:, :3].numpy() for part in np.array_split(pixels, 32)])

    def save(self, path: Path) -> None:
        """Write a checkpoint."""
        torch.save(self._mean, path)

    def export(self, path: Path) -> None:
        """Write the mean weights as the stage reads them, the normalisation worked into the convolutions."""
        weights: dict[str, Any] = {}
        for name in LAYERS:
            kernel, bias = _folded(self._mean, name)
            weights[f"{name}_w"], weights[f"{name}_b"] = kernel.permute(2, 3, 1, 0), bias
        first = self._mean["f1.weight"].reshape(128, 128, 4, 4)  # of (channel, row, column); the stage has channels last
        weights["f1_w"], weights["f1_b"] = first.permute(2, 3, 1, 0).reshape(2048, 128), self._mean["f1.bias"]
        weights["f2_w"], weights["f2_b"] = self._mean["f2.weight"].T, self._mean["f2.bias"]
        np.savez_compressed(path, **{name: values.numpy().astype(np.float16) for name, values in weights.items()})

    def _average(self, keep: float) -> None:
        with torch.no_grad():
            for name, values in self._network.state_dict().items():
                if values.dtype.is_floating_point:
                    self._mean[name].mul_(keep).add_(values, alpha=1 - keep)


def loss_of(out: torch.Tensor, crops: Crops) -> torch.Tensor:
    """Distances of nose and crown, of middle, breadth and landmarks; how likely sigmas make the errors (Laplace); head or not.

    The sigmas learn from the errors and not the other way round: else what is hard would be given up as unsure.
    """
    head = torch.from_numpy(crops.head)
    there = fn.binary_cross_entropy_with_logits(out[:, 28], head.float())
    out, crops = out[head], crops.only(crops.head)
    true = _targets(crops)
    nose, crown = (_distance(out[:, at] - true[:, at]) for at in (slice(0, 3), slice(3, 6)))
    places = 4 * fn.smooth_l1_loss(out[:, 6:9], true[:, 6:9], beta=0.02)
    places = places + 6 * fn.smooth_l1_loss(out[:, 9:25], true[:, 9:25], beta=0.02)
    errors, log_sigmas = _angle_errors(out, true).detach(), out[:, 25:28].clamp(-4, 1)
    unlikely = (log_sigmas + errors.clamp(max=1.5) / torch.exp(log_sigmas)).mean()
    return nose.mean() + 0.6 * crown.mean() + places + 0.1 * unlikely + 0.2 * there


def _targets(crops: Crops) -> torch.Tensor:
    breadths = (np.log(crops.breadths[:, None]) - BREADTH_MIDDLE) * BREADTH_GAIN
    nose, crown = -crops.rotations[:, :, 2], -crops.rotations[:, :, 1]
    parts = [nose, crown, crops.places[:, 8], breadths, crops.places[:, :8].reshape(len(breadths), 16)]
    return torch.from_numpy(np.concatenate(parts, axis=1).astype(np.float32))


def _angle_errors(out: torch.Tensor, true: torch.Tensor) -> torch.Tensor:
    """Of yaw, pitch and (about) roll, radians (n, 3), all positive."""
    nose = fn.normalize(out[:, 0:3], dim=1)
    yaw = torch.atan2(nose[:, 0], -nose[:, 2]) - torch.atan2(true[:, 0], -true[:, 2])
    pitch = torch.asin(nose[:, 1].clamp(-0.999, 0.999)) - torch.asin(true[:, 1].clamp(-0.999, 0.999))
    roll = torch.sqrt(((out[:, 3:6] - true[:, 3:6]) ** 2).sum(1) / 2 + 1e-6)
    return torch.stack([torch.atan2(torch.sin(yaw), torch.cos(yaw)).abs(), pitch.abs(), roll], dim=1)


def _distance(difference: torch.Tensor) -> torch.Tensor:
    """Length, smooth at zero: squares would be ruled by the few heads that cannot be read."""
    return torch.sqrt((difference**2).sum(1) + 0.05**2)


def _layer(channels: int, out: int, size: int, stride: int) -> nn.Sequential:
    convolution = nn.Conv2d(channels, out, size, stride, 1, bias=False)
    nn.init.kaiming_normal_(convolution.weight, nonlinearity="relu")
    return nn.Sequential(convolution, nn.BatchNorm2d(out, momentum=0.02))


def _folded(weights: dict[str, torch.Tensor], name: str) -> tuple[torch.Tensor, torch.Tensor]:
    gain = weights[f"{name}.1.weight"] / torch.sqrt(weights[f"{name}.1.running_var"] + 1e-5)
    bias = weights[f"{name}.1.bias"] - weights[f"{name}.1.running_mean"] * gain
    return weights[f"{name}.0.weight"] * gain[:, None, None, None], bias


def _unfold(network: Network, weights: dict[str, Any], pixels: NDArray[np.uint8]) -> None:
    """Put the stage's weights into the network, which has to normalise in between: by what these crops give, so that it says
    the same as before.
    """
    seen: dict[str, torch.Tensor] = {}
    with torch.no_grad():
        for name in LAYERS:
            convolution, normalisation = getattr(network, name)
            convolution.weight.copy_(torch.from_numpy(weights[name][0]).permute(3, 2, 0, 1))
            normalisation.bias.copy_(torch.from_numpy(weights[name][1]))
            convolution.register_forward_hook(lambda *given, name=name: seen.__setitem__(name, given[2]))
        first = torch.from_numpy(weights["f1"][0]).reshape(4, 4, 128, 128).permute(3, 2, 0, 1)
        network.f1.weight.copy_(first.reshape(128, 2048))
        network.f1.bias.copy_(torch.from_numpy(weights["f1"][1]))
        network.f2.weight.copy_(torch.from_numpy(weights["f2"][0]).T)
        network.f2.bias.copy_(torch.from_numpy(weights["f2"][1]))
        network.eval()
        network(_tensor(pixels))
        for name in LAYERS:
            convolution, normalisation = getattr(network, name)
            convolution._forward_hooks.clear()
            mean, variance = seen[name].mean(dim=(0, 2, 3)), seen[name].var(dim=(0, 2, 3))
            normalisation.running_mean.copy_(mean)
            normalisation.running_var.copy_(variance)
            normalisation.weight.copy_(torch.sqrt(variance + normalisation.eps))
            normalisation.bias.add_(mean)


def _leaky(values: torch.Tensor) -> torch.Tensor:
    return fn.leaky_relu(values, LEAK_SHARE)


def _tensor(pixels: NDArray[np.uint8]) -> torch.Tensor:
    values = torch.from_numpy(standardised(pixels)).permute(0, 3, 1, 2)
    return values.contiguous(memory_format=torch.channels_last)
