"""`.berthnet`: an integer network as a file (docs/network-arithmetic.md). Reads, writes, and refuses what does not fit
together, naming the file, the layer, the field and what to do."""
import math
import pathlib
import struct
import zlib
from dataclasses import dataclass

import numpy as np

MAGIC = b"BERTHNET"
VERSION = 1
SIDE = 256
LARGEST_SUM = 2**31 - 1
LARGEST_KERNEL, MOST_CHANNELS, LARGEST_TENSOR, MOST_LAYERS = 64, 16384, 1 << 24, 64  # as Berth's reader has them
OUTPUTS = ("score", "x", "y", "d")
DAMAGED = "the file is damaged: fetch or export it again"


class ModelError(ValueError):
    """What is wrong with a model, where, and what to do about it."""


@dataclass
class Convolve:
    """weights s8[out, in / groups, kernel_height, kernel_width], bias and multiplier s32[out]; strides and pads (y, x).
    In the first layer a column is a word of four pixels, its pixels the channels."""
    weights: np.ndarray
    bias: np.ndarray
    multiplier: np.ndarray
    shift: int
    stride: tuple = (1, 1)
    pad: tuple = (0, 0)
    groups: int = 1

    kind, title = 1, "convolve"


@dataclass
class LocalResponseNorm:
    """table s32[104]: see docs/network-arithmetic.md for its knots."""
    table: np.ndarray

    kind, title = 2, "local_response_norm"


@dataclass
class MaxPool:
    kernel: int
    stride: int

    kind, title = 3, "max_pool"


@dataclass
class FullyConnected:
    """weights s8[out, rows, columns, channels], bias and multiplier s32[out]."""
    weights: np.ndarray
    bias: np.ndarray
    multiplier: np.ndarray
    shift: int

    kind, title = 4, "fully_connected"


@dataclass
class Heads:
    """weights s8[outputs, channels], bias s32[outputs]: two scores (absent, present), then three of geometry or none."""
    weights: np.ndarray
    bias: np.ndarray

    kind, title = 5, "heads"


@dataclass
class Model:
    """normalise 1: each window's own mean and contrast; 0: `mean` is taken off. outputs: (multiplier, shift) of score,
    x, y and d. logistic u16[4096]: of z = -2048 .. 2047 in 1/256, in Q15."""
    name: str
    notes: str
    normalise: int
    mean: int
    layers: list
    outputs: list
    logistic: np.ndarray
    side: int = SIDE


def largest_sum(weights, bias, shift, largest_input):
    """Per output channel: no accumulator, partial or with bias and rounding, is larger in magnitude. Python integers."""
    rounding = 1 << (shift - 1) if shift else 0
    totals = np.abs(weights.astype(np.int64)).reshape(len(weights), -1).sum(1)
    return [int(total) * largest_input + abs(int(b)) + rounding for total, b in zip(totals, bias)]


def _require(true, what):
    if not true:
        raise ModelError(what)


def _check_weights(layer, shift, largest_input):
    _require(layer.weights.dtype == np.int8, "its weights are not s8")
    _require(layer.weights.min() > -128, "a weight is -128, must be -127 to 127; export the model again")
    sums = largest_sum(layer.weights, layer.bias, shift, largest_input)
    worst = int(np.argmax(sums))
    _require(sums[worst] <= LARGEST_SUM, f"output channel {worst} can overflow 32 bits ({sums[worst]}); export the model "
             "again with a smaller bias")


def _check_requantisation(layer):
    _require(layer.weights.size > 0, f"it has no weights; {DAMAGED}")
    _require(0 <= layer.shift <= 30, f"shift is {layer.shift}, must be 0 to 30; {DAMAGED}")
    for name, values in (("bias", layer.bias), ("M", layer.multiplier)):
        _require(len(values) == len(layer.weights), f"{len(values)} values of {name} for {len(layer.weights)} channels")
    _require(0 <= min(layer.multiplier) and max(layer.multiplier) < 2**15,
             f"M is {min(layer.multiplier)} to {max(layer.multiplier)}, must be 0 to 32767; {DAMAGED}")


def _convolve_shape(layer, shape, first):
    height, width, channels = shape
    out, group_channels, kernel_height, kernel_width = layer.weights.shape
    _require(group_channels * layer.groups == channels,
             f"in_channels is {group_channels * layer.groups}, but there are {channels}")
    _require(group_channels % 4 == 0 and out % (4 * layer.groups) == 0,
             f"{out} output channels, {group_channels} input channels a group: must be multiples of 4, and share out "
             f"evenly over {layer.groups} groups")
    _require(min(layer.stride) >= 1 and min(layer.pad) >= 0 and layer.pad[0] < kernel_height and
             layer.pad[1] < kernel_width, f"strides {layer.stride}, pads {layer.pad}: strides are at least 1, pads "
             "smaller than the kernel")
    rows, columns = height + 2 * layer.pad[0] - kernel_height, width + 2 * layer.pad[1] - kernel_width
    _require(rows >= 0 and columns >= 0, f"its kernel of {kernel_height} x {kernel_width} is larger than its input of "
             f"{height} x {width}")
    _check_requantisation(layer)
    _check_weights(layer, layer.shift, 128 if first else 127)
    return rows // layer.stride[0] + 1, columns // layer.stride[1] + 1, out


def _norm_shape(layer, shape, first):
    _require(not first, "comes before any convolution; it needs activations of 0 to 127")
    _require(len(layer.table) == 104, f"{len(layer.table)} values of the table, must be 104")
    _require(0 <= min(layer.table) and max(layer.table) < 2**16,
             f"table values {min(layer.table)} to {max(layer.table)}, must be 0 to 65535; {DAMAGED}")
    return shape


def _pool_shape(layer, shape, first):
    height, width, channels = shape
    _require(not first, "comes before any convolution")
    _require(layer.stride >= 1 and 1 <= layer.kernel <= min(height, width),
             f"kernel {layer.kernel}, stride {layer.stride} on an input of {height} x {width}")
    return (height - layer.kernel) // layer.stride + 1, (width - layer.kernel) // layer.stride + 1, channels


def _connected_shape(layer, shape, first):
    height, width, channels = shape
    out, rows, columns, in_channels = layer.weights.shape
    _require(in_channels == channels, f"in_channels is {in_channels}, but there are {channels}")
    _require(out % 4 == 0, f"{out} output channels, must be a multiple of 4")
    _require(rows <= height and columns <= width, f"{rows} x {columns} is larger than its input of {height} x {width}")
    _check_requantisation(layer)
    _check_weights(layer, layer.shift, 128 if first else 127)
    return height - rows + 1, width - columns + 1, out


def _heads_shape(layer, shape, first):
    _require(not first, "comes before any layer")
    out, channels = layer.weights.shape
    _require(channels == shape[2], f"in_channels is {channels}, but there are {shape[2]}")
    _require(out in (2, 5), f"{out} outputs, must be 2 scores and 3 or 0 of geometry")
    _require(len(layer.bias) == out, f"{len(layer.bias)} values of bias for {out} outputs")
    _check_weights(layer, 0, 127)
    return shape[0], shape[1], out


def _check_limits(layer, shape):
    height, width, channels = shape
    _require(channels <= MOST_CHANNELS, f"{channels} channels, at most {MOST_CHANNELS} are read")
    _require(height * width * ((channels + 3) // 4 * 4) <= LARGEST_TENSOR,
             f"gives {height} x {width} x {channels} activations, at most {LARGEST_TENSOR} are held")
    if isinstance(layer, Convolve):
        sizes = layer.weights.shape[2:] + tuple(layer.stride)
    elif isinstance(layer, FullyConnected):
        sizes = layer.weights.shape[1:3]
    else:
        sizes = (layer.kernel, layer.stride) if isinstance(layer, MaxPool) else (1,)
    _require(max(sizes) <= LARGEST_KERNEL, f"a kernel or stride of {max(sizes)}, at most {LARGEST_KERNEL} is read")


_SHAPE_AFTER = {Convolve: _convolve_shape, LocalResponseNorm: _norm_shape, MaxPool: _pool_shape,
                FullyConnected: _connected_shape, Heads: _heads_shape}


def shapes(model, names=None):
    """(height, width, channels) after each layer for one window; ModelError if the model does not fit together, by `names`
    of the layers where they are given."""
    _require(model.side == SIDE, f"input side is {model.side}, must be {SIDE}; {DAMAGED}")
    _require(model.normalise in (0, 1), f"normalise is {model.normalise}, must be 0 or 1; {DAMAGED}")
    _require(0 <= model.mean <= 255, f"mean is {model.mean}, must be 0 to 255; {DAMAGED}")
    _require(len(model.layers) <= MOST_LAYERS, f"{len(model.layers)} layers, at most {MOST_LAYERS} are read")
    _require(model.layers and isinstance(model.layers[-1], Heads), "its last layer is not heads; export the model again")
    shape, out = (model.side, model.side // 4, 4), []
    for i, layer in enumerate(model.layers):
        try:
            _require(not isinstance(layer, Heads) or i == len(model.layers) - 1, "comes before the last layer")
            shape = _SHAPE_AFTER[type(layer)](layer, shape, i == 0)
            _check_limits(layer, shape)
        except ModelError as error:
            raise ModelError(f"{names[i] if names else f'layer {i + 1}'} ({layer.title}): {error}") from None
        out.append(shape)
    _require(out[-1][:2] == (1, 1), f"its heads come out {out[-1][0]} x {out[-1][1]} times for one window, must be once")
    _require(len(model.outputs) == 4, f"{len(model.outputs)} output scales, must be 4")
    for name, (multiplier, shift) in zip(OUTPUTS, model.outputs):
        _require(0 <= multiplier <= LARGEST_SUM and 1 <= shift <= 62,
                 f"output {name}: M {multiplier}, k {shift}, must be 0 to 2^31 - 1 and 1 to 62; {DAMAGED}")
    _require(len(model.logistic) == 4096 and max(model.logistic) <= 2**15,
             f"its logistic table is not 4096 values of 0 to 32768; {DAMAGED}")
    return out


class _Reader:
    def __init__(self, data):
        self.data, self.at = data, 0

    def bytes(self, count, field):
        _require(0 <= count <= len(self.data) - self.at, f"{field}: {count} bytes at byte {self.at + 20}, but "
                 f"{len(self.data) - self.at} are left; {DAMAGED}")
        self.at += count
        return self.data[self.at - count:self.at]

    def array(self, dtype, shape, field):
        dtype = np.dtype(dtype)
        _require(min(shape) >= 0, f"{field}: a size below 0; {DAMAGED}")
        return np.frombuffer(self.bytes(math.prod(shape) * dtype.itemsize, field), dtype).reshape(shape)

    def integer(self, field, least=-2**31, most=2**31 - 1):
        value = int(self.array("<i4", (1,), field)[0])
        _require(least <= value <= most, f"{field} is {value}, must be {least} to {most}; {DAMAGED}")
        return value

    def integers(self, fields, **limits):
        return [self.integer(field, **limits) for field in fields.split()]

    def text(self, field):
        (length,) = struct.unpack("<I", self.bytes(4, f"{field}'s length"))
        try:
            return self.bytes(length, field).decode("utf-8")
        except UnicodeDecodeError as error:
            raise ModelError(f"{field} is not UTF-8 ({error}); {DAMAGED}") from None


_SIZE = {"least": 0, "most": 1 << 20}


def _read_convolve(reader):
    inputs, out, rows, columns, *rest = reader.integers(
        "in_channels out_channels kernel_height kernel_width stride_y stride_x pad_y pad_x groups shift", **_SIZE)
    stride_y, stride_x, pad_y, pad_x, groups, shift = rest
    _require(groups >= 1 and inputs % groups == 0, f"{inputs} in_channels in {groups} groups; {DAMAGED}")
    return Convolve(reader.array("<i1", (out, inputs // groups, rows, columns), "weights"),
                    reader.array("<i4", (out,), "bias"), reader.array("<i4", (out,), "M"), shift, (stride_y, stride_x),
                    (pad_y, pad_x), groups)


def _read_connected(reader):
    inputs, rows, columns, out, shift = reader.integers("in_channels rows columns out_channels shift", **_SIZE)
    return FullyConnected(reader.array("<i1", (out, rows, columns, inputs), "weights"),
                          reader.array("<i4", (out,), "bias"), reader.array("<i4", (out,), "M"), shift)


def _read_heads(reader):
    inputs, scores, geometry = reader.integers("in_channels score_outputs geometry_outputs", **_SIZE)
    _require(scores == 2 and geometry in (0, 3), f"{scores} scores and {geometry} numbers of geometry, must be 2 and 3 or "
             f"0; {DAMAGED}")
    return Heads(reader.array("<i1", (scores + geometry, inputs), "weights"),
                 reader.array("<i4", (scores + geometry,), "bias"))


_READ = {1: _read_convolve, 2: lambda reader: LocalResponseNorm(reader.array("<i4", (104,), "table")),
         3: lambda reader: MaxPool(*reader.integers("kernel stride", **_SIZE)), 4: _read_connected, 5: _read_heads}


def _body(data):
    """The bytes between header and CRC."""
    _require(data[:8] == MAGIC[:len(data[:8])], "is no Berth network (it does not start with BERTHNET)")
    _require(len(data) >= 20, f"is cut off after {len(data)} bytes; fetch or export it again")
    version, size = struct.unpack_from("<II", data, 8)
    _require(version == VERSION, f"has version {version}, this program reads {VERSION}: export the model again, or update "
             "Berth")
    _require(size == len(data), f"has {len(data)} bytes, its header says {size}; fetch or export it again")
    (stored,) = struct.unpack_from("<I", data, size - 4)
    computed = zlib.crc32(data[:-4])
    _require(stored == computed, f"CRC-32 is {computed:08x}, the file says {stored:08x}; {DAMAGED}")
    return data[16:-4]


def from_bytes(data):
    """A checked Model; ModelError without the file's name."""
    reader = _Reader(_body(bytes(data)))
    name, notes = reader.text("name"), reader.text("notes")
    side, normalise, mean, count = reader.integers("side normalise mean layers")
    _require(1 <= count <= MOST_LAYERS, f"{count} layers, must be 1 to {MOST_LAYERS}; {DAMAGED}")
    layers = []
    for i in range(count):
        kind = reader.integer(f"layer {i + 1}: kind")
        _require(kind in _READ, f"layer {i + 1}: kind {kind} is unknown (1 to 5 are known): export the model again, or "
                 "update Berth")
        try:
            layers.append(_READ[kind](reader))
        except ModelError as error:
            raise ModelError(f"layer {i + 1}: {error}") from None
    outputs = [tuple(reader.integers(f"{name}.M {name}.k")) for name in OUTPUTS]
    logistic = reader.array("<u2", (4096,), "logistic table")
    _require(reader.at == len(reader.data), f"{len(reader.data) - reader.at} bytes follow the logistic table; {DAMAGED}")
    model = Model(name, notes, normalise, mean, layers, outputs, logistic, side)
    shapes(model)
    return model


def _integers(*values):
    return np.array(values, "<i4").tobytes()


def _layer_bytes(layer):
    out = _integers(layer.kind)
    if isinstance(layer, Convolve):
        count, inputs, rows, columns = layer.weights.shape
        out += _integers(inputs * layer.groups, count, rows, columns, *layer.stride, *layer.pad, layer.groups, layer.shift)
    elif isinstance(layer, LocalResponseNorm):
        return out + np.asarray(layer.table, "<i4").tobytes()
    elif isinstance(layer, MaxPool):
        return out + _integers(layer.kernel, layer.stride)
    elif isinstance(layer, FullyConnected):
        count, rows, columns, inputs = layer.weights.shape
        out += _integers(inputs, rows, columns, count, layer.shift)
    else:
        out += _integers(layer.weights.shape[1], 2, len(layer.weights) - 2)
    out += np.ascontiguousarray(layer.weights, "<i1").tobytes() + np.asarray(layer.bias, "<i4").tobytes()
    return out if isinstance(layer, Heads) else out + np.asarray(layer.multiplier, "<i4").tobytes()


def to_bytes(model):
    shapes(model)
    body = b"".join(struct.pack("<I", len(text)) + text for text in (model.name.encode(), model.notes.encode()))
    body += _integers(model.side, model.normalise, model.mean, len(model.layers))
    body += b"".join(_layer_bytes(layer) for layer in model.layers)
    body += b"".join(_integers(*output) for output in model.outputs) + np.asarray(model.logistic, "<u2").tobytes()
    data = MAGIC + struct.pack("<II", VERSION, len(body) + 20) + body
    return data + struct.pack("<I", zlib.crc32(data))


def read(path):
    try:
        return from_bytes(pathlib.Path(path).read_bytes())
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None


def write(model, path):
    """The file's size in bytes."""
    try:
        return pathlib.Path(path).write_bytes(to_bytes(model))
    except ModelError as error:
        raise ModelError(f"{path}: not written: {error}") from None
