"""The two networks of eight layers, `paper` (AlexNet's sizes for a 256x256 mono input) and `lite` (a hundredth of its
weights): five convolutions, each with ReLU and local response normalisation, three with max pooling; three fully
connected layers. Beside the two class scores, three numbers from the same features: centre and size of the target.
"""
from dataclasses import dataclass

import torch
import torch.nn.functional as F
from torch import nn

SIDE = 256
SIZE_UNIT_PX = 64.0  # the size output is ln(d / SIZE_UNIT_PX)


@dataclass(frozen=True)
class Conv:
    channels: int
    kernel: int
    stride: int = 1
    pad: int = 0
    groups: int = 1
    pool: bool = False


NETWORKS = {
    "paper": ([Conv(96, 11, 4, 0, 1, True), Conv(256, 5, 1, 2, 2, True), Conv(384, 3, 1, 1), Conv(384, 3, 1, 1, 2),
               Conv(256, 3, 1, 1, 2, True)], [4096, 4096]),
    "lite": ([Conv(32, 8, 4, 0, 1, True), Conv(64, 5, 1, 2, 1, True), Conv(96, 3, 1, 1), Conv(96, 3, 1, 1),
              Conv(64, 3, 1, 1, 1, True)], [256, 64]),
}


def five_channels(x):
    """Sum over each channel and its two neighbours on both sides."""
    padded = F.pad(x, (0, 0, 0, 0, 2, 2))
    count = x.shape[1]
    total = padded[:, 0:count] + padded[:, 1:count + 1]
    for k in range(2, 5):
        total += padded[:, k:k + count]
    return total


def minus_three_quarters(x):
    """x^-0.75, faster than pow."""
    root = torch.rsqrt(x)
    return root * torch.sqrt(root)


class _LocalResponseNorm(torch.autograd.Function):
    @staticmethod
    def forward(context, x, alpha):
        norm = five_channels(x * x).mul_(alpha).add_(1)
        factor = minus_three_quarters(norm)
        context.save_for_backward(x, norm, factor)
        context.alpha = alpha
        return x * factor

    @staticmethod
    def backward(context, gradient):
        x, norm, factor = context.saved_tensors
        direct = gradient * factor
        return direct - five_channels(direct * x / norm).mul_(x).mul_(1.5 * context.alpha), None


class LocalResponseNorm(nn.Module):
    """x / (1 + alpha / 5 * sum of x^2 over 5 neighbouring channels)^0.75: torch's, several times faster on a CPU."""

    def __init__(self, alpha=1e-4):
        super().__init__()
        self.alpha = alpha / 5

    def forward(self, x):
        return _LocalResponseNorm.apply(x, self.alpha)


class Network(nn.Module):
    """u8-like input float[n, 1, 256, 256], mean already taken off and scaled; returns scores float[n, 2] (absent,
    present) and geometry float[n, 3]: (x - 127.5) / 128, (y - 127.5) / 128, ln(d / 64 px).

    Training passes leave local response normalisation out: behind batch normalisation it changes next to nothing, and
    takes a fifth of the time. With `batch_norm` each convolution is followed by batch normalisation, which makes
    training fast; `folded` takes it out again, exactly up to rounding, so that the network that is shipped has the
    paper's layers alone."""

    def __init__(self, name, batch_norm=True):
        super().__init__()
        self.name, self.batch_norm = name, batch_norm
        convolutions, hidden = NETWORKS[name]
        self.convs, self.norms = nn.ModuleList(), nn.ModuleList()
        self.specs = convolutions
        self.lrn = LocalResponseNorm()
        inputs, side = 1, SIDE
        for spec in convolutions:
            self.convs.append(nn.Conv2d(inputs, spec.channels, spec.kernel, spec.stride, spec.pad, groups=spec.groups))
            self.norms.append(nn.BatchNorm2d(spec.channels) if batch_norm else nn.Identity())
            inputs = spec.channels
            side = (side + 2 * spec.pad - spec.kernel) // spec.stride + 1
            if spec.pool:
                side = (side - 3) // 2 + 1
        inputs *= side * side
        self.hidden = nn.ModuleList()
        for outputs in hidden:
            self.hidden.append(nn.Linear(inputs, outputs))
            inputs = outputs
        self.score = nn.Linear(inputs, 2)
        self.geometry = nn.Linear(inputs, 3)
        for module in self.modules():
            if isinstance(module, (nn.Conv2d, nn.Linear)):
                nn.init.kaiming_normal_(module.weight, nonlinearity="relu")
                nn.init.zeros_(module.bias)
        nn.init.normal_(self.score.weight, std=0.01)
        nn.init.normal_(self.geometry.weight, std=0.01)

    def forward(self, x, dropout=0.0):
        for spec, conv, norm in zip(self.specs, self.convs, self.norms):
            x = F.relu(norm(conv(x)))
            if not self.training:
                x = self.lrn(x)
            if spec.pool:
                x = F.max_pool2d(x, 3, 2)
        x = x.flatten(1)  # channels, rows, columns
        for layer in self.hidden:
            x = F.dropout(F.relu(layer(x)), dropout, self.training)
        return self.score(x), self.geometry(x)

    @torch.no_grad()
    def folded(self):
        """The same network without batch normalisation."""
        if not self.batch_norm:
            return self
        plain = Network(self.name, batch_norm=False)
        state = {k: v for k, v in self.state_dict().items() if not k.startswith("norms.")}
        for i, norm in enumerate(self.norms):
            factor = norm.weight / torch.sqrt(norm.running_var + norm.eps)
            state[f"convs.{i}.weight"] = self.convs[i].weight * factor[:, None, None, None]
            state[f"convs.{i}.bias"] = (self.convs[i].bias - norm.running_mean) * factor + norm.bias
        plain.load_state_dict(state)
        return plain.eval()


def size_of(network):
    """Parameters, and multiply-accumulates of one pass, of the network as shipped (without the geometry head)."""
    parameters = macs = 0
    side = SIDE
    for spec, conv in zip(network.specs, network.convs):
        side = (side + 2 * spec.pad - spec.kernel) // spec.stride + 1
        macs += side * side * conv.weight.numel()
        parameters += conv.weight.numel() + conv.bias.numel()
        if spec.pool:
            side = (side - 3) // 2 + 1
    for layer in [*network.hidden, network.score]:
        macs += layer.weight.numel()
        parameters += layer.weight.numel() + layer.bias.numel()
    return parameters, macs
