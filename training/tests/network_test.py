"""Tests of the integer network and its file; needs torch. Run: python3 -m unittest discover -s training/tests -p
'*_test.py'"""
import dataclasses
import pathlib
import struct
import sys
import tempfile
import unittest
import zlib

import numpy as np
import torch

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE)]
import integer_network as integer  # noqa: E402
import model_file  # noqa: E402
import slow_network as slow  # noqa: E402
import tiny_network  # noqa: E402
from model_file import (Convolve, FullyConnected, Heads, LocalResponseNorm, MaxPool, Model, ModelError)  # noqa: E402

torch.set_num_threads(1)


def planes(x):
    """[channel][row][column] of the first of a batch."""
    return x[0].tolist()


def run_layer(layer, x, first=False):
    return integer._runnable(layer, "cpu", 128 if first else 127)(torch.tensor([x], dtype=torch.int32))


class TinyNetwork(unittest.TestCase):
    def test_is_what_its_script_writes(self):
        data = HERE / "data"
        self.assertEqual((data / "tiny.berthnet").read_bytes(), model_file.to_bytes(tiny_network.tiny()))
        self.assertEqual((data / "tiny_network.txt").read_text(),
                         tiny_network.expectations(model_file.read(data / "tiny.berthnet")))

    def test_has_the_bits_of_plain_python_after_every_layer(self):
        model = tiny_network.tiny()
        image = tiny_network.window(5)
        fast = integer.IntegerNetwork(model).activations(image[None])
        x = slow.fold(slow.normalise(image.tolist()))
        for layer in model.layers:
            x = slow.step(layer, x)
            self.assertEqual(x, planes(next(fast)), layer.title)
        heads = [plane[0][0] for plane in x]
        found = integer.interpreted(model, [heads])
        score, *geometry = model.outputs
        self.assertEqual(found.score[0], slow.score_q15(*heads[:2], *score, model.logistic))
        self.assertEqual(found.x[0], 255 * 2**15 + slow.multiply(heads[2], *geometry[0]))
        self.assertEqual(found.y[0], 255 * 2**15 + slow.multiply(heads[3], *geometry[1]))
        self.assertEqual(found.d[0], slow.size_q16(heads[4], *geometry[2]))

    def test_uses_what_it_is_there_to_test(self):
        """Both sides of a half, saturated and silent activations, both parts of the table, clamped accumulators."""
        model = tiny_network.tiny()
        images = np.stack([tiny_network.window(seed) for seed in tiny_network.SEEDS])
        steps = [step.numpy() for step in integer.IntegerNetwork(model).activations(images)]
        scores = integer.interpreted(model, steps[-1].reshape(8, -1)).score
        self.assertTrue(scores.min() < 2**14 < scores.max())
        for layer, step in zip(model.layers[:-1], steps):
            self.assertEqual(step.min(), 0, layer.title)
        for k in (0, 1, 3, 6, 7):
            self.assertEqual(steps[k].max(), 127, model.layers[k].title)
        for k in (0, 3):
            totals = sum(np.pad(steps[k] ** 2 >> 1, ((0, 0), (2, 2), (0, 0), (0, 0)))[:, c:c + steps[k].shape[1]]
                         for c in range(5))
            self.assertTrue(totals.min() < 2048 < totals.max())


class Layers(unittest.TestCase):
    def setUp(self):
        self.random = np.random.default_rng(11)

    def weighted(self, shape, extreme=False):
        out = shape[0]
        weights = self.random.choice([-127, 127], shape) if extreme else self.random.integers(-127, 128, shape)
        return (weights.astype(np.int8), self.random.integers(-9000, 9000, out).astype(np.int32),
                self.random.integers(0, 2**15, out).astype(np.int32))

    def check(self, layer, shape, first=False):
        for values in ((-128, 128) if first else (0, 128), (127, 128)):
            x = self.random.integers(*values, shape).tolist()
            self.assertEqual(planes(run_layer(layer, x, first)), slow.step(layer, x), layer)

    def test_convolutions_have_the_bits_of_the_definition(self):
        for extreme in (False, True):
            self.check(Convolve(*self.weighted((8, 4, 5, 3), extreme), 3, (4, 1)), (4, 13, 7), first=True)
            self.check(Convolve(*self.weighted((8, 4, 3, 3), extreme), 0, (1, 1), (1, 1), 2), (8, 5, 6))
            self.check(Convolve(*self.weighted((4, 8, 5, 5), extreme), 7, (2, 3), (2, 0), 1), (8, 9, 8))

    def test_a_sum_past_the_exact_floats_is_still_exact(self):
        """64 x 25 products of 127 x 127 are 25.8 million, more than 2^24: every last bit must be there."""
        weights = np.full((4, 64, 5, 5), 127, np.int8)
        weights[1] = -127
        weights[2, ::2] = -127
        weights[3, 0, 0, 0] = 126
        layer = Convolve(weights, np.array([1, 0, 0, -1], np.int32), np.full(4, 32767, np.int32), 12)
        x = np.full((64, 5, 5), 127)
        x[7, 3, 2] = 126
        self.assertEqual(planes(run_layer(layer, x.tolist())), slow.step(layer, x.tolist()))
        sums = integer._Products(weights, (1, 1), (0, 0), 1, 127, "cpu")(torch.tensor(x)[None])
        self.assertEqual(sums.flatten().tolist(), [r[0][0] for r in slow.accumulate(x.tolist(), weights.tolist(), (1, 1),
                                                                                    (0, 0), 1)])

    def test_requantisation_clamps_and_rounds_as_written(self):
        sums = [-2**30, -1, 0, 1, 127, 128, 32767, 32768, 40000, 2**20, 2**30]
        for shift in (0, 1, 7, 15, 20):
            for m in (0, 1, 128, 16384, 32767):
                x = torch.tensor(sums, dtype=torch.int32)
                got = integer.requantised(x, torch.tensor(-3), m, shift)
                self.assertEqual(got.tolist(), [slow.requantise(s, -3, m, shift) for s in sums], (shift, m))

    def test_response_norm_has_the_bits_of_the_definition(self):
        for sigma_in, sigma_out, alpha in ((1, 1, 1e-4), (0.05, 0.04, 2e-2), (1, 0.3, 1), (0.001, 0.01, 1e-4)):
            layer = LocalResponseNorm(integer.norm_table(sigma_in, sigma_out, alpha))
            x = self.random.integers(0, 128, (9, 6, 7))
            x[:, 0] = 127
            x[:, 1] = 0
            x[:, 2] //= 16
            self.assertEqual(planes(run_layer(layer, x.tolist())), slow.step(layer, x.tolist()))
        uneven = LocalResponseNorm(self.random.integers(0, 2**16, 104).astype(np.int32))
        self.assertEqual(planes(run_layer(uneven, x.tolist())), slow.step(uneven, x.tolist()))

    def test_pooling_and_fully_connected_have_the_bits_of_the_definition(self):
        for kernel, stride, shape in ((3, 2, (4, 7, 8)), (2, 2, (4, 5, 5)), (3, 1, (8, 3, 4))):
            self.check(MaxPool(kernel, stride), shape)
        self.check(FullyConnected(*self.weighted((8, 3, 2, 4)), 5), (4, 3, 2))
        self.check(FullyConnected(*self.weighted((8, 3, 2, 4)), 5), (4, 5, 4))  # a grid of positions
        weights, bias, _ = self.weighted((5, 8))
        self.check(Heads(weights, bias), (8, 1, 1))


class FixedPoint(unittest.TestCase):
    def test_the_normalisation_table_is_the_formula_at_its_knots(self):
        sigma_in, sigma_out, alpha = 0.043, 0.05, 3e-3
        table = integer.norm_table(sigma_in, sigma_out, alpha)
        for s, t in [(0, table[0]), (32, table[1]), (2016, table[63]), (2048, table[64]), (3072, table[65]),
                     (40960, table[102])]:
            exact = 2**14 * sigma_in / sigma_out * (1 + alpha / 5 * 2 * s * sigma_in**2) ** -0.75
            self.assertLessEqual(abs(t - exact), 0.5)
        between = integer.interpolated(table)
        s = np.arange(40321)
        exact = 2**14 * sigma_in / sigma_out * (1 + alpha / 5 * 2 * s * sigma_in**2) ** -0.75
        self.assertLess(np.abs(between - exact).max(), 2)

    def test_the_logistic_table_is_the_formula(self):
        table = integer.logistic_table()
        self.assertEqual((table[2048], table[0], table[4095]), (16384, 11, 32757))
        self.assertTrue((np.diff(table.astype(int)) >= 0).all())
        self.assertLessEqual(np.abs(table / 2**15 - 1 / (1 + np.exp(-(np.arange(4096) - 2048) / 256))).max(), 2**-16)

    def test_the_constants_of_the_exponential_are_roots_of_two(self):
        self.assertEqual(list(integer.EXP2_Q30), [slow.root_of_two_q30(i) for i in range(1, 17)])

    def test_sizes_are_the_exponential(self):
        e = np.concatenate([np.arange(-200000, 200001, 37), [-2**31, 2**31, 196608, -196608, 0, 65536, -1]])
        d = integer.exp2_q16(e)
        exact = 64 * 2.0**16 * 2.0 ** (np.clip(e, -3 << 16, 3 << 16) / 65536)
        self.assertLess(np.abs(d - exact).max(), 1.1)
        self.assertEqual(d[-6:].tolist(), [512 << 16, 512 << 16, 8 << 16, 64 << 16, 128 << 16, 4194259])
        for value in e[::97]:
            self.assertEqual(integer.exp2_q16(np.array([value]))[0], slow.size_q16(int(value) * 2, 1, 1))

    def test_multiplication_rounds_half_up(self):
        v = np.array([-5, -3, -2, -1, 0, 1, 2, 3, 5, 2**31 - 1, -2**31])
        self.assertEqual(integer.multiplied(v, 3, 1).tolist(), [slow.multiply(int(a), 3, 1) for a in v])
        self.assertEqual(integer.multiplied(v, 2**31 - 1, 40).tolist(), [slow.multiply(int(a), 2**31 - 1, 40) for a in v])


class Files(unittest.TestCase):
    def setUp(self):
        self.model = tiny_network.tiny()
        self.data = model_file.to_bytes(self.model)

    def refused(self, data, *words):
        with self.assertRaises(ModelError) as caught:
            model_file.from_bytes(data)
        for word in words:
            self.assertIn(word, str(caught.exception))

    def sealed(self, body):
        """A file with this body, its size and CRC right."""
        data = b"BERTHNET" + struct.pack("<II", 1, len(body) + 20) + body
        return data + struct.pack("<I", zlib.crc32(data))

    def with_integer(self, at, value):
        body = bytearray(self.data[16:-4])
        struct.pack_into("<i", body, at, value)
        return self.sealed(bytes(body))

    def test_what_berths_reader_refuses_is_not_written(self):
        wide = self.model.layers[:1] + [MaxPool(1, 65)] + self.model.layers[1:]
        with self.assertRaisesRegex(ModelError, "layer 2 .*stride of 65, at most 64"):
            model_file.shapes(dataclasses.replace(self.model, layers=wide))
        many = self.model.layers[:2] + 62 * self.model.layers[1:2] + self.model.layers[2:]
        with self.assertRaisesRegex(ModelError, "at most 64"):
            model_file.shapes(dataclasses.replace(self.model, layers=many))
        huge = Convolve(np.zeros((1028, 4, 1, 1), np.int8), np.zeros(1028, np.int32), np.zeros(1028, np.int32), 0)
        with self.assertRaisesRegex(ModelError, r"layer 1 .*256 x 64 x 1028 activations"):
            model_file.shapes(dataclasses.replace(self.model, layers=[huge, *self.model.layers[-1:]]))

    def test_come_back_as_they_were_written(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "net.berthnet"
            self.assertEqual(model_file.write(self.model, path), len(self.data))
            again = model_file.read(path)
        self.assertEqual(model_file.to_bytes(again), self.data)
        self.assertEqual((again.name, again.notes, again.outputs), (self.model.name, self.model.notes, self.model.outputs))
        for a, b in zip(again.layers, self.model.layers):
            self.assertEqual(vars(a).keys(), vars(b).keys())
            for name in vars(a):
                np.testing.assert_array_equal(vars(a)[name], vars(b)[name])

    def test_have_the_fields_where_the_document_says(self):
        name, notes = self.model.name.encode(), self.model.notes.encode()
        at = 16 + 8 + len(name) + len(notes)
        self.assertEqual(self.data[:8], b"BERTHNET")
        self.assertEqual(struct.unpack_from("<II", self.data, 8), (1, len(self.data)))
        self.assertEqual(struct.unpack_from("<4i", self.data, at), (256, 1, 0, 9))
        self.assertEqual(struct.unpack_from("<11i", self.data, at + 16), (1, 4, 8, 8, 2, 4, 1, 0, 0, 1, 2))
        self.assertEqual(struct.unpack_from("<4b", self.data, at + 60), tuple(self.model.layers[0].weights.flat[:4]))
        self.assertEqual(struct.unpack_from("<4096H", self.data, len(self.data) - 4 - 8192), tuple(self.model.logistic))
        self.assertEqual(struct.unpack_from("<8i", self.data, len(self.data) - 4 - 8192 - 32),
                         tuple(value for output in self.model.outputs for value in output))

    def test_that_are_cut_off_or_changed_are_refused(self):
        for length in [*range(0, 64, 3), 1000, len(self.data) - 1]:
            self.refused(self.data[:length])
        self.refused(self.data + b"x", "header says")
        for at in range(16, len(self.data), 997):
            changed = bytearray(self.data)
            changed[at] ^= 16
            self.refused(bytes(changed), "CRC-32")
        self.refused(b"ONNX" + self.data[4:], "BERTHNET")
        self.refused(self.data[:8] + struct.pack("<I", 2) + self.data[12:], "version 2", "update")

    def test_whose_body_is_cut_off_are_refused_at_any_length(self):
        body = self.data[16:-4]
        for length in range(0, len(body), 211):
            self.refused(self.sealed(body[:length]))
        self.refused(self.sealed(body + b"1234"), "4 bytes follow")

    def test_with_absurd_numbers_are_refused_by_name(self):
        at = 8 + len(self.model.name) + len(self.model.notes)
        for offset, value, word in ((0, 64, "side"), (0, -256, "side"), (4, 2, "normalise"), (8, 999, "mean"),
                                    (12, 0, "layers"), (12, 2**31 - 1, "layers"), (16, 9, "kind 9"), (20, 8, ""),
                                    (20, -4, "in_channels"), (24, 2**30, "out_channels"), (24, 2**20, "weights"),
                                    (24, 0, ""), (28, 0, ""), (36, 0, "stride"), (44, 8, "pads"), (52, 0, "groups"),
                                    (52, 3, "groups"), (56, 31, "shift"), (56, -1, "shift")):
            self.refused(self.with_integer(at + offset, value), word)
        self.refused(self.with_integer(0, 2**31 - 1), "name")

    def test_no_single_changed_integer_gets_past_or_breaks_the_reader(self):
        random = np.random.default_rng(2)
        for _ in range(400):
            value = int(random.choice([0, -1, 1, 2**31 - 1, -2**31, int(random.integers(-2**31, 2**31))]))
            data = self.with_integer(int(random.integers(0, 1200)), value)
            try:
                model = model_file.from_bytes(data)
            except ModelError:
                continue
            self.assertEqual(model_file.to_bytes(model), data)

    def broken(self, number, word, **changes):
        model = tiny_network.tiny()
        for name, value in changes.items():
            setattr(model.layers[number - 1], name, value)
        with self.assertRaises(ModelError) as caught:
            model_file.to_bytes(model)
        self.assertIn(f"layer {number} ", str(caught.exception))
        self.assertIn(word, str(caught.exception))

    def test_that_do_not_fit_together_are_refused_by_layer(self):
        layers = self.model.layers
        self.broken(1, "overflow", bias=np.full(8, 2**31 - 1, np.int32))
        self.broken(1, "M is", multiplier=np.full(8, 32768, np.int32))
        self.broken(1, "-128", weights=np.full((8, 4, 8, 2), -128, np.int8))
        self.broken(2, "table", table=np.full(104, 65536))
        self.broken(3, "kernel", kernel=64)
        self.broken(4, "in_channels", groups=1)
        self.broken(4, "shift", shift=-1)
        self.broken(7, "in_channels", weights=layers[6].weights[:, :, :, :12])
        self.broken(7, "larger than its input", weights=layers[6].weights.repeat(2, 1))
        self.broken(9, "in_channels", weights=layers[8].weights[:, :4])
        self.model.layers = layers[:-1]
        with self.assertRaisesRegex(ModelError, "not heads"):
            model_file.to_bytes(self.model)
        self.model.layers = [layers[1], *layers]
        with self.assertRaisesRegex(ModelError, "before any convolution"):
            model_file.to_bytes(self.model)

    def test_errors_name_the_file(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "bad.berthnet"
            path.write_bytes(self.data[:100])
            with self.assertRaisesRegex(ModelError, "bad.berthnet: .*fetch"):
                model_file.read(path)


if __name__ == "__main__":
    unittest.main()
