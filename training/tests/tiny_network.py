#!/usr/bin/env python3
"""Writes data/tiny.berthnet and data/tiny_network.txt: a network of every kind of layer with weights from a hash, and
what it says of eight windows from the same hash. Every backend's tests and the training's read these two files."""
import pathlib
import sys

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
from integer_network import IntegerNetwork, interpreted, logistic_table, norm_table  # noqa: E402
from model_file import (SIDE, Convolve, FullyConnected, Heads, LocalResponseNorm, MaxPool, Model, to_bytes)  # noqa: E402

SEEDS = range(8)
HEADER = """\
# What data/tiny.berthnet gives for eight windows of 256 x 256; written by training/tests/tiny_network.py.
#
# Window of a seed, u8, column i and row j, all in unsigned 32 bits:
#   x = seed * 65536 + j * 256 + i
#   x ^= x >> 16; x *= 0x7feb352d; x ^= x >> 15; x *= 0x846ca68b; x ^= x >> 16
#   tri(t) = |(t & 127) - 64|
#   pixel = ((tri((seed % 3 + 1) * i + 5 * seed) + tri(j + 11 * seed) + (x >> 26)) >> (seed & 3)) + 16 * seed
#
# A line a window: the raw heads (s32), then what the host makes of them (score in 1/32768, px in 1/65536).
# Comments of a seed: the sum of the activations after each layer, to find the first that differs.
#
# seed score0 score1 g0 g1 g2 score_q15 x_q16 y_q16 d_q16
"""


def hashed(x):
    x = np.asarray(x, np.uint32)
    x = (x ^ (x >> np.uint32(16))) * np.uint32(0x7feb352d)
    x = (x ^ (x >> np.uint32(15))) * np.uint32(0x846ca68b)
    return x ^ (x >> np.uint32(16))


def window(seed):
    j, i = np.mgrid[:SIDE, :SIDE]
    noise = (hashed(seed * 65536 + j * 256 + i) >> np.uint32(26)).astype(np.int64)
    columns, rows = abs(((seed % 3 + 1) * i + 5 * seed & 127) - 64), abs((j + 11 * seed & 127) - 64)
    pixel = ((columns + rows + noise) >> (seed & 3)) + 16 * seed
    assert pixel.max() <= 255
    return pixel.astype(np.uint8)


def drawn(stream, shape, least, most):
    """Integers least .. most from the hash; `stream` keeps one tensor's apart from another's."""
    count = int(np.prod(shape))
    values = hashed((stream + 1000) * 65536 + np.arange(count)).astype(np.int64)
    return (least + values % (most - least + 1)).reshape(shape)


def weighted(stream, shape, multiplier):
    """weights, bias, multiplier of a layer; the multipliers within a fifth of `multiplier`."""
    out = shape[0]
    return (drawn(stream, shape, -127, 127).astype(np.int8), drawn(stream + 1, (out,), -4000, 4000).astype(np.int32),
            drawn(stream + 2, (out,), multiplier * 4 // 5, multiplier * 6 // 5).astype(np.int32))


def tiny():
    layers = [
        Convolve(*weighted(0, (8, 4, 8, 2), 20000), shift=2, stride=(4, 1)),
        LocalResponseNorm(norm_table(1.0, 0.7, 1e-4)),
        MaxPool(3, 2),
        Convolve(*weighted(10, (16, 4, 5, 5), 20000), shift=2, stride=(3, 3), pad=(2, 2), groups=2),
        LocalResponseNorm(norm_table(1.0, 0.4, 2e-3)),
        MaxPool(3, 2),
        FullyConnected(*weighted(20, (16, 5, 5, 16), 20000), shift=2),
        FullyConnected(*weighted(30, (8, 1, 1, 16), 25000), shift=0),
        # The second score's bias brings the windows' scores to both sides of a half.
        Heads(drawn(40, (5, 8), -127, 127).astype(np.int8),
              (drawn(41, (5,), -9000, 9000) + [0, 8500, 0, 0, 0]).astype(np.int32)),
    ]
    outputs = [(1 << 29, 34), (1 << 30, 22), (3 << 28, 22), (1 << 30, 26)]
    return Model("tiny", "weights from a hash: for tests, finds nothing", 1, 0, layers, outputs, logistic_table())


def expectations(model):
    """The text of tiny_network.txt."""
    images = np.stack([window(seed) for seed in SEEDS])
    steps = list(IntegerNetwork(model).activations(images))
    found = interpreted(model, steps[-1].flatten(1).numpy())
    lines = []
    for k, seed in enumerate(SEEDS):
        sums = " ".join(str(int(step[k].sum())) for step in steps)
        values = [seed, *found.raw[k], found.score[k], found.x[k], found.y[k], found.d[k]]
        lines += [f"# seed {seed}: {sums}", " ".join(str(int(value)) for value in values)]
    return HEADER + "\n".join(lines) + "\n"


def main():
    model = tiny()
    (HERE / "data").mkdir(exist_ok=True)
    (HERE / "data/tiny.berthnet").write_bytes(to_bytes(model))
    (HERE / "data/tiny_network.txt").write_text(expectations(model))


if __name__ == "__main__":
    main()
