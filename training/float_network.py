"""A float network of Berth's layers, as it goes into quantisation: what a training run and an imported network have in
common. Weights and biases are float tensors; sides and strides are (y, x)."""
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F

from batches import normalised
from model import five_channels, minus_three_quarters


@dataclass
class Convolution:
    """weights [out, in / groups, rows, columns], bias [out]; ReLU behind it."""
    name: str
    weights: torch.Tensor
    bias: torch.Tensor
    stride: tuple = (1, 1)
    pad: tuple = (0, 0)
    groups: int = 1

    def sums(self, x):
        return F.conv2d(x, self.weights, self.bias, self.stride, self.pad, groups=self.groups)


@dataclass
class Norm:
    """x / (offset + alpha / 5 * sum of x^2 over 5 neighbouring channels)^beta."""
    name: str
    alpha: float
    beta: float = 0.75
    offset: float = 1.0

    def __call__(self, x):
        norm = five_channels(x * x).mul_(self.alpha / 5).add_(self.offset)
        return x * (minus_three_quarters(norm) if self.beta == 0.75 else norm.pow_(-self.beta))


@dataclass
class Pool:
    """The greatest of kernel x kernel; windows lie within the tensor."""
    name: str
    kernel: int
    stride: int

    def __call__(self, x):
        return F.max_pool2d(x, self.kernel, self.stride)


@dataclass
class Connected:
    """weights [out, channels, rows, columns] of the whole map before it, bias [out]; ReLU behind it."""
    name: str
    weights: torch.Tensor
    bias: torch.Tensor

    def sums(self, x):
        return F.linear(x.flatten(1), self.weights.flatten(1), self.bias)[:, :, None, None]


@dataclass
class Heads:
    """weights [2 or 5, channels], bias alike: scores (absent, present), then centre and size as in model.Network."""
    name: str
    weights: torch.Tensor
    bias: torch.Tensor

    def sums(self, x):
        return F.linear(x.flatten(1), self.weights, self.bias)[:, :, None, None]


@dataclass
class Step:
    """name of a layer, x: what comes out of it in float, sums: before ReLU, where there is one."""
    name: str
    x: torch.Tensor
    sums: torch.Tensor = None


class FloatNetwork:
    """Layers and what their input is: (grey - mean) * scale, with `normalise` grey as normalised() leaves it and mean 0."""

    def __init__(self, layers, normalise, mean, scale, name, device="cpu"):
        self.layers, self.normalise, self.mean, self.scale = layers, normalise, mean, scale
        self.name, self.device = name, device

    def input(self, images):
        """float[n, 1, 256, 256] from u8[n, 256, 256]."""
        grey = normalised(images) if self.normalise else images
        x = torch.from_numpy(grey.astype(np.float32))
        return ((x - self.mean) * self.scale)[:, None].to(self.device)

    @torch.no_grad()
    def steps(self, x):
        """One Step for each layer."""
        for layer in self.layers:
            if isinstance(layer, (Norm, Pool)):
                x = layer(x)
                yield Step(layer.name, x)
            else:
                sums = layer.sums(x)
                x = sums if isinstance(layer, Heads) else F.relu(sums)
                yield Step(layer.name, x, sums)

    def outputs(self, images, batch=10, progress=None):
        """float64[n, 5 or 2]: two scores, three numbers of geometry if there are any."""
        out = []
        for first in range(0, len(images), batch):
            for step in self.steps(self.input(images[first:first + batch])):
                pass
            out.append(step.x.flatten(1).cpu().double().numpy())
            if progress:
                progress(min(len(images), first + batch))
        return np.concatenate(out)
