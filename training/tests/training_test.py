"""Tests of the training code; needs torch. Run: python3 -m unittest discover -s training/tests -p '*_test.py'"""
import csv
import json
import pathlib
import sys
import tempfile
import unittest

import numpy as np
import torch

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import curves  # noqa: E402
from batches import BATCH, Samples, augmented, balanced_batch, normalised, shifted, training_batch  # noqa: E402
from fine_tune import FineTuner  # noqa: E402
from model import LocalResponseNorm, Network, size_of  # noqa: E402
from muon import LARGEST, Muon, Optimizer, orthogonalised  # noqa: E402
from navset import NavSet  # noqa: E402
from pretrain import CropNetwork, Pretrainer, crops, place_loss  # noqa: E402
from train import LOG, Trainer, run  # noqa: E402


def small_set(folder, count=120):
    """Bright squares on noise are `targets`: a set in berth_navset's form that a network can learn at once."""
    random = np.random.default_rng(3)
    images = random.integers(20, 90, (count, 256, 256), dtype=np.uint8)
    header = "index,part,class,subject,visible,d_px,x,y,x0,y0,x1,y1,full_x0,full_y0,full_x1,full_y1,light,background,livery"
    lines = [header]
    for i in range(count):
        present = i % 2
        x, y, d = random.integers(100, 156), random.integers(100, 156), random.integers(40, 90)
        if present:
            images[i, y - d // 2:y + d // 2, x - d // 2:x + d // 2] = 220
        values = [present, d, x, y] if present else [0, 0, 0, 0]
        lines.append(f"{i},{'train' if i < count * 3 // 4 else 'test'},{values[0]},thing,1,{values[1]},{values[2]},{values[3]}"
                     + ",0" * 8 + ",lamps,b,l")
    images.tofile(folder / "images.u8")
    (folder / "labels.csv").write_text("\n".join(lines) + "\n")
    (folder / "manifest.json").write_text(json.dumps({"set": "small"}))
    return NavSet(folder)


class Balance(unittest.TestCase):
    def test_half_of_a_batch_is_targets_and_epochs_are_permutations(self):
        present = (np.arange(400) % 4 == 0).astype(np.float32)
        seen = []
        for k in range(4):
            chosen = balanced_batch(7, k, present)
            self.assertEqual(len(chosen), BATCH)
            self.assertEqual(present[chosen].sum(), BATCH // 2)
            np.testing.assert_array_equal(chosen, balanced_batch(7, k, present))
            seen += list(chosen[present[chosen] > 0])
        self.assertEqual(len(set(seen)), 100)  # 4 x 25 of the 100 targets

    def test_scores_are_for_the_sets_share(self):
        with tempfile.TemporaryDirectory() as folder:
            samples = Samples([small_set(pathlib.Path(folder))], "train")
            samples.present[:] = np.arange(len(samples)) % 4 == 0
            trainer = Trainer({**SETTINGS, "balance": True}, samples, samples, "cpu")
        prior = torch.log(torch.tensor([1 - samples.present.mean(), samples.present.mean()]))
        torch.testing.assert_close(torch.softmax(prior + trainer.odds, 0), torch.tensor([0.5, 0.5]))


class FineTuning(unittest.TestCase):
    def test_steps_with_an_optimizer_of_its_own(self):
        with tempfile.TemporaryDirectory() as folder:
            samples = Samples([small_set(pathlib.Path(folder))], "train")
            network = Network("lite")
            before = network.convs[2].weight.detach().clone()
            tuner = FineTuner(network, SETTINGS, 0.0, samples, 2, 1e-3, "cpu")
            first, last = tuner.tune()
        self.assertTrue(np.isfinite(first) and np.isfinite(last))
        self.assertEqual(tuner.iteration, 2)
        change = (network.convs[2].weight - before).abs().max().item()
        self.assertTrue(0 < change < 0.01, change)  # AdamW's steps of the learning rate, not Muon's


class Optimizers(unittest.TestCase):
    def test_muon_makes_all_singular_values_about_one(self):
        torch.manual_seed(2)
        for rows, columns in ((32, 64), (96, 576), (50, 20)):
            skewed = torch.randn(rows, columns) * torch.logspace(0, -1.5, columns)
            values = torch.linalg.svdvals(orthogonalised(skewed))
            self.assertGreater(values.min(), 0.3, (rows, columns))
            self.assertLess(values.max(), 1.3, (rows, columns))

    def test_muon_comes_to_a_least_squares_solution(self):
        torch.manual_seed(3)
        wanted, weight = torch.randn(8, 12), torch.nn.Parameter(torch.zeros(8, 12))
        muon = Muon([weight], 0.1, 0.0)
        for k in range(300):
            muon.param_groups[0]["lr"] = 0.1 * (1 - k / 300)
            weight.grad = weight.detach() - wanted
            muon.step()
        self.assertLess((weight - wanted).abs().max(), 0.05)

    def test_each_parameter_has_one_optimizer(self):
        for name in ("lite", "paper"):
            network = Network(name)
            optimizer = Optimizer(network, [network.score, network.geometry], 1e-2, 0.0)
            muon = [p for group in optimizer.muon.param_groups for p in group["params"]]
            adamw = [p for group in optimizer.adamw.param_groups for p in group["params"]]
            self.assertEqual({id(p) for p in muon + adamw}, {id(p) for p in network.parameters()})
            self.assertEqual(len(muon) + len(adamw), len(list(network.parameters())))
            self.assertTrue(all(p.ndim > 1 and min(p.flatten(1).shape) <= LARGEST for p in muon))
            self.assertEqual(len(muon), 7 if name == "lite" else 5)


SETTINGS = {"network": "lite", "seed": 5, "learning_rate": 1e-2, "weight_decay": 0.02, "dropout": 0.2, "balance": False,
            "augment": True, "normalise": True, "precision": "fp32", "iterations": 20}


class Networks(unittest.TestCase):
    def test_have_the_sizes_of_the_specification(self):
        for name, parameters, macs in (("paper", 56.9e6, 766e6), ("lite", 1.07e6, 102e6)):
            got = size_of(Network(name))
            self.assertLess(abs(got[0] / parameters - 1), 0.005, name)
            self.assertLess(abs(got[1] / macs - 1), 0.005, name)

    def test_local_response_norm_is_torchs_with_its_gradient(self):
        torch.manual_seed(1)
        ours, theirs = LocalResponseNorm(0.3), torch.nn.LocalResponseNorm(5, 0.3, 0.75, 1.0)
        x = torch.randn(2, 9, 4, 4, dtype=torch.double)
        a, b, gradient = x.clone().requires_grad_(), x.clone().requires_grad_(), torch.randn_like(x)
        ours(a).backward(gradient)
        theirs(b).backward(gradient)
        torch.testing.assert_close(ours(x), theirs(x))
        torch.testing.assert_close(a.grad, b.grad)

    def test_folding_changes_nothing(self):
        torch.manual_seed(2)
        network = Network("lite").train()
        for _ in range(3):
            network(torch.randn(4, 1, 256, 256) * 2 + 1)
        network.eval()
        folded = network.folded()
        self.assertFalse(any("norms" in name for name in folded.state_dict()))
        x = torch.randn(3, 1, 256, 256)
        for a, b in zip(network(x), folded(x)):
            torch.testing.assert_close(a, b, atol=1e-4, rtol=1e-3)


class Batches(unittest.TestCase):
    def test_an_epoch_shows_every_image_in_192_batches_of_the_papers_set(self):
        seen = np.concatenate([training_batch(1, i, 9590) for i in range(192)])
        self.assertEqual(len(seen), 192 * BATCH)
        self.assertEqual(len(np.unique(seen)), 9590)
        self.assertFalse(np.array_equal(training_batch(1, 0, 9590), training_batch(1, 192, 9590)))

    def test_normalisation_is_the_integer_formula_pixel_by_pixel(self):
        random = np.random.default_rng(0)
        image = random.integers(40, 60, (1, 256, 256), dtype=np.uint8)
        image[0, 0, 0] = 255
        x = image.astype(object)
        m = (int(x.sum()) + 2**15) >> 16
        v = (int((x * x).sum()) >> 16) - m * m
        s = int(v**0.5)
        gain = (256 * 48 + s // 2) // s
        expected = np.clip(((x - m) * gain + 128) >> 8, -128, 127).astype(np.int8)
        np.testing.assert_array_equal(normalised(image), expected)
        self.assertEqual(normalised(np.full((1, 256, 256), 7, np.uint8)).max(), 0)

    def test_augmentation_moves_the_centre_with_the_picture(self):
        images = np.zeros((40, 256, 256), np.uint8)
        x, y = np.full(40, 150, np.float32), np.full(40, 110, np.float32)
        images[:, 110, 150] = 200
        moved, new_x, new_y, _ = augmented(1, 7, images, x, y, x)
        for image, column, row in zip(moved, new_x, new_y):
            self.assertEqual(np.unravel_index(image.argmax(), image.shape), (row, column))
        self.assertGreater(len({(a, b) for a, b in zip(new_x, new_y)}), 20)
        again = augmented(1, 7, images, x, y, x)[0]
        np.testing.assert_array_equal(moved, again)

    def test_a_shift_repeats_the_rim(self):
        image = np.arange(256, dtype=np.uint8)[None, :].repeat(256, 0)
        self.assertEqual(shifted(image, 3, 0)[0, :5].tolist(), [0, 0, 0, 0, 1])
        self.assertEqual(shifted(image, -3, 0)[0, -4:].tolist(), [255, 255, 255, 255])


class Crops(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.samples = Samples([small_set(pathlib.Path(self.temporary.name))], "train")

    def tearDown(self):
        self.temporary.cleanup()

    def test_the_centre_moves_with_the_picture(self):
        images, (x, y, d) = crops(np.random.default_rng(4), self.samples, np.arange(40))
        for image, present, column, row, size in zip(images, self.samples.present, x, y, d):
            if not present:
                self.assertEqual((column, row, size), (0, 0, 0))
                continue
            bright = np.argwhere(image == 220)  # the square about the target's centre
            if bright.min() > 0 and bright.max() < 127:  # not cut off
                np.testing.assert_allclose(bright.mean(0), (row - 0.5, column - 0.5), atol=1.1)
                self.assertAlmostEqual(np.ptp(bright[:, 0]) + 1, size, delta=1.1)
        self.assertGreater(len(np.unique(x)), 10)

    def test_places_are_those_of_the_maps_cells(self):
        network = CropNetwork("lite").eval()
        self.assertEqual(network.centres().tolist(), [15.5 + 16 * k for k in range(7)])
        # The cell that a bright dot reaches at all lies about it.
        dark = torch.zeros(1, 1, 128, 128)
        dot = dark.clone()
        dot[0, 0, 63, 63] = 50
        with torch.no_grad():
            reached = (network(dot)[1] - network(dark)[1])[0].abs() > 0
        rows = torch.nonzero(reached).float().mean(0)
        self.assertTrue(torch.all((rows - 3).abs() < 0.6), rows)

    def test_a_place_counts_where_the_target_is(self):
        centres = 15.5 + 16 * torch.arange(7)
        present, x, y, d = torch.ones(1), torch.tensor([63.5]), torch.tensor([31.5]), torch.tensor([40.0])
        right, wrong = torch.full((1, 7, 7), -9.0), torch.full((1, 7, 7), -9.0)
        right[0, 1, 3] = wrong[0, 5, 5] = 9
        self.assertLess(place_loss(right, centres, present, x, y, d), 0.1)
        self.assertGreater(place_loss(wrong, centres, present, x, y, d), 15)
        self.assertGreater(place_loss(right, centres, torch.zeros(1), x, y, d), 8)

    def test_a_resumed_run_has_the_bits_of_an_uninterrupted_one(self):
        torch.set_num_threads(1)
        settings = {"network": "lite", "seed": 2, "learning_rate": 1e-3, "iterations": 6}
        whole, first, second = (Pretrainer(settings, self.samples, "cpu") for _ in range(3))
        for _ in range(3):
            whole.step()
        first.step()
        second.restore(first.state())
        for _ in range(2):
            second.step()
        for (name, a), b in zip(whole.network.state_dict().items(), second.network.state_dict().values()):
            self.assertTrue(torch.equal(a, b), name)
        trainer = Trainer(SETTINGS, self.samples, self.samples, "cpu")
        trainer.start_from(whole.state())
        self.assertTrue(torch.equal(trainer.network.convs[4].weight, whole.network.network.convs[4].weight))


class Runs(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        navset = small_set(self.folder)
        self.train, self.test = Samples([navset], "train"), Samples([navset], "test")
        torch.set_num_threads(1)
        torch.use_deterministic_algorithms(True)

    def tearDown(self):
        self.temporary.cleanup()

    def trainer(self, **changes):
        return Trainer({**SETTINGS, **changes}, self.train, self.test, "cpu")

    def run_in(self, name, trainer, until):
        folder = self.folder / name
        folder.mkdir(exist_ok=True)
        run(trainer, folder, until, log_every=2, test_every=4, snapshot_every=4, latest_every=3)
        return folder

    def test_a_resumed_run_has_the_bits_of_an_uninterrupted_one(self):
        whole, first, second = self.trainer(), self.trainer(), self.trainer()
        self.run_in("whole", whole, 8)
        folder = self.run_in("parts", first, 5)
        second.restore(torch.load(folder / "latest.pt", weights_only=True))
        self.run_in("parts", second, 8)
        for (name, a), b in zip(whole.network.state_dict().items(), second.network.state_dict().values()):
            self.assertTrue(torch.equal(a, b), name)
        logs = []
        for name in ("whole", "parts"):
            with open(self.folder / name / "log.csv", newline="") as file:
                # Means over the batches since the last row start afresh at a resumption; the rest must agree.
                logs.append([{k: v for k, v in row.items() if k not in ("seconds", "train_loss", "train_accuracy")}
                             for row in csv.DictReader(file)])
        self.assertEqual(logs[0], logs[1])
        self.assertTrue((folder / "snapshot-000008.pt").exists())

    def test_learns_what_is_easy_and_draws_its_curves(self):
        trainer = self.trainer(iterations=40, augment=False, dropout=0.0)
        folder = self.run_in("easy", trainer, 40)
        with open(folder / "log.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(list(rows[0]), LOG)
        self.assertLess(float(rows[-1]["train_loss"]), 0.5 * float(rows[0]["train_loss"]))
        self.assertGreaterEqual(float(rows[-1]["test_accuracy"]), 0.9)
        picture = curves.svg(rows, "easy")
        self.assertEqual(picture.count("<polyline"), 4)


if __name__ == "__main__":
    unittest.main()
