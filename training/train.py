#!/usr/bin/env python3
"""Trains `lite` or `paper` on navigation sets: the paper's batches, epochs, test and snapshots.

A run lives in a folder: run.json (its settings), log.csv, snapshot-NNNNNN.pt every 1,000 iterations and latest.pt.
The same command again resumes it, exactly: on a CPU with the same number of threads the weights come out bit for bit
as without the interruption."""
import argparse
import csv
import json
import math
import os
import pathlib
import time

import numpy as np
import torch
import torch.nn.functional as F

from batches import BATCH, Samples, augmented, balanced_batch, normalised, training_batch
from model import SIZE_UNIT_PX, Network, size_of
from muon import Optimizer
from navset import NavSet

LOG = ["iteration", "epoch", "learning_rate", "train_loss", "train_accuracy", "test_loss", "test_accuracy", "misses",
       "false_positives", "d_error_median", "centre_error_median_px", "seconds"]
INPUT_SCALE = 1 / 64


class Trainer:
    def __init__(self, settings, train, test, device):
        self.settings, self.train, self.test, self.device = settings, train, test, device
        torch.manual_seed(settings["seed"])
        self.network = Network(settings["network"]).to(device, memory_format=torch.channels_last)
        outputs = [self.network.score, self.network.geometry]
        self.optimizer = Optimizer(self.network, outputs, settings["learning_rate"], settings["weight_decay"])
        self.mean = 0.0 if settings["normalise"] else train.mean()
        # Targets are more frequent in balanced batches than in the set by so much; what is learnt beside it is the score
        # for the set's share (logit adjustment, Menon et al., 2021, arXiv:2007.07314).
        share = train.present.mean() if settings.get("balance") else 0.5
        self.odds = torch.tensor([math.log(0.5 / (1 - share)), math.log(0.5 / share)], device=device)
        self.iteration = 0

    def tensor(self, images):
        x = torch.from_numpy(normalised(images) if self.settings["normalise"] else images.astype(np.float32))
        x = ((x.to(torch.float32) - self.mean) * INPUT_SCALE)[:, None]
        return x.to(self.device).contiguous(memory_format=torch.channels_last)

    def outputs(self, x, dropout=0.0):
        with torch.autocast(self.device, dtype=torch.bfloat16, enabled=self.settings["precision"] == "bf16"):
            scores, geometry = self.network(x, dropout)
        return scores.float(), geometry.float()

    def losses(self, scores, geometry, present, x, y, d):
        wanted = torch.stack([(x - 127.5) / 128, (y - 127.5) / 128, torch.log(d.clamp(min=1) / SIZE_UNIT_PX)], 1)
        error = F.smooth_l1_loss(geometry, wanted, reduction="none", beta=0.1).sum(1)
        return F.cross_entropy(scores, present.long()), (error * present).sum() / present.sum().clamp(min=1)

    def learning_rate(self):
        """A short rise, then half a cosine down to nothing."""
        rise = min(1.0, (self.iteration + 1) / 200)
        fall = 0.5 + 0.5 * math.cos(math.pi * self.iteration / self.settings["iterations"])
        return self.settings["learning_rate"] * rise * fall

    def step(self):
        """One batch; returns its loss and accuracy."""
        s, data = self.settings, self.train
        if s.get("balance"):
            chosen = balanced_batch(s["seed"], self.iteration, data.present)
        else:
            chosen = training_batch(s["seed"], self.iteration, len(data))
        images, x, y, d = data.images(chosen), data.x[chosen], data.y[chosen], data.d[chosen]
        if s["augment"]:
            images, x, y, d = augmented(s["seed"], self.iteration, images, x, y, d)
        present, x, y, d = (torch.from_numpy(a).to(self.device) for a in (data.present[chosen], x, y, d))
        self.network.train()
        torch.manual_seed(s["seed"] * 1_000_003 + self.iteration)  # dropout's only source
        scores, geometry = self.outputs(self.tensor(images), s["dropout"])
        scores = scores + self.odds
        class_loss, geometry_loss = self.losses(scores, geometry, present, x, y, d)
        (class_loss + 0.25 * geometry_loss).backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 5.0)
        self.optimizer.step(self.learning_rate())
        self.iteration += 1
        return class_loss.item(), (scores.argmax(1) == present.long()).float().mean().item()

    @torch.no_grad()
    def evaluate(self):
        """The whole test part, 83 batches of the paper's 4,110 images."""
        self.network.eval()
        data, scores, geometry = self.test, [], []
        for first in range(0, len(data), BATCH):
            s, g = self.outputs(self.tensor(data.images(range(first, min(len(data), first + BATCH)))))
            scores.append(s.cpu())
            geometry.append(g.cpu())
        scores, geometry = torch.cat(scores), torch.cat(geometry).numpy()
        present = data.present > 0
        found = (scores.argmax(1) == 1).numpy()
        d = np.exp(geometry[:, 2]) * SIZE_UNIT_PX
        off = np.hypot(geometry[:, 0] * 128 + 127.5 - data.x, geometry[:, 1] * 128 + 127.5 - data.y)
        return {
            "test_loss": F.cross_entropy(scores, torch.from_numpy(data.present).long()).item(),
            "test_accuracy": float((found == present).mean()),
            "misses": int((~found & present).sum()),
            "false_positives": int((found & ~present).sum()),
            "d_error_median": float(np.median(np.abs(d[present] / data.d[present] - 1))),
            "centre_error_median_px": float(np.median(off[present])),
        }

    def state(self):
        return {"iteration": self.iteration, "network": self.network.state_dict(), "mean": self.mean,
                "optimizer": self.optimizer.state_dict(), "settings": self.settings}

    def start_from(self, state):
        """Takes over the weights of a train.py run, or the convolutions of a pretrain.py run."""
        weights = state["network"]
        if not any(name.startswith("network.") for name in weights):
            self.network.load_state_dict(weights)
            return
        names = {name.replace("network.", "", 1): name for name in weights}
        kept = {k: weights[name] for k, name in names.items() if k.startswith(("convs.", "norms."))}
        self.network.load_state_dict(kept, strict=False)

    def restore(self, state):
        self.network.load_state_dict(state["network"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.iteration, self.mean = state["iteration"], state["mean"]


def settings_file(folder):
    return folder / "run.json"


def settings_of(folder, make):
    """Of the run in `folder`; those of make() if it is a new one, kept in run.json."""
    file = settings_file(folder)
    if file.exists():
        return json.loads(file.read_text())
    settings = make()
    folder.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(settings, indent=2) + "\n")
    return settings


def make_repeatable(threads):
    """The same sums in the same order in every run, on a GPU too."""
    torch.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)
    torch.utils.deterministic.fill_uninitialized_memory = False  # a debugging aid that costs a tenth of the time
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")


def latest(folder, device):
    """The state that a run was left in, or None."""
    file = folder / "latest.pt"
    return torch.load(file, map_location=device, weights_only=True) if file.exists() else None


def save(state, path):
    """Whole or not at all: a run may be stopped at any time."""
    torch.save(state, f"{path}.part")
    os.replace(f"{path}.part", path)


def open_log(path, iteration, columns=LOG):
    """log.csv without rows later than `iteration`, ready to append to."""
    rows = []
    if path.exists():
        with open(path, newline="") as file:
            rows = [row for row in csv.DictReader(file) if int(row["iteration"]) <= iteration]
    file = open(path, "w", newline="")
    log = csv.DictWriter(file, columns)
    log.writeheader()
    log.writerows(rows)
    file.flush()
    return file, log


def run(trainer, folder, until, log_every=50, test_every=1000, snapshot_every=1000, latest_every=200):
    file, log = open_log(folder / "log.csv", trainer.iteration)
    per_epoch = (len(trainer.train) + BATCH - 1) // BATCH
    start, sums, counted = time.monotonic(), [0.0, 0.0], 0
    while trainer.iteration < until:
        loss, accuracy = trainer.step()
        sums, counted = [sums[0] + loss, sums[1] + accuracy], counted + 1
        n = trainer.iteration
        tested = n % test_every == 0 or n == trainer.settings["iterations"]
        if n % log_every == 0 or tested:
            row = {"iteration": n, "epoch": f"{n / per_epoch:.3f}", "learning_rate": f"{trainer.learning_rate():.3e}",
                   "train_loss": f"{sums[0] / counted:.5f}", "train_accuracy": f"{sums[1] / counted:.5f}",
                   "seconds": f"{time.monotonic() - start:.1f}"}
            if tested:
                row.update({k: f"{v:.5f}" if isinstance(v, float) else v for k, v in trainer.evaluate().items()})
            log.writerow(row)
            file.flush()
            print(" ".join(f"{k} {row[k]}" for k in LOG if k in row), flush=True)
            sums, counted = [0.0, 0.0], 0
        if n % snapshot_every == 0 or n == trainer.settings["iterations"]:
            save(trainer.state(), folder / f"snapshot-{n:06d}.pt")
        if n % latest_every == 0 or n == until:
            save(trainer.state(), folder / "latest.pt")
    file.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="the run's folder; one that exists is resumed with its own settings")
    parser.add_argument("--network", choices=["lite", "paper"], default="lite")
    parser.add_argument("--train", action="append", metavar="SET", help="a set whose training part to use; repeatable")
    parser.add_argument("--test", metavar="SET", help="the set whose test part to use (default: the first --train)")
    parser.add_argument("--iterations", type=int, default=30000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--start", metavar="RUN", help="a run to begin with: of pretrain.py, its convolutions; of train.py, all")
    parser.add_argument("--learning-rate", type=float, default=1e-2)
    parser.add_argument("--weight-decay", type=float, default=0.02)
    parser.add_argument("--dropout", type=float, default=0.0, help="in the fully connected layers")
    parser.add_argument("--balance", action="store_true", help="half of each batch targets; scores for the set's share")
    parser.add_argument("--augment", action="store_true", help="turn, mirror, shift, brighten")
    parser.add_argument("--normalise", action="store_true", help="contrast normalisation in place of the training mean")
    parser.add_argument("--precision", choices=["fp32", "bf16"], default="fp32")
    parser.add_argument("--device", choices=["auto", "cpu", "cuda"], default="auto")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--until", type=int, help="stop at this iteration, to be resumed")
    arguments = parser.parse_args()
    folder = pathlib.Path(arguments.run)

    def new_settings():
        if not arguments.train:
            parser.error("a new run needs --train")
        names = ["network", "iterations", "seed", "learning_rate", "weight_decay", "dropout", "balance", "augment",
                 "normalise", "precision"]
        settings = {name: getattr(arguments, name) for name in names}
        settings["train"] = [os.path.abspath(path) for path in arguments.train]
        settings["test"] = os.path.abspath(arguments.test or arguments.train[0])
        settings["start"] = arguments.start and os.path.abspath(arguments.start)
        settings["manifests"] = [NavSet(path).manifest for path in [*settings["train"], settings["test"]]]
        return settings

    settings = settings_of(folder, new_settings)
    make_repeatable(arguments.threads)
    device = arguments.device if arguments.device != "auto" else "cuda" if torch.cuda.is_available() else "cpu"
    train = Samples([NavSet(path) for path in settings["train"]], "train")
    test = Samples([NavSet(settings["test"])], "test")
    trainer = Trainer(settings, train, test, device)
    if state := latest(folder, device):
        trainer.restore(state)
    elif settings.get("start"):
        start = latest(pathlib.Path(settings["start"]), device)
        if start is None:
            raise SystemExit(f"train.py: {settings['start']} has no latest.pt: name a run of pretrain.py or train.py by --start, and "
                             f"remove {settings_file(folder)}, which remembers this one")
        trainer.start_from(start)
    parameters, macs = size_of(trainer.network)
    print(f"{settings['network']}: {parameters / 1e6:.2f} M parameters, {macs / 1e6:.0f} MMAC; {len(train)} training and "
          f"{len(test)} test images; {device}, {arguments.threads} threads; from iteration {trainer.iteration}", flush=True)
    run(trainer, folder, min(arguments.until or settings["iterations"], settings["iterations"]))


if __name__ == "__main__":
    main()
