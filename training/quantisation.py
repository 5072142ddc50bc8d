"""From a float network to an integer one: what activations are worth, weights, multipliers, biases.

A sigma is the value of an activation of 1: activations are 0 .. 127 sigma. A layer's unit is the value of 1 in its
accumulators, per channel: sigma of its input times the channel's weight scale."""
import math
from dataclasses import dataclass

import numpy as np
import torch

import model_file
from integer_network import IntegerNetwork, logistic_table, norm_table
from model_file import LARGEST_SUM, Convolve, FullyConnected, Heads, LocalResponseNorm, MaxPool, Model, largest_sum
from train import INPUT_SCALE

METHODS = ("max", "99.99 %", "99.9 %", "least squares")
BINS = 4096


class Ranges:
    """What the activations of a float run are like on some images: greatest values and histograms a step, greatest
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
    accumulators, per channel."""
    model: Model
    names: list
    sigmas: dict
    units: dict

    def scales(self):
        """By weighted step: the value of a weight of 1, per channel."""
        before = dict(zip(self.names, [INPUT_SCALE, *(self.sigmas[name] for name in self.names)]))
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


def held_bias(bias, integers, shift, largest_input):
    """s32 of a bias in accumulator units. One so far below 0 that the channel is silent anyway may end early; one that
    would overflow upwards is refused."""
    room = np.array([LARGEST_SUM - total for total in largest_sum(integers, np.zeros(len(integers)), shift, largest_input)])
    if (np.round(bias) > room).any():
        raise DoesNotFit(f"output channel {int(np.argmax(bias - room))}: its bias overflows 32 bits; its weights are too "
                         "small beside it")
    return np.clip(np.round(bias), -room, room).astype(np.int32)


def folded_input(weights):
    """[out, 4, rows, words] from [out, 1, rows, columns]: four pixels a word, what is missing of the last one 0."""
    out, _, rows, columns = weights.shape
    words = (columns + 3) // 4
    padded = np.zeros((out, rows, words * 4), weights.dtype)
    padded[:, :, :columns] = weights[:, 0]
    return padded.reshape(out, rows, words, 4).transpose(0, 3, 1, 2)


def fixed_point(factor):
    """(M, k) with M / 2^k the nearest to factor, 2^29 <= M < 2^30."""
    k = 30 - math.frexp(factor)[1]
    if not 1 <= k <= 62:
        raise DoesNotFit(f"an output scale of {factor:.3g} does not fit M / 2^k")
    return min(round(factor * 2.0**k), 2**30 - 1), k


def weighted_modules(network):
    """Convolutions and fully connected layers by step, without the heads."""
    return {**{f"conv{i}": conv for i, conv in enumerate(network.convs, 1)},
            **{f"fc{i}": layer for i, layer in enumerate(network.hidden, len(network.convs) + 1)}}


class Builder:
    """Builds integer networks of one run for any choice of sigmas. scales: of the weights, by step, where they are
    given (after fine-tuning)."""

    def __init__(self, run, ranges, scales=None):
        self.run, self.ranges, self.scales = run, ranges, scales or {}
        self.weights = weighted_modules(run.network)

    def _float(self, module):
        return module.weight.detach().cpu().numpy(), module.bias.detach().cpu().double().numpy()

    def _layer(self, name, sigma_in, sigma_out, convert, bias_shift=0.0):
        weights, bias = self._float(self.weights[name])
        first = name == "conv1"
        try:
            return requantised_layer(convert(weights), bias + bias_shift, sigma_in, sigma_out,
                                     self.ranges.channel_largest[name], 128 if first else 127, self.scales.get(name))
        except DoesNotFit as error:
            raise DoesNotFit(f"{name}: {error}") from None

    def build(self, sigmas, name="", notes=""):
        """Quantised; sigmas by name of conv, norm and fc steps."""
        network, normalise = self.run.network, self.run.settings["normalise"]
        layers, names, units, values = [], [], {}, dict(sigmas)
        sigma, side = INPUT_SCALE, model_file.SIDE

        def add(step, layer, unit=None):
            names.append(step)
            layers.append(layer)
            values[step] = sigma
            if unit is not None:
                units[step] = unit

        for i, spec in enumerate(network.specs, 1):
            step, stride, convert, bias_shift = f"conv{i}", (spec.stride, spec.stride), lambda weights: weights, 0.0
            if i == 1:
                words, word_stride = (spec.kernel + 3) // 4, spec.stride // 4
                if spec.pad or spec.stride % 4 or (side // 4 - words) // word_stride != (side - spec.kernel) // spec.stride:
                    raise DoesNotFit("conv1: only strides of 4, 8, ... without padding are taken four pixels a word")
                stride, convert = (spec.stride, word_stride), folded_input
                # Integers take 128 off instead of the training mean, so that no pixel is clamped.
                if not normalise:
                    bias_shift = self._float(self.weights[step])[0].sum((1, 2, 3)) * (128 - self.run.mean) * INPUT_SCALE
            weights, bias, multiplier, shift, unit = self._layer(step, sigma, sigmas[step], convert, bias_shift)
            sigma = sigmas[step]
            add(step, Convolve(weights, bias, multiplier, shift, stride, (spec.pad, spec.pad), spec.groups), unit)
            table = norm_table(sigma, sigmas[f"norm{i}"], network.lrn.alpha * 5)
            sigma = sigmas[f"norm{i}"]
            add(f"norm{i}", LocalResponseNorm(table))
            side = (side + 2 * spec.pad - spec.kernel) // spec.stride + 1
            if spec.pool:
                add(f"pool{i}", MaxPool(3, 2))
                side = (side - 3) // 2 + 1
        channels = network.specs[-1].channels
        for i in range(len(network.specs) + 1, len(network.specs) + 1 + len(network.hidden)):
            step, shape = f"fc{i}", (channels, side, side)
            # torch flattens channels, rows, columns
            weights, bias, multiplier, shift, unit = self._layer(
                step, sigma, sigmas[step], lambda w, shape=shape: w.reshape(-1, *shape).transpose(0, 2, 3, 1))
            sigma = sigmas[step]
            add(step, FullyConnected(weights, bias, multiplier, shift), unit)
            channels, side = len(weights), 1
        heads, unit = self._heads(sigma)
        add("heads", heads, unit)
        outputs = [fixed_point(256 * unit[0]), fixed_point(128 * 65536 * unit[2]), fixed_point(128 * 65536 * unit[3]),
                   fixed_point(65536 / math.log(2) * unit[4])]
        model = Model(name, notes, int(normalise), 0 if normalise else 128, layers, outputs, logistic_table())
        model_file.shapes(model)
        return Quantised(model, names, values, units)

    def _heads(self, sigma):
        (score, score_bias), (geometry, geometry_bias) = (self._float(head) for head in (self.run.network.score,
                                                                                         self.run.network.geometry))
        scale = self.scales.get("heads")
        if scale is None:
            scale = _natural_scale(np.concatenate([score, geometry]))
            scale[:2] = scale[:2].max()  # two scores are compared: one scale
        integers = weights_in(np.concatenate([score, geometry]), scale)
        unit = scale * sigma
        return Heads(integers, held_bias(np.concatenate([score_bias, geometry_bias]) / unit, integers, 0, 127)), unit


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
    """float64[n, 5] of raw heads."""
    return raw * quantised.units["heads"]


def signal_to_noise(quantised, run, images):
    """By step, in dB: of the integer network up to there, and of that layer alone on the float network's rounded
    input."""
    network = IntegerNetwork(quantised.model, run.device)
    x, before, out = network.input(images), network.input(images), {}
    for name, layer, step in zip(quantised.names, network.layers, run.steps(run.input(images))):
        x, alone = layer(x), layer(before)
        unit = quantised.units["heads"] if name == "heads" else quantised.sigmas[name]
        exact = step.x.cpu().double().numpy()
        value = np.asarray(unit).reshape(-1, 1, 1)
        out[name] = tuple(10 * math.log10((exact**2).sum() / max(((got.cpu().numpy() * value - exact) ** 2).sum(), 1e-30))
                          for got in (x, alone))
        if name != "heads":
            before = (step.x / quantised.sigmas[name]).round_().clamp_(0, 127).to(torch.int32)
    return out
