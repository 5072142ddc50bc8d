"""Quantisation-aware fine-tuning: the network is trained on while its weights and activations are rounded as the integer
network rounds them; gradients pass straight through the rounding, but not past the ends of a range."""
import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

from train import Trainer


class _Rounded(torch.autograd.Function):
    @staticmethod
    def forward(context, x, step, least):
        scaled = torch.round(x / step)
        context.save_for_backward((scaled >= least) & (scaled <= 127))
        return scaled.clamp_(least, 127) * step

    @staticmethod
    def backward(context, gradient):
        (inside,) = context.saved_tensors
        return gradient * inside, None, None


class SimulatedNetwork(nn.Module):
    """A run's network (without batch normalisation) with the integers' rounding. sigmas: by step; scales: by weighted
    step, per output channel. Both stay as they are; the weights are trained."""

    def __init__(self, network, sigmas, scales):
        super().__init__()
        self.network, self.sigmas = network, sigmas
        self.scales = {name: torch.from_numpy(np.asarray(scale, np.float32)) for name, scale in scales.items()}

    def _weights(self, name, weights):
        scale = self.scales[name].to(weights.device).reshape(-1, *[1] * (weights.dim() - 1))
        return _Rounded.apply(weights, scale, -127)

    def _activations(self, name, x):
        return _Rounded.apply(F.relu(x), self.sigmas[name], 0)

    def convolved(self, i, x):
        """Convolution i (from 1) to the end of its pooling."""
        spec, conv = self.network.specs[i - 1], self.network.convs[i - 1]
        x = F.conv2d(x, self._weights(f"conv{i}", conv.weight), conv.bias, spec.stride, spec.pad, groups=spec.groups)
        x = self._activations(f"norm{i}", self.network.lrn(self._activations(f"conv{i}", x)))
        return F.max_pool2d(x, 3, 2) if spec.pool else x

    def connected(self, i, x):
        """Fully connected layer i, counted on from the convolutions."""
        layer = self.network.hidden[i - 1 - len(self.network.convs)]
        return self._activations(f"fc{i}", F.linear(x.flatten(1), self._weights(f"fc{i}", layer.weight), layer.bias))

    def heads(self, x):
        """float[n, 5]"""
        score, geometry = self.network.score, self.network.geometry
        weights = self._weights("heads", torch.cat([score.weight, geometry.weight]))
        return F.linear(x.flatten(1), weights, torch.cat([score.bias, geometry.bias]))

    def forward(self, x, dropout=0.0):
        last = len(self.network.convs)
        for i in range(1, last + 1):
            x = self.convolved(i, x)
        for i in range(last + 1, last + 1 + len(self.network.hidden)):
            x = F.dropout(self.connected(i, x), dropout, self.training)
        x = self.heads(x)
        return x[:, :2], x[:, 2:]


class Plain:
    """AdamW alone: small steps from where Muon went."""

    def __init__(self, parameters):
        self.adamw = torch.optim.AdamW(parameters, weight_decay=0.0)

    def step(self, learning_rate):
        for group in self.adamw.param_groups:
            group["lr"] = learning_rate
        self.adamw.step()
        self.adamw.zero_grad()


class FineTuner(Trainer):
    """Trains a SimulatedNetwork as train.py trains a Network: the same loss, batches of another seed."""

    def __init__(self, simulated, settings, mean, train, iterations, learning_rate, device):
        super().__init__({**settings, "seed": settings["seed"] + 1000, "iterations": iterations, "precision": "fp32",
                          "learning_rate": learning_rate}, train, train, device)
        self.network, self.mean = simulated.to(device), mean
        self.optimizer = Plain(simulated.parameters())

    def tune(self, progress=None):
        """Mean loss of the first and of the last tenth of the iterations."""
        losses = []
        while self.iteration < self.settings["iterations"]:
            losses.append(self.step()[0])
            if progress:
                progress(self.iteration)
        self.network.eval()
        tenth = max(1, len(losses) // 10)
        return float(np.mean(losses[:tenth])), float(np.mean(losses[-tenth:]))
