"""Tests of quantise.py, evaluate.py and what they use; needs torch. Run: python3 -m unittest discover -s training/tests
-p '*_test.py'"""
import contextlib
import dataclasses
import io
import json
import pathlib
import sys
import tempfile
import unittest
from unittest import mock

import numpy as np
import torch
import torch.nn.functional as F

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parent), str(HERE)]
import evaluate  # noqa: E402
import fine_tune  # noqa: E402
import float_run  # noqa: E402
import integer_network as integer  # noqa: E402
import model_file  # noqa: E402
import quantisation  # noqa: E402
import quantise  # noqa: E402
from float_run import FloatRun  # noqa: E402
from model import Network  # noqa: E402
from navset import NavSet  # noqa: E402
from tiny_network import window  # noqa: E402

torch.set_num_threads(1)
SETTINGS = {"network": "lite", "normalise": True, "seed": 1, "iterations": 9, "learning_rate": 1e-3, "weight_decay": 0.0,
            "augment": False, "dropout": 0.0}


def random_network(name):
    """Weights as at the start of training, but heads that say something and every batch norm another one."""
    torch.manual_seed(3)
    network = Network(name)
    for norm in network.norms:
        norm.running_mean.uniform_(-0.2, 0.2)
        norm.running_var.uniform_(1, 4)
        norm.weight.data.uniform_(0.3, 2)
        norm.bias.data.uniform_(-0.3, 0.3)
    for head in (network.score, network.geometry):
        head.weight.data.normal_(0, 0.05)
    return network


def random_run(name="lite", mean=0.0, **changes):
    return FloatRun(random_network(name), {**SETTINGS, "network": name, **changes}, mean, 7, "random")


def quantised(run, images, method="max", correct=False):
    ranges = quantisation.Ranges(run, images)
    sigmas = {name: ranges.sigma(name, method) for name in ranges.largest if name.startswith(("conv", "norm", "fc"))}
    out = quantisation.Builder(run, ranges).build(sigmas, "random")
    if correct:
        quantisation.correct_biases(out, ranges)
    return out, ranges


class Networks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.images = np.stack([window(seed) for seed in range(6)])
        cls.floats = random_run()
        cls.quantised, cls.ranges = quantised(cls.floats, cls.images)

    def test_have_the_layers_and_sizes_of_the_float_network(self):
        for step, shape, name in zip(self.floats.steps(self.floats.input(self.images[:1])),
                                     model_file.shapes(self.quantised.model), self.quantised.names):
            self.assertEqual((step.name, tuple(step.x.shape[1:])), (name, (shape[2], *shape[:2])))
        self.assertEqual(len(self.quantised.names), 16)

    def test_say_what_the_float_network_says(self):
        noise = quantisation.signal_to_noise(self.quantised, self.floats, self.images)
        for name, (so_far, alone) in noise.items():
            self.assertGreater(so_far, 28, name)
            self.assertGreater(alone, 32, name)

    def test_each_layer_is_its_float_simulation_to_the_last_bit_but_one(self):
        """Dequantised weights on dequantised activations, rounded, against the integers."""
        q = self.quantised
        network = integer.IntegerNetwork(q.model)
        x, sigma = network.input(self.images[:2]), 1 / 64
        for name, layer, runnable in zip(q.names, q.model.layers, network.layers):
            value = x.double() * sigma
            got = runnable(x)
            if name.startswith(("conv", "fc")):
                weights = torch.from_numpy(layer.weights.astype(np.float64) * (q.units[name] / sigma)[:, None, None, None])
                if name.startswith("fc"):
                    out = F.conv2d(value, weights.permute(0, 3, 1, 2))
                else:
                    out = F.conv2d(value, weights, None, layer.stride, layer.pad, 1, layer.groups)
                out = F.relu(out + torch.from_numpy(layer.bias * q.units[name])[:, None, None])
            elif name.startswith("norm"):
                out = self.floats.network.lrn(value)
            elif name.startswith("pool"):
                out = F.max_pool2d(value, 3, 2)
            if name != "heads":
                sigma = q.sigmas[name]
                simulated = (out / sigma).round().clamp(0, 127)
                self.assertLessEqual((got - simulated).abs().max().item(), 0 if name.startswith("pool") else 1, name)
                self.assertLess((got != simulated).double().mean().item(), 0.02, name)
            x = got

    def test_scores_and_geometry_are_the_float_networks(self):
        got = integer.IntegerNetwork(self.quantised.model).found(self.images, batch=4)
        exact = quantisation.dequantised(self.quantised, got.raw)
        np.testing.assert_allclose(got.score / 2**15, 1 / (1 + np.exp(exact[:, 0] - exact[:, 1])), atol=2**-10)
        np.testing.assert_allclose(got.x / 2**16, 127.5 + 128 * exact[:, 2], atol=1e-3)
        np.testing.assert_allclose(got.y / 2**16, 127.5 + 128 * exact[:, 3], atol=1e-3)
        np.testing.assert_allclose(got.d / 2**16, np.clip(64 * np.exp(exact[:, 4]), 8, 512), rtol=1e-4)
        self.assertGreater(np.ptp(exact[:, 4]), 0.1)

    def test_paper_fits_too(self):
        run = random_run("paper")
        q, _ = quantised(run, self.images[:2])
        self.assertEqual(model_file.shapes(q.model)[0], (62, 62, 96))
        self.assertGreater(min(alone for _, alone in quantisation.signal_to_noise(q, run, self.images[:1]).values()), 30)

    def test_a_training_mean_goes_into_the_first_bias(self):
        """Integers take 128 off, so that no grey level is clamped."""
        run = random_run(mean=61.3, normalise=False)
        q, _ = quantised(run, self.images)
        self.assertEqual((q.model.normalise, q.model.mean), (0, 128))
        noise = quantisation.signal_to_noise(q, run, self.images)
        self.assertGreater(noise["conv1"][0], 33)
        self.assertGreater(noise["heads"][0], 25)

    def test_correction_brings_the_means_of_all_channels_together(self):
        q, ranges = quantised(self.floats, self.images, "99.9 %", correct=True)
        network = integer.IntegerNetwork(q.model)
        x = network.input(self.images)
        for name, layer, runnable in zip(q.names, q.model.layers, network.layers):
            if name in q.units:
                mean = (runnable.products(x).double().mean((0, 2, 3)).numpy() + layer.bias) * q.units[name]
                np.testing.assert_allclose(mean, ranges.channel_mean[name], atol=q.units[name].max())
            x = runnable(x)

    def test_ranges_keep_what_their_method_says(self):
        name = "conv2"
        kept = [127 * self.ranges.sigma(name, method) for method in quantisation.METHODS]
        self.assertEqual(kept[0], self.ranges.largest[name])
        self.assertTrue(kept[0] > kept[1] > kept[2])
        values = np.concatenate([step.x.flatten().numpy() for step in self.floats.steps(self.floats.input(self.images))
                                 if step.name == name])
        values = values[values > 0]
        self.assertAlmostEqual(float((values <= kept[2]).mean()), 0.999, places=4)

        def error(sigma):
            return float(np.mean((np.clip(np.round(values / sigma), 0, 127) * sigma - values) ** 2))
        self.assertLess(error(kept[3] / 127), 0.98 * error(kept[0] / 127))
        for factor in (0.9, 1.1):
            self.assertLess(error(kept[3] / 127), error(kept[3] / 127 * factor))


class FineTuning(unittest.TestCase):
    def test_simulates_the_integer_network(self):
        """Stage by stage on the integers' activations: what differs are multipliers and table in fixed point, where a
        value is at the edge between two integers."""
        images = np.stack([window(seed) for seed in range(2)])
        run = random_run()
        q, _ = quantised(run, images)
        simulated = fine_tune.SimulatedNetwork(run.network, q.sigmas, q.scales())
        x, stage = run.input(images), None
        with torch.no_grad():
            for name, got in zip(q.names, integer.IntegerNetwork(q.model).activations(images)):
                kind, number = (name[:-1], int(name[-1])) if name != "heads" else (name, 0)
                if kind in ("norm", "pool"):
                    if kind == "norm" and f"pool{number}" in q.names:
                        continue  # compared behind its pooling
                    stage = simulated.convolved(number, x)
                elif kind == "fc":
                    stage = simulated.connected(number, x)
                elif kind == "heads":
                    exact = got.flatten(1).double() * torch.from_numpy(q.units["heads"])
                    torch.testing.assert_close(simulated.heads(x).double(), exact, atol=1e-3, rtol=0)
                    return
                else:
                    continue
                off = (stage.flatten(1) / q.sigmas[name] - got.flatten(1)).abs()
                self.assertLess(off.max(), 1.01, name)
                self.assertLess((off > 0.5).double().mean(), 0.03, name)
                x = (got * q.sigmas[name]).float()
        self.fail("no heads")

    def test_learns_with_its_weights_rounded(self):
        images = np.stack([window(seed) for seed in range(4)])
        run = random_run()
        q, _ = quantised(run, images)
        simulated = fine_tune.SimulatedNetwork(run.network, q.sigmas, q.scales()).train()
        optimizer = torch.optim.Adam(simulated.parameters(), 1e-3)
        x, present, losses = run.input(images), torch.tensor([0, 1, 1, 0]), []
        for _ in range(12):
            loss = F.cross_entropy(simulated(x)[0], present)
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            losses.append(loss.item())
        self.assertLess(losses[-1], 0.3 * losses[0])

    def test_gradients_pass_rounding_but_not_the_ends(self):
        x = torch.tensor([-200.0, -100.4, 0.3, 127.4, 127.6], requires_grad=True)
        out = fine_tune._Rounded.apply(x, torch.tensor(1.0), -127)
        out.sum().backward()
        self.assertEqual(out.tolist(), [-127, -100, 0, 127, 127])
        self.assertEqual(x.grad.tolist(), [0, 1, 1, 1, 0])


class Weights(unittest.TestCase):
    def setUp(self):
        self.random = np.random.default_rng(4)

    def test_folding_the_input_changes_nothing(self):
        for size in (8, 11):
            weights = self.random.normal(size=(4, 1, size, size))
            x = torch.from_numpy(self.random.normal(size=(2, 1, 64, 64)))
            folded = torch.from_numpy(quantisation.folded_input(weights))
            words = x[:, 0].unflatten(2, (16, 4)).permute(0, 3, 1, 2)
            torch.testing.assert_close(F.conv2d(words, folded, stride=(4, 1)),
                                       F.conv2d(x, torch.from_numpy(weights), stride=4))

    def layer(self, weights, bias, sigma_out=1.0, reach=127.0):
        return quantisation.requantised_layer(weights, bias, 1.0, sigma_out, np.full(len(weights), reach), 127)

    def test_channels_far_apart_are_each_held_as_well_as_sixteen_bits_allow(self):
        """A faint channel that reaches 127 may not end early; one that is faint altogether keeps all its bits."""
        weights = self.random.normal(size=(8, 64)) * np.array([1, 1, 1, 1, 1, 1, 0.02, 0.02])[:, None] * 0.01
        reach = np.array([127.0] * 7 + [1.5])
        integers, bias, multiplier, shift, unit = quantisation.requantised_layer(weights, np.zeros(8), 1.0, 1.0, reach, 127)
        ends = 32767 * multiplier / 2**22
        self.assertTrue((ends >= np.minimum(reach, 126.5)).all())
        self.assertLess(np.abs(integers[6]).max(), 127)
        self.assertEqual(np.abs(integers[7]).max(), 127)
        self.assertLess(np.sqrt(np.mean((integers * unit[:, None] - weights) ** 2)), 0.35 * unit.max())
        np.testing.assert_allclose(multiplier / 2.0 ** (22 + shift), unit, rtol=2e-3)

    def test_what_32_bits_cannot_hold_is_refused(self):
        weights = self.random.normal(size=(4, 16)) * 1e-9
        bias = np.array([0.0, 0.0, 3.0, 0.0])
        with self.assertRaisesRegex(quantisation.DoesNotFit, "channel 2"):
            self.layer(weights, bias, sigma_out=1e-8, reach=1e-8)
        integers, bias, _, shift, _ = self.layer(weights, -bias, sigma_out=1e-8, reach=1e-8)  # silent, whatever it is
        self.assertLessEqual(max(model_file.largest_sum(integers, bias, shift, 127)), 2**31 - 1)
        with self.assertRaisesRegex(quantisation.DoesNotFit, "too small"):
            self.layer(np.ones((4, 1)), np.zeros(4), sigma_out=0.5)

    def test_silent_channels_are_no_trouble(self):
        weights = self.random.normal(size=(4, 16)) * 0.01
        weights[1] = 0
        integers, bias, multiplier, _, unit = self.layer(weights, np.array([0, 0.3, 0, -9.0]))
        self.assertFalse(integers[1].any())
        self.assertAlmostEqual(bias[1] * unit[1], 0.3, places=3)

    def test_output_scales_are_as_near_as_30_bits_are(self):
        for factor in (1e-6, 0.37, 1.0, 1000.0, 123456.7):
            multiplier, k = quantisation.fixed_point(factor)
            self.assertTrue(2**29 <= multiplier < 2**30)
            self.assertAlmostEqual(multiplier / 2.0**k / factor, 1, places=8)


def whole_set(folder, count=60):
    """Windows with every column that evaluate.py reads; the last third is the test part."""
    images = np.stack([window(k % 8) for k in range(count)])
    lines = ["index,part,class,subject,visible,x0,y0,x1,y1,full_x0,full_y0,full_x1,full_y1,d_px,x,y,depth_m,range_m,"
             "focal_px,axis_x,axis_y,light,background,livery"]
    for k in range(count):
        present = k % 3 == 0
        values = "0,0,0,0,0,0,0,0,0,0,0,0,0,0"
        if present:
            values = f"{0.5 + k % 50 / 100},0,0,9,9,0,0,9,9,{40 + k},{100 + k},{130 - k},{2 + k / 30},{2 + k / 30}"
        lines.append(f"{k},{'train' if k < 2 * count // 3 else 'test'},{int(present)},{'target' if present else 'robot'},"
                     f"{values},400,1,1,{'sun' if k % 2 else 'lamps'},lab-{k},{'banded' if present else ''}")
    folder.mkdir()
    images.tofile(folder / "images.u8")
    (folder / "labels.csv").write_text("\n".join(lines) + "\n")
    (folder / "manifest.json").write_text(json.dumps({"set": "windows", "seed": 5, "image_hash": "abc123"}))


class Programs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = pathlib.Path(cls.temporary.name)
        whole_set(cls.folder / "set")
        (cls.folder / "run").mkdir()
        manifest = json.loads((cls.folder / "set/manifest.json").read_text())
        settings = {**SETTINGS, "manifests": [manifest]}
        (cls.folder / "run/run.json").write_text(json.dumps(settings))
        torch.save({"network": random_network("lite").state_dict(), "mean": 0.0, "iteration": 7, "settings": settings},
                   cls.folder / "run/latest.pt")
        cls.net = cls.folder / "net.berthnet"
        cls.said = cls.called(quantise.main, "quantise.py", cls.folder / "run", "--calibrate", cls.folder / "set", "-o",
                              cls.net, "--images", 12, "--search-images", 0, "--threads", 1)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @staticmethod
    def called(main, *arguments):
        out = io.StringIO()
        with mock.patch.object(sys, "argv", [str(a) for a in arguments]), contextlib.redirect_stdout(out):
            main()
        return out.getvalue()

    def test_quantising_writes_a_network_that_names_its_origin(self):
        model = model_file.read(self.net)
        self.assertEqual(model.name, "run")
        for words in ("run run", "trained on windows seed 5 (abc123)", "calibrated on windows seed 5", "iteration 7 of 9", "windows seed 5 (abc123)"):
            self.assertIn(words, model.notes)
        weighted = [line for line in self.said.splitlines() if line.startswith(("| conv", "| fc", "| heads"))]
        self.assertEqual(len(weighted), 8)

    def test_fine_tuning_changes_weights_and_keeps_their_scales(self):
        tuned = self.folder / "tuned.berthnet"
        said = self.called(quantise.main, "quantise.py", self.folder / "run", "--calibrate", self.folder / "set", "-o", tuned,
                           "--images", 12, "--search-images", 0, "--threads", 1, "--fine-tune", 3, "--learning-rate", 2e-2)
        self.assertIn("Fine-tuning, 3 iterations: loss", said)
        old, new = model_file.read(self.net), model_file.read(tuned)
        self.assertIn("fine-tuned 3 iterations", new.notes)
        for a, b in zip(old.layers, new.layers):
            if hasattr(a, "multiplier"):
                self.assertEqual(a.shift, b.shift)
                self.assertFalse(np.array_equal(a.weights, b.weights))
                self.assertLess(np.abs(a.weights.astype(int) - b.weights).mean(), 12)

    def test_quantising_twice_gives_the_same_bytes(self):
        again = self.folder / "again.berthnet"
        self.called(quantise.main, "quantise.py", self.folder / "run/latest.pt", "--calibrate", self.folder / "set", "-o",
                    again, "--images", 12, "--search-images", 0, "--threads", 1)
        self.assertEqual(again.read_bytes(), self.net.read_bytes())

    def test_the_choice_of_methods_never_makes_it_worse(self):
        run = float_run.load(self.folder / "run")
        images = NavSet(self.folder / "set").images
        ranges = quantisation.Ranges(run, np.array(images[:8]))
        search = quantise.Search(run, ranges, np.array(images[8:14]), np.arange(6) % 3 == 1)
        search.names = lambda: ["conv1", "norm1"]  # two layers are enough of a choice; the others stay
        rest = {name: "max" for name in ranges.largest if name.startswith(("conv", "norm", "fc"))}
        search.sigmas = lambda methods, whole=search.sigmas: whole({**rest, **methods})
        self.assertEqual([name for name, _ in search.alternatives()], ["conv1"] * 4)  # alpha is small: norm1 stays
        lines = []
        methods = search.best(lines.append)
        best = search.tried(methods, False)[1].error
        for method in quantisation.METHODS:
            self.assertLessEqual(best, search.tried({"conv1": method, "norm1": "same"}, False)[1].error)
        self.assertTrue(all("decisions" in line for line in lines))

    def test_evaluation_counts_what_the_network_says(self):
        navset, model = NavSet(self.folder / "set"), model_file.read(self.net)
        indices = navset.part("test")
        found = integer.IntegerNetwork(model).found(navset.images[indices])
        middle = float(np.median(found.score)) / 2**15
        said = self.called(evaluate.main, "evaluate.py", self.net, self.folder / "set", "--float", self.folder / "run",
                           "--threshold", middle, "--failures", self.folder / "failures.png", "--threads", 1)
        present = np.array([navset.labels[i]["class"] for i in indices]) == 1
        row = next(line for line in said.splitlines() if line.startswith("| 0.50 |"))
        positive = found.score >= 2**14
        self.assertEqual([int(cell) for cell in row.split("|")[3:5]],
                         [(~positive & present).sum(), (positive & ~present).sum()])
        robots = next(line for line in said.splitlines() if line.startswith("| robot |"))
        false = int((found.score[~present] >= middle * 2**15).sum())
        self.assertEqual(robots.split("|")[2:6], [f" {(~present).sum()} ", " 0 ", " - ", f" {false} "])
        self.assertGreater(false, 0)
        self.assertTrue((self.folder / "failures.png").exists())
        for words in ("| lamps |", "| banded |", "median", "changed against float", "iteration 7"):
            self.assertIn(words, said)

    def test_errors_of_geometry_are_of_the_targets_that_count(self):
        rows = [{"visible": 0.9, "range_m": 3.0, "depth_m": 2.5, "focal_px": 500.0, "d_px": 80.0, "x": 100.0, "y": 50.0}
                for _ in range(4)]
        rows[2] = {**rows[2], "visible": 0.7}
        rows[3] = {**rows[3], "range_m": 7.0}
        score = np.array([0.9, 0.2, 0.9, 0.9])
        results = evaluate.Results(score, np.full(4, 104.0), np.full(4, 53.0), np.full(4, 100.0), np.ones(4, bool), rows)
        lines = list(evaluate.geometry_table(results, 0.5))
        self.assertIn("at least 80 % visible: 2, found: 1", lines[0])
        self.assertEqual(lines[4:], ["| d | 25.00 % | 25.00 % |", "| depth (f D / d) | 20.00 % | 20.00 % |",
                                     "| centre, share of d | 6.25 % | 6.25 % |"])

    def test_every_image_is_in_one_row_of_each_confusion(self):
        navset = NavSet(self.folder / "set")
        indices = np.arange(len(navset.images))
        rows = [navset.labels[i] for i in indices]
        present = np.array([row["class"] == 1 for row in rows])
        results = evaluate.Results(np.linspace(0, 1, len(rows)), *[np.zeros(len(rows))] * 3, present, rows)
        visible = sum(chosen.astype(int) for _, chosen in evaluate.by_visibility(results))
        np.testing.assert_array_equal(visible, present)
        ranges = sum(chosen.astype(int) for _, chosen in
                     evaluate.by_interval(results, results.column("range_m"), evaluate.RANGES_M, "m"))
        np.testing.assert_array_equal(ranges, present)

    def test_what_cannot_be_used_is_said_in_a_line(self):
        for main, arguments, words in (
                (quantise.main, [self.folder / "none", "--calibrate", self.folder / "set", "-o", self.net], "no such run"),
                (quantise.main, [self.folder / "run", "--calibrate", self.folder / "set", "-o", self.net], "images wanted"),
                (evaluate.main, [self.folder / "set/labels.csv", self.folder / "set"], "no Berth network")):
            with self.assertRaises(SystemExit) as caught:
                self.called(main, "program", *arguments)
            self.assertIn(words, str(caught.exception.code))

    def test_a_difference_is_what_it_says(self):
        exact = np.array([[0, 1.0, 0, 0, 0], [0, -1, 0, 0, 0], [0, 20, 0, 0, 0]])
        got = exact + [[0, -1.5, 0.3, 0, 0], [0, 0, 9, 9, 9], [0, 5, 0, 0, 0]]
        found = quantise.difference(got, exact, np.array([True, False, False]))
        self.assertEqual(found.changed, 1)
        self.assertAlmostEqual(found.logits, 1.5 / 3**0.5)
        self.assertAlmostEqual(found.geometry, 0.3 / 3**0.5)
        self.assertEqual(dataclasses.astuple(quantise.difference(exact, exact, np.zeros(3, bool))), (0, 0.0, 0.0))


if __name__ == "__main__":
    unittest.main()
