"""The finder's network in PyTorch, to be fitted; written as ONNX, which `deixis_tracker/finder.py` gives to OpenCV."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import onnx
import torch
from deixis_tracker.finder import PIXEL_MIDDLE, PIXEL_SPREAD
from fit_windows import Windows
from numpy.typing import NDArray
from onnx import numpy_helper
from torch import nn
from torch.nn import functional as fn

RATE, WARM_STEPS = 2e-3, 300
SLOW_MEAN = 0.998
FOUND_COUNTS = 12.0
"""A cell that belongs to a thing counts so many times as much as an empty one: there are few."""
SIZES_COUNT = 0.3
LAYERS = ("c1", "c2", "r1", "r2", "c3", "r3", "r4", "c4", "r5", "r6", "r7", "u8", "m8", "u4", "m4", "out")
"""In the order in which they are evaluated."""


class Network(nn.Module):  # type: ignore[misc]  # where PyTorch is not installed its types are not known
    """Convolutions down to a sixteenth of the size and up again to a quarter; those named r add to their input."""

    def __init__(self) -> None:
        super().__init__()
        self.c1, self.c2 = _layer(3, 12, 2), _layer(12, 24, 2)
        self.r1, self.r2 = _layer(24, 24), _layer(24, 24)
        self.c3, self.r3, self.r4 = _layer(24, 48, 2), _layer(48, 48), _layer(48, 48)
        self.c4 = _layer(48, 64, 2)
        self.r5, self.r6, self.r7 = _layer(64, 64), _layer(64, 64), _layer(64, 64)
        self.u8, self.m8 = nn.Conv2d(64, 48, 1), _layer(48, 48)
        self.u4, self.m4 = nn.Conv2d(48, 24, 1), _layer(24, 32)
        self.out = nn.Conv2d(32, 4, 1)
        nn.init.constant_(self.out.bias[:3], -4.0)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """Maps (n, 4, h / 4, w / 4) of pictures (n, 3, h, w): log odds of head, right hand, left hand; log breadth."""
        x = fn.relu(self.c2(fn.relu(self.c1(x))))
        for layer in (self.r1, self.r2):
            x = fn.relu(x + layer(x))
        quarter = x
        x = fn.relu(self.c3(x))
        for layer in (self.r3, self.r4):
            x = fn.relu(x + layer(x))
        eighth = x
        x = fn.relu(self.c4(x))
        for layer in (self.r5, self.r6, self.r7):
            x = fn.relu(x + layer(x))
        x = fn.relu(eighth + _twice(self.u8(x)))
        x = fn.relu(x + self.m8(x))
        x = fn.relu(quarter + _twice(self.u4(x)))
        return self.out(fn.relu(self.m4(x)))


class Fit:
    """A network while it is fitted."""

    def __init__(self, start: Path | None = None) -> None:
        """Begin anew, or go on from a checkpoint (.pt) or from weights that were exported (.onnx)."""
        self._network = Network().to(memory_format=torch.channels_last)
        if start is not None and start.suffix == ".onnx":
            load_exported(self._network, start)
        elif start is not None:
            self._network.load_state_dict(torch.load(start))
        self._mean = {name: values.clone() for name, values in self._network.state_dict().items()}
        self._optimiser = torch.optim.AdamW(self._network.parameters(), lr=RATE, weight_decay=1e-3)
        self._steps = 0

    def settle(self, windows: Windows) -> None:
        """Give exported layers the means and spreads of these windows again, which the export has multiplied in."""
        spreads: dict[nn.BatchNorm2d, tuple[torch.Tensor, torch.Tensor]] = {}

        def note(layer: nn.BatchNorm2d, given: tuple[torch.Tensor], _: torch.Tensor) -> None:
            spreads[layer] = given[0].mean((0, 2, 3)), given[0].var((0, 2, 3), unbiased=False)

        self._network.eval()
        layers = [layer for layer in self._network.modules() if isinstance(layer, nn.BatchNorm2d)]
        hooks = [layer.register_forward_hook(note) for layer in layers]
        with torch.no_grad():
            self._network(_tensor(windows.pixels))
            for layer, (mean, spread) in spreads.items():
                layer.running_mean.copy_(mean)
                layer.running_var.copy_(spread)
                layer.weight.copy_(torch.sqrt(spread + layer.eps))
                layer.bias.add_(mean)
        for hook in hooks:
            hook.remove()
        self._mean = {name: values.clone() for name, values in self._network.state_dict().items()}

    def step(self, windows: Windows, share: float) -> float:
        """Learn from a batch; `share` of the training is done. Gives the loss."""
        for group in self._optimiser.param_groups:
            group["lr"] = RATE * min(1, (self._steps + 1) / WARM_STEPS) * (0.5 * (1 + math.cos(math.pi * share)) + 0.005)
        self._network.train()
        loss = loss_of(self._network(_tensor(windows.pixels)), windows)
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._network.parameters(), 1.0)
        self._optimiser.step()
        self._steps += 1
        self._average(min(SLOW_MEAN, 1 - 1 / (self._steps + 9)))
        return float(loss.detach())

    def maps(self, pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
        """What the mean network answers to pictures (n, h, w, 3)."""
        with torch.no_grad():
            return np.concatenate([self._mean_network()(_tensor(part)).numpy() for part in np.array_split(pixels, 8)])

    def save(self, path: Path) -> None:
        """Write a checkpoint."""
        torch.save(self._mean, path)

    def export(self, path: Path) -> None:
        """Write the mean network as ONNX for one picture of any size that sixteen divides."""
        sizes = {"picture": {2: "height", 3: "width"}, "maps": {2: "rows", 3: "columns"}}
        picture = torch.zeros(1, 3, 64, 64)
        torch.onnx.export(
            self._mean_network(), (picture,), str(path), input_names=["picture"], output_names=["maps"],
            dynamic_axes=sizes, opset_version=13, dynamo=False,
        )  # fmt: skip

    def _mean_network(self) -> Network:
        network = Network()
        network.load_state_dict(self._mean)
        network.eval()
        return network

    def _average(self, keep: float) -> None:
        with torch.no_grad():
            for name, values in self._network.state_dict().items():
                mean = self._mean[name]
                if mean.dtype.is_floating_point:
                    mean.mul_(keep).add_(values, alpha=1 - keep)
                else:
                    mean.copy_(values)


def load_exported(network: Network, path: Path) -> None:
    """Weights of an exported network, whose layers have no means and spreads of their own any more."""
    graph = onnx.load(str(path)).graph
    values = {one.name: torch.from_numpy(numpy_helper.to_array(one).copy()) for one in graph.initializer}
    nodes = [node for node in graph.node if node.op_type == "Conv"]
    with torch.no_grad():
        for name, node in zip(LAYERS, nodes, strict=True):
            layer, (weight, bias) = getattr(network, name), (values[key] for key in node.input[1:3])
            convolution, after = layer if isinstance(layer, nn.Sequential) else (layer, layer)
            convolution.weight.copy_(weight)
            after.bias.copy_(bias)
            if after is not convolution:
                after.weight.fill_(math.sqrt(1 + after.eps))


def loss_of(answers: torch.Tensor, windows: Windows) -> torch.Tensor:
    """Cross entropy of the maps, and how far sizes are off."""
    maps, weights = torch.from_numpy(windows.maps), torch.from_numpy(windows.weights)
    each = fn.binary_cross_entropy_with_logits(answers[:, :3], maps, reduction="none")
    found = (each * weights * (1 + FOUND_COUNTS * maps)).mean() * 100
    sizes = torch.from_numpy(windows.sizes)
    known = torch.isfinite(sizes)
    off = fn.smooth_l1_loss(answers[:, 3][known], sizes[known], beta=0.1) if bool(known.any()) else 0.0
    return found + SIZES_COUNT * 10 * off


def _layer(inputs: int, outputs: int, stride: int = 1) -> nn.Module:
    convolution = nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False)
    return nn.Sequential(convolution, nn.BatchNorm2d(outputs))


def _twice(x: torch.Tensor) -> torch.Tensor:
    return fn.interpolate(x, scale_factor=2, mode="nearest")


def _tensor(pixels: NDArray[np.uint8]) -> torch.Tensor:
    scaled = (torch.from_numpy(np.ascontiguousarray(pixels)).float() - PIXEL_MIDDLE) / PIXEL_SPREAD
    return scaled.permute(0, 3, 1, 2).contiguous(memory_format=torch.channels_last)
