"""From a float network to an integer one: what activations are worth, weights, multipliers, biases.

A sigma is the value of an activation of 1: activations are 0 .. 127 sigma. A layer's unit is the value of 1 in its
accumulators, per channel: sigma of its input times the channel's weight scale."""
import math
from dataclasses import dataclass

import numpy as np
import torch

import float_network
import model_file
from integer_network import IntegerNetwork, logistic_table, norm_table
from model_file import LARGEST_SUM, Convolve, FullyConnected, LocalResponseNorm, MaxPool, Model, largest_sum

METHODS = ("max", "99.99 %", "99.9 %", "least squares")
BINS = 4096


class Ranges:
    """What the activations of a float network are like on some images: greatest values and histograms a step, greatest
    value and mean before ReLU a channel."""

    def __init__(self, run, images, batch=4):
        self.largest, self.histogram, self.channel_largest, self.channel_mean = {}, {}, {}, {}
        self.run, self.images, self.batch = run, images, batch
        for step in self._steps():
            top = step.x.amax((0, 2, 3)).cpu().numpy()
            self.channel_largest[step.name] = np.maximum(self.channel_largest.get(step.name, 0), top)
            if step.sums is not None:
                total = step.sums.double().mean((2, 3)).sum(0).cpu().numpy()
                self.channel_mean[step.name] = self.channel_mean.get(step.name, 0) + total / len(images)
        self.largest = {name: max(float(top.max()), 1e-6) for name, top in self.channel_largest.items()}
        for step in self._steps():
            counts = torch.histc(step.x[step.x > 0].float(), BINS, 0, self.largest[step.name]).cpu().double().numpy()
            self.histogram[step.name] = self.histogram.get(step.name, 0) + counts

    def _steps(self):
        for first in range(0, len(self.images), self.batch):
            yield from self.run.steps(self.run.input(self.images[first:first + self.batch]))

    def sigma(self, name, method):
        """By METHODS: the percentiles are of the activations above 0."""
        largest, counts = self.largest[name], self.histogram[name]
        if method == "max":
            return largest / 127
        centres = (np.arange(BINS) + 0.5) * largest / BINS
        if method == "least squares":
            candidates = largest / 127 * np.linspace(0.2, 1, 161)
            return float(min(candidates, key=lambda s: counts @ (np.clip(np.round(centres / s), 0, 127) * s - centres)**2))
        share = np.cumsum(counts) / counts.sum()
        return float(centres[np.searchsorted(share, float(method.split()[0]) / 100)]) / 127


@dataclass
class Quantised:
    """A Model with what its numbers are worth. sigmas: by step, of its output. units: by weighted step, of 1 in its
    accumulators, per channel. input_sigma: of the model's input."""
    model: Model
    names: list
    sigmas: dict
    units: dict
    input_sigma: float

    def scales(self):
        """By weighted step: the value of a weight of 1, per channel."""
        before = dict(zip(self.names, [self.input_sigma, *(self.sigmas[name] for name in self.names)]))
        return {name: unit / before[name] for name, unit in self.units.items()}


class DoesNotFit(ValueError):
    """A layer that int8 weights and 32-bit sums cannot hold."""


def _along(scale, weights):
    """scale[out] as a factor of weights[out, ...], in their type."""
    return scale.astype(weights.dtype).reshape(-1, *[1] * (weights.ndim - 1))


def weights_in(weights, scale):
    """s8 of weights[out, ...] in units of scale[out], -127 .. 127."""
    return np.clip(np.round(weights / _along(scale, weights)), -127, 127).astype(np.int8)


def _natural_scale(weights):
    largest = np.abs(weights).reshape(len(weights), -1).max(1).astype(np.float64)
    return np.where(largest > 0, largest, max(largest.max(), 1e-6)) / 127


def requantised_layer(weights, bias, sigma_in, sigma_out, reach, largest_input, scale=None):
    """(weights s8, bias s32, M, shift, unit) of float weights[out, ...] and bias[out].

    M = scale * sigma_in / sigma_out * 2^(22 + shift) has to stay below 2^15, and at least 128 times the channel's reach,
    its greatest activation in calibration: the 16 bits before the multiplication end at 32,767, out at 32,767 M / 2^22.
    A channel outside gets a coarser or a finer scale (its greatest weights clipped). The shift is the one whose weights
    come closest to the float ones. `scale`: what is natural, if not that the greatest weight is 127."""
    natural = _natural_scale(weights) if scale is None else scale
    reach = np.clip(reach / sigma_out * 1.02, 1, 127)
    first = math.floor(math.log2(32767 / (natural.max() * sigma_in / sigma_out * 2**22)))
    if first < 0:
        raise DoesNotFit("its sums are too small for a multiplier below 2^15: give its output a larger scale")
    best = None
    for shift in range(min(first, 30), min(first + 6, 31)):
        worth = sigma_out / sigma_in / 2.0 ** (22 + shift)  # the weight scale that 1 in M stands for
        scale = np.clip(natural, 128 * reach * worth, 32767 * worth)
        integers = weights_in(weights, scale)
        error = float(np.sum((integers * _along(scale, weights) - weights) ** 2))
        if best is None or error < best[0]:
            best = error, shift, scale, integers
        if (scale == natural).all():
            break
    _, shift, scale, integers = best
    multiplier = np.round(scale * sigma_in / sigma_out * 2.0 ** (22 + shift)).astype(np.int32)
    unit = scale * sigma_in
    return integers, held_bias(bias / unit, integers, shift, largest_input), multiplier, shift, unit


def least_sigma(weights, sigma_in, scale=None):
    """The smallest sigma of a layer's output for which M stays below 2^15: a single product may not be worth more than
    the whole output."""
    natural = _natural_scale(weights) if scale is None else scale
    return float(natural.max() * sigma_in * 2**22 / 32767 * (1 + 1e-9))


def held_bias(bias, integers, shift, largest_input):
    """s32 of a bias in accumulator units. One so far below 0 that the channel is silent anyway may end early; one that
    would overflow upwards is refused."""
    room = np.array([LARGEST_SUM - total for total in largest_sum(integers, np.zeros(len(integers)), shift, largest_input)])
    if (np.round(bias) > room).any():
        raise DoesNotFit(f"output channel {int(np.argmax(bias - room))}: its bias overflows 32 bits; its weights are too "
                         "small beside it")
    return np.clip(np.round(bias), -room, room).astype(np.int32)


def folded_input(weights, left=0, words=None):
    """[out, 4, rows, words] from [out, 1, rows, columns]: four pixels a word, `left` columns of 0 before and as many as
    are missing behind."""
    out, _, rows, columns = weights.shape
    words = words or (left + columns + 3) // 4
    padded = np.zeros((out, rows, words * 4), weights.dtype)
    padded[:, :, left:left + columns] = weights[:, 0]
    return padded.reshape(out, rows, words, 4).transpose(0, 3, 1, 2)


def folded_columns(kernel, stride, pad, width=model_file.SIDE):
    """(columns of 0 on the left, words of the kernel, words of padding) of a first layer that reads four pixels a word;
    stride, a multiple of 4, and pad in pixels."""
    if stride % 4:
        raise DoesNotFit(f"a stride of {stride} in the first layer, which reads four pixels at a time: must be 4, 8, ...")
    pad_words = (pad + 3) // 4
    left = 4 * pad_words - pad
    words, wanted = (left + kernel + 3) // 4, (width + 2 * pad - kernel) // stride
    while (width // 4 + 2 * pad_words - words) // (stride // 4) > wanted:
        words += 1  # a wider kernel, of 0 there, stops where the pixels' does
    return left, words, pad_words


def fixed_point(factor):
    """(M, k) with M / 2^k the nearest to factor, 2^29 <= M < 2^30."""
    k = 30 - math.frexp(factor)[1]
    if not 1 <= k <= 62:
        raise DoesNotFit(f"an output scale of {factor:.3g} does not fit M / 2^k")
    return min(round(factor * 2.0**k), 2**30 - 1), k


def _arrays(layer):
    return layer.weights.cpu().numpy(), layer.bias.cpu().double().numpy()


class Builder:
    """Builds integer networks of one float network for any choice of sigmas. scales: of the weights, by step, where they
    are given (after fine-tuning)."""

    def __init__(self, run, ranges, scales=None):
        self.run, self.ranges, self.scales = run, ranges, scales or {}

    def _mean(self):
        """What integers take off grey levels. 128 clamps no pixel, the mean goes into the bias; but beyond the border
        integers see what was taken off, which has to be the mean where there is padding."""
        if self.run.normalise:
            return 0
        return min(255, max(0, round(self.run.mean))) if max(self.run.layers[0].pad) else 128

    def _folded(self, layer, weights, bias):
        """The first layer's weights, bias, stride and pad for words of four pixels."""
        (rows, columns), pad = layer.stride, layer.pad
        left, words, pad_words = folded_columns(weights.shape[3], columns, pad[1])
        if not self.run.normalise:
            bias = bias + weights.sum((1, 2, 3)) * (self._mean() - self.run.mean) * self.run.scale
        return folded_input(weights, left, words), bias, (rows, columns // 4), (pad[0], pad_words)

    def _requantised(self, layer, weights, bias, sigma_in, sigma_out, first):
        return requantised_layer(weights, bias, sigma_in, sigma_out, self.ranges.channel_largest[layer.name],
                                 128 if first else 127, self.scales.get(layer.name))

    def _weighted(self, step, sigma, sigma_out, first):
        """(integer layer, unit) of a convolution or fully connected layer."""
        weights, bias = _arrays(step)
        if isinstance(step, float_network.Connected):
            *integers, unit = self._requantised(step, weights.transpose(0, 2, 3, 1), bias, sigma, sigma_out, first)
            return FullyConnected(*integers), unit
        stride, pad = step.stride, step.pad
        if first:
            weights, bias, stride, pad = self._folded(step, weights, bias)
        *integers, unit = self._requantised(step, weights, bias, sigma, sigma_out, first)
        return Convolve(*integers, stride, pad, step.groups), unit

    def _unweighted(self, step, sigma, sigma_out):
        if isinstance(step, float_network.Pool):
            return MaxPool(step.kernel, step.stride)
        table = norm_table(sigma, sigma_out, step.alpha, step.beta, step.offset)
        if table.max() >= 2**16:
            raise DoesNotFit(f"it makes activations up to {table.max() / 2**14:.3g} times as large: must be below 4")
        return LocalResponseNorm(table)

    def build(self, sigmas, name="", notes=""):
        """Quantised; sigmas by name of all steps but pools and heads, as small as asked for where that fits."""
        run, sigma = self.run, self.run.scale
        layers, units, values = [], {}, {}
        for i, step in enumerate(run.layers):
            sigma_out = sigmas.get(step.name, sigma)
            try:
                if isinstance(step, float_network.Heads):
                    layer, units[step.name] = self._heads(step, sigma)
                elif isinstance(step, (float_network.Norm, float_network.Pool)):
                    layer = self._unweighted(step, sigma, sigma_out)
                else:
                    sigma_out = max(sigma_out, least_sigma(_arrays(step)[0], sigma, self.scales.get(step.name)))
                    layer, units[step.name] = self._weighted(step, sigma, sigma_out, i == 0)
            except DoesNotFit as error:
                raise DoesNotFit(f"{step.name}: {error}") from None
            layers.append(layer)
            sigma = values[step.name] = sigma_out
        unit = units[run.layers[-1].name]
        outputs = [fixed_point(256 * unit[0])]
        if len(unit) == 5:
            outputs += [fixed_point(factor * unit[2 + i]) for i, factor in enumerate((2**23, 2**23, 2**16 / math.log(2)))]
        else:
            outputs += [(0, 1)] * 3
        model = Model(name, notes, int(run.normalise), self._mean(), layers, outputs, logistic_table())
        names = [step.name for step in run.layers]
        model_file.shapes(model, names)
        return Quantised(model, names, values, units, run.scale)

    def _heads(self, step, sigma):
        (weights, bias), scale = _arrays(step), self.scales.get(step.name)
        if scale is None:
            scale = _natural_scale(weights)
            scale[:2] = scale[:2].max()  # two scores are compared: one scale
        integers = weights_in(weights, scale)
        unit = scale * sigma
        return model_file.Heads(integers, held_bias(bias / unit, integers, 0, 127)), unit


def correct_biases(quantised, ranges):
    """Shifts every bias so that each channel's mean over the calibration images is the float network's: rounding the
    weights moves means, and a moved mean moves all that follows. In place, layer after layer."""
    model = quantised.model
    network = IntegerNetwork(model, ranges.run.device)
    at = [network.input(ranges.images[i:i + ranges.batch]) for i in range(0, len(ranges.images), ranges.batch)]
    for i, (name, layer) in enumerate(zip(quantised.names, model.layers)):
        if name in quantised.units:
            total = sum(network.layers[i].products(x).double().mean((2, 3)).sum(0).cpu().numpy() for x in at)
            bias = ranges.channel_mean[name] / quantised.units[name] - total / len(ranges.images)
            largest_input = 127 if i else 128
            layer.bias = held_bias(bias, layer.weights, getattr(layer, "shift", 0), largest_input)
            network.layers[i].set_bias(layer.bias)
        at = [network.layers[i](x) for x in at]


def dequantised(quantised, raw):
    """float64[n, 5 or 2] of raw heads."""
    return raw * quantised.units[quantised.names[-1]]


def signal_to_noise(quantised, run, images):
    """By step, in dB: of the integer network up to there, and of that layer alone on the float network's rounded
    input."""
    network = IntegerNetwork(quantised.model, run.device)
    x, before, out = network.input(images), network.input(images), {}
    for name, layer, step in zip(quantised.names, network.layers, run.steps(run.input(images))):
        x, alone = layer(x), layer(before)
        last = name == quantised.names[-1]
        unit = quantised.units[name] if last else quantised.sigmas[name]
        exact = step.x.cpu().double().numpy()
        value = np.asarray(unit).reshape(-1, 1, 1)
        out[name] = tuple(10 * math.log10((exact**2).sum() / max(((got.cpu().numpy() * value - exact) ** 2).sum(), 1e-30))
                          for got in (x, alone))
        if not last:
            before = (step.x / quantised.sigmas[name]).round_().clamp_(0, 127).to(torch.int32)
    return out
