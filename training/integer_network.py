"""The network in integers, to the bit what docs/network-arithmetic.md says and every backend of Berth computes.

Sums of products run as matrix products of floats, which are exact here: no partial sum exceeds largest_sum(), below
2^24 in float32 or below 2^31 in float64, so no order of adding and no fused multiplication can round."""
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F

from batches import normalised
from model_file import Convolve, FullyConnected, Heads, LocalResponseNorm, MaxPool, largest_sum, shapes

CENTRE_Q16 = 255 << 15  # 127.5 px
LARGEST_EXPONENT = 3 << 16
# round(2^30 * 2^(2^-i)), i = 1 .. 16
EXP2_Q30 = (1518500250, 1276901417, 1170923762, 1121280436, 1097253708, 1085434106, 1079572136, 1076653033,
            1075196443, 1074468888, 1074105294, 1073923544, 1073832680, 1073787251, 1073764537, 1073753181)


def logistic_table():
    """u16[4096]: Q15 of 1 / (1 + exp(-z / 256)) at z = -2048 .. 2047."""
    return np.round(32768 / (1 + np.exp(-np.arange(-2048, 2048) / 256))).astype(np.uint16)


def norm_table(sigma_in, sigma_out, alpha, beta=0.75, offset=1.0):
    """s32[104] of local_response_norm: knots every 32 below 2048, from there every 1024. sigma: value of an activation
    of 1; alpha as trained, of a mean over five channels."""
    knots = np.concatenate([np.arange(64) * 32, 2048 + np.arange(40) * 1024])
    factor = (offset + alpha / 5 * 2 * knots * sigma_in**2) ** -beta
    return np.round(2**14 * (sigma_in / sigma_out) * factor).astype(np.int32)


def interpolated(table):
    """t at every S of 0 .. 40,320, as a device finds it between two knots."""
    s = np.arange(40321)
    near = s < 2048
    i = np.where(near, s >> 5, 62 + (s >> 10))
    f = np.where(near, (s & 31) << 3, (s & 1023) >> 2)
    table = np.asarray(table, np.int64)
    return table[i] + (((table[i + 1] - table[i]) * f + 128) >> 8)


def multiplied(values, multiplier, shift):
    """Mul of the document. values s64; (v * M + 2^(k-1)) >> k, held to +-2^30."""
    values = np.asarray(values, np.int64)
    assert values.size == 0 or int(np.abs(values).max()) * multiplier + (1 << (shift - 1)) < 2**63
    return np.clip((values * multiplier + (1 << (shift - 1))) >> shift, -(1 << 30), 1 << 30)


def exp2_q16(exponent):
    """64 * 2^exponent px in Q16 from an exponent in Q16, held to +-3: from the half down to the 65,536th."""
    exponent = np.clip(exponent, -LARGEST_EXPONENT, LARGEST_EXPONENT)
    power = np.full_like(exponent, 1 << 30)
    for i, constant in enumerate(EXP2_Q30):
        power = np.where(exponent >> (15 - i) & 1, (power * constant + (1 << 29)) >> 30, power)
    return power >> (8 - (exponent >> 16))


@dataclass
class Found:
    """Of n windows: raw s64[n, 5 or 2] heads, score Q15, centre x, y and d in Q16 px (None without geometry)."""
    raw: np.ndarray
    score: np.ndarray
    x: np.ndarray = None
    y: np.ndarray = None
    d: np.ndarray = None


def interpreted(model, raw):
    """Scores and geometry from raw heads s64[n, 2 or 5]."""
    (score, *geometry), raw = model.outputs, np.asarray(raw, np.int64)
    z = np.clip(multiplied(raw[:, 1] - raw[:, 0], *score), -2048, 2047)
    found = Found(raw, np.asarray(model.logistic, np.int64)[z + 2048])
    if raw.shape[1] == 5:
        x, y, e = (multiplied(raw[:, 2 + i], *scale) for i, scale in enumerate(geometry))
        found.x, found.y, found.d = CENTRE_Q16 + x, CENTRE_Q16 + y, exp2_q16(e)
    return found


def requantised(sums, bias, multiplier, shift):
    """Activations from accumulators s32[n, channels, height, width]."""
    rounding = 1 << (shift - 1) if shift else 0
    a = ((sums + (bias + rounding)) >> shift).clamp_(-32768, 32767)
    return (a.mul_(multiplier).add_(1 << 21) >> 22).clamp_(0, 127)


class _Products:
    """Accumulators of a convolution: weights s8[out, in / groups, rows, columns]."""

    def __init__(self, weights, stride, pad, groups, largest_input, device):
        bound = max(largest_sum(weights, np.zeros(len(weights)), 0, largest_input))
        assert bound < 2**31
        self.dtype = torch.float32 if bound < 2**24 else torch.float64
        self.weights = torch.from_numpy(weights.astype(np.float64)).to(device, self.dtype).flatten(1).chunk(groups)
        self.kernel, self.stride, self.pad, self.groups = weights.shape[2:], stride, pad, groups

    def __call__(self, x):
        height, width = (((size + 2 * pad - kernel) // stride + 1)
                         for size, pad, kernel, stride in zip(x.shape[2:], self.pad, self.kernel, self.stride))
        parts = [weights @ F.unfold(part, self.kernel, 1, self.pad, self.stride)
                 for weights, part in zip(self.weights, x.to(self.dtype).chunk(self.groups, 1))]
        return torch.cat(parts, 1).to(torch.int32).unflatten(2, (height, width))


def _per_channel(values, device):
    return torch.from_numpy(np.array(values, np.int32)).to(device)[:, None, None]


class _Weighted:
    def __init__(self, weights, layer, device, largest_input, stride=(1, 1), pad=(0, 0), groups=1):
        self.products = _Products(weights, stride, pad, groups, largest_input, device)
        self.device = device
        self.set_bias(layer.bias)
        self.raw = isinstance(layer, Heads)
        if not self.raw:
            self.multiplier, self.shift = _per_channel(layer.multiplier, device), layer.shift

    def set_bias(self, bias):
        self.bias = _per_channel(bias, self.device)

    def __call__(self, x):
        sums = self.products(x)
        return sums + self.bias if self.raw else requantised(sums, self.bias, self.multiplier, self.shift)


class _Norm:
    def __init__(self, layer, device):
        self.factor = torch.from_numpy(interpolated(layer.table).astype(np.int32)).to(device)

    def __call__(self, a):
        halves = F.pad(a * a >> 1, (0, 0, 0, 0, 2, 2))
        total = sum(halves[:, k:k + a.shape[1]] for k in range(5))
        return ((a * self.factor[total.long()]).add_(1 << 13) >> 14).clamp_(max=127)


class _Pool:
    def __init__(self, layer):
        self.kernel, self.stride = layer.kernel, layer.stride

    def __call__(self, a):
        for axis in (2, 3):
            count = (a.shape[axis] - self.kernel) // self.stride + 1
            windows = a.unfold(axis, self.kernel, self.stride)  # [..., count, kernel]
            assert windows.shape[axis] == count
            a = windows.amax(-1)
        return a


def _runnable(layer, device, largest_input):
    if isinstance(layer, Convolve):
        return _Weighted(layer.weights, layer, device, largest_input, layer.stride, layer.pad, layer.groups)
    if isinstance(layer, LocalResponseNorm):
        return _Norm(layer, device)
    if isinstance(layer, MaxPool):
        return _Pool(layer)
    if isinstance(layer, FullyConnected):
        return _Weighted(layer.weights.transpose(0, 3, 1, 2), layer, device, largest_input)
    return _Weighted(layer.weights[:, :, None, None], layer, device, largest_input)


class IntegerNetwork:
    """A Model, to be run on batches."""

    def __init__(self, model, device="cpu"):
        shapes(model)
        self.model, self.device = model, device
        self.layers = [_runnable(layer, device, 127 if i else 128) for i, layer in enumerate(model.layers)]

    def input(self, images):
        """s32[n, 4, height, width / 4] from u8[n, height, width]: four neighbouring pixels are four channels."""
        if self.model.normalise:
            q = normalised(images)
        else:
            q = np.clip(images.astype(np.int32) - self.model.mean, -128, 127)
        n, height, width = q.shape
        folded = q.reshape(n, height, width // 4, 4).transpose(0, 3, 1, 2)
        return torch.from_numpy(np.ascontiguousarray(folded, np.int32)).to(self.device)

    @torch.no_grad()
    def activations(self, images):
        """After each layer in turn, s32[n, channels, height, width]; the last are the raw heads."""
        x = self.input(images)
        for layer in self.layers:
            x = layer(x)
            yield x

    def raw(self, images):
        """s64[n, 2 or 5] of u8[n, 256, 256]."""
        for x in self.activations(images):
            pass
        return x.flatten(1).cpu().numpy().astype(np.int64)

    def found(self, images, batch=None, progress=None):
        """Found of any number of images, `batch` at a time; progress(done) after each. Without `batch`, what is fastest:
        on a CPU few enough that activations stay in its caches (11 ms an image of lite by fours, 42 by twenty-fives)."""
        parts, batch = [], batch or (4 if self.device == "cpu" else 200)
        for first in range(0, len(images), batch):
            parts.append(self.raw(images[first:first + batch]))
            if progress:
                progress(min(len(images), first + batch))
        return interpreted(self.model, np.concatenate(parts))
