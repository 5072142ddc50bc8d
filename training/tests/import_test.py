"""Tests of import_onnx.py and what it uses; needs torch and onnx. Run: python3 -m unittest discover -s training/tests
-p '*_test.py'"""
import contextlib
import io
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper
from PIL import Image
from torch import nn

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE)]
import calibration_images  # noqa: E402
import import_onnx  # noqa: E402
import model_file  # noqa: E402
import onnx_network  # noqa: E402
import quantisation  # noqa: E402
import slow_network as slow  # noqa: E402
from float_network import FloatNetwork  # noqa: E402
from integer_network import IntegerNetwork  # noqa: E402
from onnx_export import Export, lively, trunk  # noqa: E402
from onnx_graph import Unsupported  # noqa: E402
from tiny_network import window  # noqa: E402

torch.set_num_threads(1)


IMAGES = np.stack([window(seed) for seed in range(8)])


class Case(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.path = pathlib.Path(self.temporary.name) / "net.onnx"

    def read(self, proto):
        onnx.save(proto, self.path)
        return onnx_network.read(self.path)

    def network(self, proto, normalise=True, mean=0.0, scale=1 / 64):
        return FloatNetwork(self.read(proto).layers, normalise, mean, scale, "net")

    def quantised(self, network):
        ranges = quantisation.Ranges(network, IMAGES)
        steps = [layer.name for layer in network.layers[:-1] if not layer.name.startswith("maxpool")]
        out = quantisation.Builder(network, ranges).build({name: ranges.sigma(name, "max") for name in steps})
        quantisation.correct_biases(out, ranges)
        return out

    def refused(self, proto, *words):
        with self.assertRaises(Unsupported) as caught:
            self.read(proto)
        for word in words:
            self.assertIn(word, str(caught.exception))


class Imports(Case):
    def check(self, module, proto, normalise=True, mean=0.0, scale=1 / 64):
        """Floats are torch's, integers near them; returns both outputs."""
        network = self.network(proto, normalise, mean, scale)
        with torch.no_grad():
            wanted = module(network.input(IMAGES)).double().numpy()
        got = network.outputs(IMAGES)
        np.testing.assert_allclose(got, wanted, atol=1e-4 * np.abs(wanted).max())
        q = self.quantised(network)
        noise = quantisation.signal_to_noise(q, network, IMAGES)
        self.assertGreater(min(so_far for so_far, _ in noise.values()), 22)
        integers = quantisation.dequantised(q, IntegerNetwork(q.model).found(IMAGES).raw)
        return wanted, integers, q

    def test_of_all_kinds_of_layers_are_what_torch_computes(self):
        layers = lively([*trunk(), nn.Linear(18, 2)])
        export = Export()
        proto = export.output(export.sequence([*layers, nn.Softmax(1)])).proto()
        wanted, integers, q = self.check(layers, proto)
        margin = wanted[:, 1] - wanted[:, 0]
        self.assertGreater(np.ptp(margin), 0.5)
        middle = np.median(margin)  # a threshold that parts the images: decisions are the same but at its edge
        clear = np.abs(margin - middle) > 0.05 * np.ptp(margin)
        self.assertGreater(clear.sum(), 4)
        np.testing.assert_array_equal((integers[:, 1] - integers[:, 0] > middle)[clear], (margin > middle)[clear])
        self.assertEqual(model_file.shapes(q.model)[-3:], [(2, 2, 12), (1, 1, 20), (1, 1, 2)])
        self.assertEqual([layer.title for layer in q.model.layers],
                         ["convolve", "local_response_norm", "max_pool", "convolve", "max_pool", "convolve", "max_pool",
                          "local_response_norm", "fully_connected", "heads"])

    def test_have_the_bits_of_plain_python(self):
        """The kernel that begins between two words of pixels, and norms of other exponents, in the slow arithmetic."""
        layers = lively([*trunk(nn.Conv2d(1, 8, 9, 4, 2)), nn.Linear(18, 2)])
        export = Export()
        q = self.quantised(self.network(export.output(export.sequence(layers)).proto()))
        x = slow.fold(slow.normalise(IMAGES[3].tolist()))
        for layer, fast in zip(q.model.layers, IntegerNetwork(q.model).activations(IMAGES[3:4])):
            x = slow.step(layer, x)
            self.assertEqual(x, fast[0].tolist(), layer.title)

    def test_padding_in_the_first_layer_begins_between_words(self):
        for kernel, stride, pad in ((11, 4, 2), (9, 4, 2), (8, 8, 3), (5, 4, 1), (12, 8, 0)):
            layers = lively([nn.Conv2d(1, 4, kernel, stride, pad), nn.ReLU(), nn.MaxPool2d(7, 7), nn.Flatten(),
                             nn.Linear(4 * ((((256 + 2 * pad - kernel) // stride + 1) - 7) // 7 + 1) ** 2, 8), nn.ReLU(),
                             nn.Linear(8, 2)])
            export = Export()
            proto = export.output(export.sequence(layers)).proto()
            with self.subTest(kernel=kernel, stride=stride, pad=pad):
                self.check(layers, proto)
                _, _, q = self.check(layers, proto, False, 123.7, 1 / 60)
                self.assertEqual(q.model.mean, 124 if pad else 128)

    def test_heads_of_every_form(self):
        layers = lively([*trunk(), nn.Linear(18, 5)])
        rest, last = layers[:-1], layers[-1]
        whole = Export()
        self.check(layers, whole.output(whole.sequence(layers)).proto())
        parts = Export()  # geometry named first
        x = parts.sequence(rest)
        for rows in (slice(2, 5), slice(0, 2)):
            parts.output(parts.node("Gemm",
                                    [x, parts.constant(last.weight[rows].T.contiguous()), parts.constant(last.bias[rows])]))
        wanted, _, q = self.check(layers, parts.proto())
        self.assertNotEqual(q.model.outputs[1], (0, 1))

        one = lively([*trunk(), nn.Linear(18, 1)])
        for ends, words in (([nn.Sigmoid()], "dropped"), ([], "taken for a logit")):
            export = Export()
            proto = export.output(export.sequence([*one, *ends])).proto()
            imported = self.read(proto)
            self.assertIn(words, imported.notes[0])
            with_zero = nn.Module()
            with_zero.forward = lambda x: torch.nn.functional.pad(one(x), (1, 0))
            _, _, q = self.check(with_zero, proto)
            self.assertEqual(q.model.outputs[1:], [(0, 1)] * 3)

    def test_products_sums_and_reshapes_as_exporters_write_them(self):
        """Weights through Transpose and Identity, a bias by Add, pooling before Relu, a shape that is computed."""
        conv, fc, last = nn.Conv2d(1, 8, 8, 8), nn.Linear(8 * 25, 12), nn.Linear(12, 2)
        layers = lively([conv, nn.MaxPool2d(6, 6), nn.ReLU(), nn.Flatten(), fc, nn.ReLU(), last])
        e = Export()
        x = e.node("Conv", ["image", e.constant(conv.weight)], strides=[8, 8], auto_pad="VALID")
        x = e.node("Add", [e.constant(conv.bias[:, None, None]), x])
        x = e.node("Relu", [e.module(layers[1], x)])
        count = e.node("Gather", [e.node("Shape", [x]), e.constant(np.array(0))])
        shape = e.node("Concat", [e.node("Unsqueeze", [count, e.constant(np.array([0]))]), e.constant(np.array([-1]))],
                       axis=0)
        x = e.node("Reshape", [x, shape])
        weights = e.node("Transpose", [e.node("Identity", [e.constant(fc.weight)])], perm=[1, 0])
        x = e.node("Relu", [e.node("Add", [e.node("MatMul", [x, weights]), e.constant(fc.bias)])])
        x = e.node("Gemm", [x, e.constant(last.weight / 2), e.constant(last.bias / 4)], transB=1, alpha=2.0, beta=4.0)
        proto = e.output(e.node("LogSoftmax", [x], axis=-1)).proto()
        self.check(layers, proto)
        imported = self.read(proto)
        runtime, exact = imported.exact(self.network(proto).input(IMAGES[:1]).numpy())
        np.testing.assert_allclose(exact, layers(self.network(proto).input(IMAGES[:1])).detach().numpy()[0], rtol=1e-4,
                                   atol=1e-4)
        with mock.patch("importlib.util.find_spec", return_value=None):
            self.assertEqual(imported.exact(np.zeros((1, 1, 256, 256), np.float32))[0], "ONNX's reference")

    def test_response_norm_as_pytorch_writes_it(self):
        """The nodes of torch.onnx.export for nn.LocalResponseNorm; with another pooling they are none."""
        norm = nn.LocalResponseNorm(5, 0.3, 0.6, 1.5)
        layers = lively([nn.Conv2d(1, 8, 8, 8), nn.ReLU(), norm, nn.MaxPool2d(6, 6), nn.Flatten(), nn.Linear(200, 12),
                         nn.ReLU(),
                         nn.Linear(12, 2)])

        def exported(pads=(2, 2), second=None, divided=None):
            e = Export()
            x = e.sequence(layers[:2])
            y = e.node("Reshape", [e.node("Mul", [x, second or x]), e.constant(np.array([0, 1, 8, 32, -1]))])
            y = e.node("Pad", [y, e.constant(np.array([0, 0, pads[0], 0, 0, 0, 0, pads[1], 0, 0]))])
            y = e.node("AveragePool", [y], kernel_shape=[5, 1, 1], strides=[1, 1, 1], count_include_pad=1)
            y = e.node("Squeeze", [y, e.constant(np.array([1]))])
            for op, value in (("Mul", norm.alpha), ("Add", norm.k), ("Pow", norm.beta)):
                y = e.node(op, [y, e.constant(np.float32(value))])
            return e.output(e.sequence(layers[3:], e.node("Div", [divided or x, y]))).proto()

        self.check(layers, exported())
        for changes in ({"pads": (4, 0)}, {"second": "conv_0_out"}, {"divided": "conv_0_out"}):
            self.refused(exported(**changes), "Div 'div_10'", "joins 2 tensors", "dynamo=True")

    def test_batches_of_a_fixed_size_are_taken_apart(self):
        layers = lively([*trunk(), nn.Linear(18, 2)])
        export = Export((3, 1, 256, 256))
        imported = self.read(export.output(export.sequence(layers)).proto())
        self.assertEqual(imported.exact(np.zeros((1, 1, 256, 256), np.float32))[1].shape, (2,))


class Refusals(Case):
    """Each by the name of its node, with what is wrong and what to do."""

    def made(self, *modules, **changes):
        """proto of modules with attributes of nodes by name changed."""
        export = Export()
        rank = 2 if any(isinstance(m, nn.Flatten) for m in modules) else 4
        proto = export.output(export.sequence(modules), rank=rank).proto()
        for node in proto.graph.node:
            for name, value in changes.get(node.name, {}).items():
                kept = [a for a in node.attribute if a.name != name]
                del node.attribute[:]
                node.attribute.extend([*kept, helper.make_attribute(name, value)])
        return proto

    CONV = nn.Conv2d(1, 8, 8, 4)

    def rest(self, channels, side):
        return [nn.Flatten(), nn.Linear(channels * side * side, 8), nn.ReLU(), nn.Linear(8, 2)]

    def test_convolutions(self):
        for change, *words in (({"dilations": [2, 2]}, "dilations is [2, 2]", "without dilation"),
                               ({"strides": [2, 2]}, "strides are [2, 2]", "first layer", "must be 4, 8"),
                               ({"strides": [4, 8]}, "strides is [4, 8]"), ({"pads": [0, 0, 1, 1]}, "pads are [0, 0, 1, 1]"),
                               ({"auto_pad": "SAME_UPPER", "kernel_shape": [8, 8], "strides": [5, 5]}, "pads",
                                "SAME_UPPER")):
            with self.subTest(change):
                self.refused(self.made(self.CONV, nn.ReLU(), conv_0=change), "Conv 'conv_0'", *words)
        depthwise = nn.Conv2d(8, 8, 3, groups=8)
        self.refused(self.made(self.CONV, nn.ReLU(), depthwise, nn.ReLU()), "Conv 'conv_2'", "group is 8", "fewer groups")
        self.refused(self.made(self.CONV, nn.Conv2d(8, 8, 3), nn.ReLU()), "Conv 'conv_0'", "no Relu", "Conv 'conv_1'")
        self.refused(self.made(self.CONV, nn.LocalResponseNorm(5)), "Conv 'conv_0'", "no Relu", "LRN")

    def test_norms_and_pooling(self):
        head = [self.CONV, nn.ReLU()]
        self.refused(self.made(*head, nn.LocalResponseNorm(3)), "LRN 'lrn_2'", "size is 3")
        self.refused(self.made(*head, nn.BatchNorm2d(8)), "BatchNormalization 'batchnormalization_2'",
                     "between Conv and Relu")
        pool = nn.MaxPool2d(2, 2)
        for change, *words in (({"pads": [1, 1, 1, 1]}, "pads are [1, 1]"), ({"ceil_mode": 1}, "32 x 32", "ceil_mode 0"),
                               ({"kernel_shape": [2, 3]}, "kernel_shape is [2, 3]"),
                               ({"strides": [1, 2]}, "strides is [1, 2]"),
                               ({"kernel_shape": [99, 99]}, "larger than its input of 63 x 63")):
            with self.subTest(change):
                self.refused(self.made(*head, pool, maxpool_2=change), "MaxPool 'maxpool_2'", *words)
        self.refused(self.made(pool, *head), "MaxPool 'maxpool_0'", "before any Conv")

    def test_ops_that_berth_does_not_have(self):
        for op, remedy in (("GlobalAveragePool", "flatten"), ("LeakyRelu", "Relu"), ("Tanh", "without it")):
            export = Export()
            x = export.sequence([self.CONV])
            self.refused(export.output(export.node(op, [x]), rank=4).proto(), f"{op} '{op.lower()}_1'", "no such layer",
                         remedy)
        export = Export()
        scaled = export.node("Div", ["image", export.constant(np.float32(255))])
        self.refused(export.output(export.sequence([self.CONV], scaled), rank=4).proto(), "Div 'div_0'",
                     "--mean and --scale")
        export = Export()
        export.nodes.append(helper.make_node("Swirl", ["image"], ["y"], domain="org.example"))
        proto = export.output("y", rank=4).proto()
        proto.opset_import.append(helper.make_opsetid("org.example", 1))
        self.refused(proto, "Swirl that computes 'y'", "org.example")

    def test_branches_and_weights_that_are_computed(self):
        export = Export()
        x = export.sequence([self.CONV, nn.ReLU()])
        y = export.sequence([nn.Conv2d(8, 8, 3, 1, 1), nn.ReLU()], x)
        self.refused(export.output(export.node("Add", [x, y]), rank=4).proto(), "Add 'add_4'", "joins 2 tensors",
                     "without branches")
        export = Export()
        weights = export.node("DequantizeLinear",
                              [export.constant(np.ones((8, 1, 8, 8), np.int8)), export.constant(np.float32(1))])
        x = export.node("Conv", ["image", weights], strides=[4, 4])
        self.refused(export.output(x, rank=4).proto(), "Conv 'conv_1'", "DequantizeLinear 'dequantizelinear_0'",
                     "give the float network")

    def test_heads(self):
        front = [self.CONV, nn.ReLU(), nn.MaxPool2d(63, 1)]
        self.refused(self.made(*front, nn.Flatten(), nn.Linear(8, 10)), "'gemm_4_out' of 10 numbers", "two scores")
        self.refused(self.made(*front, nn.Flatten(), nn.Linear(8, 2), nn.Sigmoid()), "Sigmoid 'sigmoid_5'", "2 x 1 x 1")
        self.refused(self.made(*front, nn.Flatten(), nn.Linear(8, 5), nn.Softmax(1)), "Softmax 'softmax_5'", "two classes")
        self.refused(self.made(*front), "'maxpool_2_out'", "without Relu")
        self.refused(self.made(self.CONV, nn.ReLU(), nn.Flatten(), nn.Linear(8 * 63 * 63, 2)), "Gemm 'gemm_3'",
                     "takes a map of 63 x 63", "with Relu before it")
        self.refused(self.made(nn.Flatten(), nn.Linear(65536, 2)), "Gemm 'gemm_1'", "before any Conv")
        self.refused(self.made(*front, nn.Flatten(), nn.Linear(8, 2), nn.Softmax(1), nn.ReLU()), "Relu 'relu_6'",
                     "comes after")
        export = Export()
        x = export.sequence([*front, nn.Flatten()])
        branch = export.sequence([nn.Linear(8, 8), nn.ReLU(), nn.Linear(8, 3)], x)
        export.output(export.sequence([nn.Linear(8, 2)], x)).output(branch)
        self.refused(export.proto(), "Relu 'relu_5'", "one of two outputs alone")

    def test_inputs(self):
        for shape, words in ((("n", 3, 256, 256), "1 x 3 x 256 x 256"), (("n", 1, 224, 224), "224 x 224"),
                             ((1, 65536), "1 x 65536")):
            export = Export(shape)
            proto = export.output(export.node("Identity", ["image"]), rank=len(shape)).proto()
            self.refused(proto, "'image'", words, "256 x 256")
        export = Export(kind=TensorProto.FLOAT16)
        proto = export.output(export.node("Identity", ["image"]), TensorProto.FLOAT16, 4).proto()
        self.refused(proto, "FLOAT16", "float32")

    def test_values_that_are_no_numbers(self):
        conv = nn.Conv2d(1, 8, 8, 4)
        conv.weight.data[0, 0, 0, 0] = float("nan")
        self.refused(self.made(conv, nn.ReLU()), "Conv 'conv_0'", "no numbers")

    def test_what_the_file_cannot_hold_is_named_by_its_node(self):
        layers = lively([self.CONV, nn.ReLU(), nn.Conv2d(8, 8, 3, 1, 4), nn.ReLU(), nn.MaxPool2d(60, 60), *self.rest(8, 1)])
        export = Export()
        with self.assertRaisesRegex(model_file.ModelError, "conv_2 .*pads smaller than the kernel"):
            self.quantised(self.network(export.output(export.sequence(layers)).proto()))


class Files(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        layers = lively([*trunk(), nn.Linear(18, 2)])
        export = Export()
        onnx.save(export.output(export.sequence([*layers, nn.Softmax(1)])).proto(), cls.folder / "net.onnx")
        (cls.folder / "pictures/more").mkdir(parents=True)
        for seed in range(30):
            name, suffix = ("more/" if seed % 2 else "") + str(seed), (".png", ".pgm", ".jpg")[seed % 3]
            Image.fromarray(window(seed % 8)[seed:, :]).save(cls.folder / f"pictures/{name}{suffix}")
        (cls.folder / "pictures/notes.txt").write_text("no picture")

    def called(self, *arguments):
        out, errors = io.StringIO(), io.StringIO()
        with mock.patch.object(sys, "argv", ["import_onnx.py", *map(str, arguments)]), contextlib.redirect_stdout(out), \
                contextlib.redirect_stderr(errors):
            try:
                import_onnx.main()
            except SystemExit as stopped:
                return out.getvalue() + errors.getvalue() + str(stopped.code)
        return out.getvalue()

    def bring(self, net, *more, into="out.berthnet", pictures="pictures"):
        return self.called(self.folder / net, "--calibrate", self.folder / pictures, "-o", self.folder / into, "--threads",
                           1, *more)

    def test_a_network_comes_in_with_its_figures(self):
        said = self.bring("net.onnx", "--mean", "127.5", "--scale", "1/64", "--name", "other")
        for words in ("10 layers", "Softmax 'softmax_20' is dropped", "one image: outputs at most", "| biases corrected |",
                      "| gemm_15 |", "6 images held back, changed: ", "out.berthnet"):
            self.assertIn(words, said)
        model = model_file.read(self.folder / "out.berthnet")
        self.assertEqual((model.name, model.normalise, model.mean), ("other", 0, 128))
        for words in ("net.onnx (CRC-32", "grey - 127.5, times 0.015625", "30 images, pictures of pictures"):
            self.assertIn(words, model.notes)
        again = self.folder / "again.berthnet"
        self.bring("net.onnx", "--mean", "127.5", "--scale", "1/64", "--name", "other", into="again.berthnet")
        self.assertEqual(again.read_bytes(), (self.folder / "out.berthnet").read_bytes())

    def test_what_the_input_is_has_to_be_said(self):
        self.assertIn("--mean M --scale S", self.bring("net.onnx"))
        self.assertIn("leave --mean out", self.bring("net.onnx", "--normalise", "--mean", 3))
        self.assertIn("above 0", self.bring("net.onnx", "--normalise", "--scale", 0))
        self.assertIn("'1/0' is no number", self.bring("net.onnx", "--mean", 3, "--scale", "1/0"))
        layers = lively([*trunk(nn.Conv2d(1, 8, 11, 4, 2)), nn.Linear(18, 2)])
        export = Export()
        onnx.save(export.output(export.sequence(layers)).proto(), self.folder / "padded.onnx")
        self.assertIn("conv_0: pads are [2, 2] in the first layer",
                      self.bring("padded.onnx", "--mean", 0, "--scale", "1/255"))

    def test_damaged_files_are_said_to_be(self):
        whole = (self.folder / "net.onnx").read_bytes()
        random = np.random.default_rng(2)
        damaged = [whole[:length] for length in (0, 1, 40, 1000, len(whole) // 2, len(whole) - 1)]
        damaged += [b"BERTHNET" * 9, b"\0" * 100, random.bytes(5000)]
        for data in damaged:
            (self.folder / "damaged.onnx").write_bytes(data)
            said = self.bring("damaged.onnx", "--normalise")
            self.assertTrue(said.startswith("import_onnx.py: ") and "again" in said and "damaged.onnx" in said, said)
        self.assertIn("none.onnx: No such file", self.bring("none.onnx", "--normalise"))
        for _ in range(40):  # anything may be wrong then, but it is said in a line
            data = bytearray(whole)
            for at in random.integers(0, len(data), 3):
                data[at] = random.integers(256)
            (self.folder / "damaged.onnx").write_bytes(bytes(data))
            with contextlib.suppress(Unsupported):
                onnx_network.read(self.folder / "damaged.onnx")

    def test_pictures_are_their_middle_in_grey(self):
        path = self.folder / "colours.png"
        colours = np.zeros((300, 600, 3), np.uint8)
        colours[:, 150:450] = 90
        Image.fromarray(colours).resize((1200, 600)).save(path)
        middle = calibration_images.window(path)
        self.assertEqual(middle.shape, (256, 256))
        self.assertTrue((middle[:, 4:-4] == 90).all())
        Image.fromarray(np.zeros((9, 9), np.uint16)).save(path)
        with self.assertRaisesRegex(ValueError, "colours.png: .*8-bit grey"):
            calibration_images.window(path)

    def test_pictures_that_are_no_use_are_named(self):
        (self.folder / "bad").mkdir()
        self.assertIn("bad: 0 images", self.bring("net.onnx", "--normalise", pictures="bad"))
        (self.folder / "bad/x.png").write_bytes(b"\x89PNG nothing")
        self.assertIn("x.png: not a picture", self.bring("net.onnx", "--normalise", pictures="bad"))
        self.assertIn("no such folder", self.bring("net.onnx", "--normalise", pictures="nowhere"))


if __name__ == "__main__":
    unittest.main()
