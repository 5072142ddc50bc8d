"""ONNX nodes into the layers of float_network.py, one after the other; what has no such layer is refused by its name."""
from dataclasses import dataclass, field

import numpy as np
import torch
from onnx import helper

import float_network
from model_file import SIDE
from onnx_graph import Graph, Unsupported, label, refuse
from quantisation import DoesNotFit, folded_columns

_RELU = "Berth's activations are 0 to 127 steps: put a Relu behind it, directly or after BatchNormalization or MaxPool"
_READ = {"Conv", "Gemm", "MatMul", "Add", "BatchNormalization", "Relu", "LRN", "MaxPool", "Identity", "Dropout", "Flatten",
         "Reshape", "Squeeze", "Unsqueeze", "Softmax", "LogSoftmax", "Sigmoid"}
_AFTER_THE_END = {"Identity", "Flatten", "Reshape", "Squeeze", "Unsqueeze"}
_REMEDIES = {
    "AveragePool": "train with MaxPool or a Conv with a stride", "GlobalAveragePool": "flatten the map into a Gemm",
    "LeakyRelu": "train with Relu", "PRelu": "train with Relu", "Elu": "train with Relu", "Gelu": "train with Relu",
    "HardSwish": "train with Relu", "Clip": "train with Relu", "Transpose": "export it with channels first",
    "Pad": "put the padding into the attribute pads of the Conv behind it", "ConvTranspose": "train without it",
    "QuantizeLinear": "give the float network", "DequantizeLinear": "give the float network",
    "QLinearConv": "give the float network", "ConvInteger": "give the float network",
    **dict.fromkeys(("Sub", "Mul", "Div"), "leave the scaling of the image out of the export and give --mean and --scale"),
}


@dataclass
class Imported:
    """layers of float_network; notes: what was left out or taken for something; tensors: where the graph has the numbers
    of the heads, (name, count) each, in their order."""
    graph: Graph
    layers: list
    notes: list
    tensors: list

    def exact(self, x):
        """(runtime, float64[2 or 5]) of one image float[1, 1, 256, 256], as the graph itself says."""
        runtime, values = self.graph.values([name for name, _ in self.tensors], x)
        values = [value.reshape(-1) for value in values]
        if len(values[0]) == 1:
            values.insert(0, np.zeros(1))
        return runtime, np.concatenate(values).astype(np.float64)


def _times(sizes):
    return " x ".join(map(str, sizes))


def _four(count):
    return (count + 3) // 4 * 4


def _padded(array, axis):
    """`array` with zeros to a multiple of four along `axis`: channels that are silent."""
    width = [(0, 0)] * array.ndim
    width[axis] = (0, _four(array.shape[axis]) - array.shape[axis])
    return np.pad(array, width)


@dataclass
class _Open:
    """A weighted layer whose Relu is to come. weights float64[out, in / groups, rows, columns]; pools: between it and its
    Relu, which may change places."""
    node: object
    weights: np.ndarray
    bias: np.ndarray
    of_map: tuple
    stride: int = 1
    pad: tuple = (0, 0)
    groups: int = 1
    connected: bool = False
    pools: list = field(default_factory=list)


class _Chain:
    """The layers so far. shape: channels, rows, columns of what the last node gives; end: the Softmax or Sigmoid."""

    def __init__(self, graph):
        self.graph, self.layers, self.notes, self.names = graph, [], [], {}
        self.shape, self.open, self.end, self.tensor = (1, SIDE, SIDE), None, None, graph.input

    def branch(self):
        other = _Chain(self.graph)
        other.layers, other.notes, other.names = self.layers, self.notes, self.names
        other.shape, other.open, other.end, other.tensor = self.shape, self.open, self.end, self.tensor
        return other

    def take(self, node):
        handler = getattr(self, "_" + node.op_type) if node.op_type in _READ else None
        if node.domain not in ("", "ai.onnx"):
            refuse(node, f"an op of '{node.domain}'", "only ONNX's own are read")
        if handler is None:
            refuse(node, "Berth has no such layer", _REMEDIES.get(node.op_type, "train or export the network without it"))
        if self.end is not None and node.op_type not in _AFTER_THE_END:
            refuse(node, f"comes after {label(self.end)}", "only the end of a network may have that")
        attributes = {a.name: helper.get_attribute_value(a) for a in node.attribute}
        handler(node, attributes)
        if self.end is None:
            self.tensor = node.output[0]

    # What nodes have in common

    def _name(self, node):
        """Of a layer: unique, the node's where that is."""
        return self.unique(node.name or node.output[0])

    def unique(self, name):
        count = self.names[name] = self.names.get(name, 0) + 1
        return name if count == 1 else self.unique(f"{name} ({count})")

    def _constant(self, node, index, what, default=None):
        name = node.input[index] if index < len(node.input) else ""
        if not name and default is not None:
            return default
        if name not in self.graph.constants:
            by = self.graph.producer.get(name)
            refuse(node, f"its {what} '{name}' comes from {label(by) if by else 'the image'}, not from the file's constants",
                   _REMEDIES.get(by.op_type if by else "", "export the network with constants folded"))
        try:
            with np.errstate(invalid="ignore"):
                value = np.asarray(self.graph.constants[name], np.float64)
        except (TypeError, ValueError):
            value = np.array(np.nan)
        if not np.isfinite(value).all():
            refuse(node, f"its {what} '{name}' has values that are no numbers", "train or export the network again")
        return value

    @staticmethod
    def _only(node, attributes, name, wanted, remedy):
        value = attributes.get(name, wanted)
        if value != wanted:
            refuse(node, f"{name} is {value}, must be {wanted}", remedy)

    def _square(self, node, attributes, name, default):
        values = attributes.get(name, default)
        if len(values) != 2 or values[0] != values[1] or values[0] < 1:
            refuse(node, f"{name} is {values}", "train it with two equal ones")
        return values[0]

    def _pads(self, node, attributes, kernel, stride):
        """(rows, columns) on every side."""
        auto, pads = attributes.get("auto_pad", b"NOTSET").decode(), attributes.get("pads", [0, 0, 0, 0])
        if auto.startswith("SAME"):
            total = [max(0, ((size + stride - 1) // stride - 1) * stride + k - size)
                     for size, k in zip(self.shape[1:], kernel)]
            small, large = [t // 2 for t in total], [t - t // 2 for t in total]
            pads = [*small, *large]
        elif auto == "VALID":
            pads = [0, 0, 0, 0]
        if len(pads) != 4 or pads[:2] != pads[2:] or min(pads) < 0:
            by = f" by auto_pad {auto}" if auto != "NOTSET" else ""
            refuse(node, f"pads are {pads}{by}, not the same on opposite sides",
                   "train it with symmetric padding")
        return tuple(pads[:2])

    def _resized(self, node, channels, kernel, stride, pad):
        """Sizes round down; what the graph itself says has to be the same."""
        sizes = [(size + 2 * p - k) // stride + 1 for size, k, p in zip(self.shape[1:], kernel, pad)]
        if min(sizes) < 1:
            refuse(node, f"its kernel of {_times(kernel)} is larger than its input of {_times(self.shape[1:])}",
                   "train it for windows of this size")
        self.shape = (channels, *sizes)
        known = self.graph.shapes.get(node.output[0])
        if known is not None and known[1:] != self.shape:
            refuse(node, f"gives {_times(known[1:])}, Berth's layer {_times(self.shape)} (sizes round down)",
                   "train it with ceil_mode 0")

    def _closed(self, node):
        """The layer before has had its Relu, or is refused."""
        if self.open:
            refuse(self.open.node, f"no Relu between it and {label(node)}", _RELU)

    def _weighted(self, node, weights, bias, **rest):
        self.open = _Open(node, weights, bias, self.shape, **rest)

    # Layers

    def _Conv(self, node, attributes):
        self._closed(node)
        weights = self._constant(node, 1, "weights")
        if weights.ndim != 4:
            refuse(node, f"its weights have {weights.ndim} dimensions", "only convolutions of images (4) are read")
        out, each, *kernel = weights.shape
        groups = attributes.get("group", 1)
        self._only(node, attributes, "dilations", [1, 1], "train it without dilation")
        if min(weights.shape) < 1 or groups < 1 or out % groups:
            refuse(node, f"weights of the shape {list(weights.shape)}, group {groups}", "export the network again")
        stride = self._square(node, attributes, "strides", [1, 1])
        pad = self._pads(node, attributes, kernel, stride)
        if self.shape[0] != each * groups:
            refuse(node, f"takes {each * groups} channels, gets {self.shape[0]}", "export the network again")
        if groups > 1 and (each % 4 or out // groups % 4):
            refuse(node, f"group is {groups}: {each} input and {out // groups} output channels a group, not multiples of 4",
                   "train it with fewer groups (depthwise convolutions are not possible)")
        if not self.layers:
            try:
                folded_columns(kernel[1], stride, pad[1])
            except DoesNotFit as error:
                refuse(node, f"strides are [{stride}, {stride}]: {error}", "train it with such strides in its first Conv")
        bias = self._constant(node, 2, "bias", np.zeros(out))
        if bias.shape != (out,):
            refuse(node, f"a bias of the shape {list(bias.shape)} for {out} channels", "export the network again")
        self._weighted(node, weights, bias, stride=stride, pad=pad, groups=groups)
        self._resized(node, out, kernel, stride, pad)

    def _connected(self, node, weights, bias):
        """weights [out, in]"""
        self._closed(node)
        channels, rows, columns = self.shape
        if weights.shape[1] != channels * rows * columns:
            refuse(node, f"takes {weights.shape[1]} numbers, gets {channels * rows * columns}",
                   "flatten the whole map before it")
        if not self.layers:
            refuse(node, "comes before any Conv", "the first layer has to be a Conv with a stride of 4 or 8")
        self._weighted(node, weights.reshape(-1, channels, rows, columns), bias, connected=True)
        self.shape = (len(weights), 1, 1)

    def _Gemm(self, node, attributes):
        self._only(node, attributes, "transA", 0, "export it as x W + b")
        weights = self._constant(node, 1, "weights") * attributes.get("alpha", 1.0)
        weights = weights if attributes.get("transB", 0) else weights.T
        bias = self._constant(node, 2, "bias", np.zeros(1)) * attributes.get("beta", 1.0)
        if weights.ndim != 2 or bias.size not in (1, len(weights)):
            refuse(node, f"weights of the shape {list(weights.shape)}, bias {list(bias.shape)}", "export the network again")
        self._connected(node, weights, np.broadcast_to(bias.reshape(-1), len(weights)).copy())

    def _MatMul(self, node, attributes):
        weights = self._constant(node, 1, "weights")
        if weights.ndim != 2:
            refuse(node, f"its weights have {weights.ndim} dimensions, must have 2", "export it as a Gemm")
        self._connected(node, weights.T, np.zeros(weights.shape[1]))

    def _Add(self, node, attributes):
        """Of a constant: a bias."""
        index = 0 if node.input[0] in self.graph.constants else 1
        value = self._constant(node, index, "constant")
        if not self.open or self.open.pools:
            refuse(node, "adds a constant where there is no Conv, Gemm or MatMul directly before it",
                   "train it with its bias there "
                   "(what is added to the image is --mean)")
        shape = self.shape if len(self.graph.shapes.get(node.output[0], self.shape)) == 4 else self.shape[:1]
        try:
            value = np.broadcast_to(value, (1, *shape)).reshape(shape[0], -1)
        except ValueError:
            refuse(node, f"its constant has the shape {list(value.shape)}", "a bias has one number a channel")
        if (value != value[:, :1]).any():
            refuse(node, "its constant differs from pixel to pixel", "a bias has one number a channel")
        self.open.bias = self.open.bias + value[:, 0]

    def _BatchNormalization(self, node, attributes):
        self._only(node, attributes, "training_mode", 0, "export the network for inference")
        if not self.open or self.open.pools:
            refuse(node, "does not come directly after a Conv or Gemm",
                   "train it with BatchNormalization between Conv and Relu")
        scale, offset, mean, variance = (self._constant(node, 1 + i, what) for i, what in
                                         enumerate(("scale", "B", "mean", "variance")))
        epsilon, channels = attributes.get("epsilon", 1e-5), self.shape[0]
        if {scale.shape, offset.shape, mean.shape, variance.shape} != {(channels,)} or (variance + epsilon <= 0).any():
            refuse(node, "not one scale, B, mean and variance above 0 a channel", "export the network again")
        factor = scale / np.sqrt(variance + epsilon)
        self.open.weights = self.open.weights * factor[:, None, None, None]
        self.open.bias = (self.open.bias - mean) * factor + offset

    def _Relu(self, node, attributes):
        """Closes the layer before it; behind MaxPool, LRN or another Relu it changes nothing."""
        if self.open is None:
            if not self.layers:
                refuse(node, "comes before any Conv", "leave it out of the export")
            return
        one, self.open = self.open, None
        name, weights = self._name(one.node), _padded(one.weights, 0)
        if self.layers and one.groups == 1:
            weights = _padded(weights, 1)
        tensors = (torch.from_numpy(np.ascontiguousarray(a, np.float32)) for a in (weights, _padded(one.bias, 0)))
        if one.connected:
            self.layers.append(float_network.Connected(name, *tensors))
        else:
            self.layers.append(float_network.Convolution(name, *tensors, (one.stride,) * 2, one.pad, one.groups))
        self.layers += one.pools

    def _LRN(self, node, attributes):
        self._closed(node)
        self._only(node, attributes, "size", 5, "train it with a size of 5")
        alpha, beta, offset = (float(attributes.get(name, default)) for name, default in
                               (("alpha", 1e-4), ("beta", 0.75), ("bias", 1.0)))
        if not self.layers or offset <= 0 or alpha < 0 or beta < 0:
            refuse(node, f"alpha {alpha:g}, beta {beta:g}, bias {offset:g}{'' if self.layers else ', before any Conv'}",
                   "alpha and beta must be at least 0, bias above 0, a Conv before")
        self.layers.append(float_network.Norm(self._name(node), alpha, beta, offset))

    def _MaxPool(self, node, attributes):
        kernel = self._square(node, attributes, "kernel_shape", [])
        stride = self._square(node, attributes, "strides", [1, 1])
        self._only(node, attributes, "dilations", [1, 1], "train it without dilation")
        pads = self._pads(node, attributes, (kernel, kernel), stride)
        if max(pads):
            refuse(node, f"pads are {list(pads)}, must be 0", "train it without padding, the padding in the Conv before")
        if not self.layers and not self.open:
            refuse(node, "comes before any Conv", "leave it out of the export")
        pool = float_network.Pool(self._name(node), kernel, stride)
        (self.open.pools if self.open else self.layers).append(pool)
        self._resized(node, self.shape[0], (kernel, kernel), stride, (0, 0))

    # What computes nothing

    def _Identity(self, node, attributes):
        pass

    def _Dropout(self, node, attributes):
        if len(node.input) > 2 and node.input[2] and np.any(self.graph.constants.get(node.input[2], True)):
            refuse(node, "training_mode is not false", "export the network for inference")

    def _Reshape(self, node, attributes):
        """To a vector for each image (or no change)."""
        known, (channels, rows, columns) = self.graph.shapes.get(node.output[0]), self.shape
        allowed = [(channels * rows * columns,), self.shape]
        if rows == columns == 1:
            allowed += [(channels, 1), *([()] if channels == 1 else [])]
        if known is None or known[:1] != (self.graph.batch,) or known[1:] not in allowed:
            gives = "a shape that is not known" if known is None else _times(known)
            refuse(node, f"gives {gives} from {_times((self.graph.batch, *self.shape))}",
                   "only Flatten to one vector an image is read")

    _Flatten = _Squeeze = _Unsqueeze = _Reshape

    # The end

    def _end(self, node, count, remedy):
        if not self.open or self.shape != (count, 1, 1):
            refuse(node, f"of {_times(self.shape)} numbers, not of {count} from a last layer without Relu",
                   remedy)
        self.end = node

    def _Softmax(self, node, attributes):
        axis = attributes.get("axis", 1 if self.graph.opset < 13 else -1)
        rank = len(self.graph.shapes.get(node.output[0], (0, 0)))
        if axis not in (1, 1 - rank):
            refuse(node, f"axis is {axis}", "it must be over the two classes")
        self._end(node, 2, "train it with two classes, absent and present")
        self.notes.append(f"{label(node)} is dropped: Berth's score is the softmax of the two numbers before it")

    _LogSoftmax = _Softmax

    def _Sigmoid(self, node, attributes):
        self._end(node, 1, "one output with Sigmoid, or two with Softmax")
        self.notes.append(f"{label(node)} is dropped: its input z becomes the scores 0 and z")

    def heads(self, output):
        """(weights [1, 2, 3 or 5, channels], bias) of the last layer, which has no Relu."""
        last = self.open
        if last is None:
            raise Unsupported(f"output '{output}' comes from a Relu or pooling; the last layer has to be a Gemm without "
                              "Relu")
        if last.pools or last.of_map[1:] != (1, 1) or last.weights.shape[2:] != (1, 1) or last.groups > 1:
            what = "is pooled" if last.pools else f"takes a map of {last.of_map[1]} x {last.of_map[2]}"
            refuse(last.node, f"is the last layer and {what}",
                   "Berth's last layer takes a vector: put a Gemm with Relu before it")
        return _padded(last.weights[:, :, 0, 0], 1), last.bias


def _joined(chains, outputs):
    """(name, weights, bias, chains in the order of their numbers) of the heads."""
    heads = [chain.heads(output) for chain, output in zip(chains, outputs)]
    order = sorted(range(len(chains)), key=lambda i: len(heads[i][1]))
    counts = [len(heads[i][1]) for i in order]
    if counts not in ([1], [2], [5], [1, 3], [2, 3]):
        named = ", ".join(f"'{outputs[i]}' of {len(heads[i][1])}" for i in range(len(chains)))
        raise Unsupported(f"outputs {named} numbers; Berth takes two scores (absent, present) or one, and three numbers of "
                          "centre and size beside them or as a second output: train or export it with these")
    if chains[order[-1]].end is not None and counts[-1] == 3:
        refuse(chains[order[-1]].end, "of centre and size", "these have to be plain numbers")
    weights, bias = ([heads[i][part] for i in order] for part in (0, 1))
    if counts[0] == 1:
        weights.insert(0, np.zeros_like(weights[0]))
        bias.insert(0, np.zeros(1))
        first = chains[order[0]]
        if first.end is None:
            first.notes.append(f"{label(first.open.node)}: its one output z is taken for a logit, the scores are 0 and z")
    name = " + ".join(chains[i].open.node.name or outputs[i] for i in order)
    return name, np.concatenate(weights), np.concatenate(bias), [chains[i] for i in order]


def read(path):
    """Imported; Unsupported without the file's name where a node is to blame."""
    graph = Graph(path)
    outputs = [info.name for info in graph.model.graph.output]
    if not 1 <= len(outputs) <= 2:
        raise Unsupported(f"{len(outputs)} outputs ({', '.join(outputs)}); Berth takes the scores, and centre and size: export "
                          "it with these alone")
    paths = [graph.path_to(output) for output in outputs]
    common = 0
    while all(common < len(p) and p[common] is paths[0][common] for p in paths):
        common += 1
    trunk = _Chain(graph)
    for node in paths[0][:common]:
        trunk.take(node)
    chains, depth = [trunk.branch() for _ in paths], len(trunk.layers)
    for chain, nodes in zip(chains, paths):
        for node in nodes[common:]:
            chain.take(node)
            if len(trunk.layers) > depth:
                refuse(node, "belongs to one of two outputs alone",
                       "only their last Gemm may be their own: train it with all other "
                       "layers in common")
    name, weights, bias, ordered = _joined(chains, outputs)
    name = trunk.unique(name)
    tensors = [(chain.tensor, len(chain.open.bias)) for chain in ordered]
    layers = [*trunk.layers, float_network.Heads(name, *(torch.from_numpy(a.astype(np.float32)) for a in (weights, bias)))]
    return Imported(graph, layers, trunk.notes, tensors)
