#!/usr/bin/env python3
"""Teaches a network's convolutions on small crops, before `train.py --start` trains the whole.

A crop of 128 x 128 px costs a quarter of an image and shows what matters: the subject, at full size or, where it is
large, at half. Two heads of its own judge it, both dropped afterwards: one says whether the target is there, the other
says so at every place of the last map, which tells the convolutions where to look. In the same time the loss falls
several times further than on whole images (README.md).

A run lives in a folder: run.json, log.csv, latest.pt every 200 iterations. The same command again resumes it, exactly."""
import argparse
import math
import os
import pathlib
import time

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

from batches import SPREAD, Samples
from model import Network
from muon import Optimizer
from navset import NavSet
from train import INPUT_SCALE, latest, make_repeatable, open_log, save, settings_of

SIDE = 128
BATCH = 100
LARGE_PX = 90  # a target larger than this is shown at half size
HALVED = 0.35  # share of the negatives shown so
JITTER_PX = 12
HIDDEN = 128
PLACE_WEIGHT = 0.1
WEIGHT_DECAY = 0.02
LOG = ["iteration", "learning_rate", "loss", "place_loss", "accuracy", "seconds"]


class CropNetwork(nn.Module):
    """The convolutions of a Network with two heads for crops."""

    def __init__(self, name):
        super().__init__()
        self.network = Network(name)
        channels = self.network.specs[-1].channels
        side, self.first, self.spacing = SIDE, 0.0, 1
        for i, spec in enumerate(self.network.specs):
            side = (side + 2 * spec.pad - spec.kernel) // spec.stride + 1
            self.first += self.spacing * ((spec.kernel - 1) / 2 - spec.pad)
            self.spacing *= spec.stride
            if i == len(self.network.specs) - 1:
                self.cells = side
            if spec.pool:
                side = (side - 3) // 2 + 1
                if i < len(self.network.specs) - 1:
                    self.first += self.spacing
                    self.spacing *= 2
        self.place = nn.Conv2d(channels, 1, 1)
        nn.init.normal_(self.place.weight, std=0.01)
        nn.init.constant_(self.place.bias, -4.0)  # most places show no target
        self.hidden = nn.Linear(channels * side * side, HIDDEN)
        self.score = nn.Linear(HIDDEN, 2)

    def forward(self, x):
        """Scores float[n, 2] and the logits of places float[n, cells, cells]."""
        network = self.network
        for spec, conv, norm in zip(network.specs, network.convs, network.norms):
            x = F.relu(norm(conv(x)))  # no response normalisation: it changes next to nothing here, for a fifth of the time
            last = x
            if spec.pool:
                x = F.max_pool2d(x, 3, 2)
        return self.score(F.relu(self.hidden(x.flatten(1)))), self.place(last)[:, 0]

    def centres(self):
        """Of the last map's cells, px of the crop."""
        return self.first + self.spacing * torch.arange(self.cells)


def halved(image):
    wide = image.astype(np.uint16)
    return ((wide[::2, ::2] + wide[1::2, ::2] + wide[::2, 1::2] + wide[1::2, 1::2] + 2) >> 2).astype(np.uint8)


def crops(random, samples, chosen):
    """u8[n, 128, 128], and x, y, d (px of the crop), of images `chosen`: turned and mirrored at random."""
    images = samples.images(chosen)
    out = np.empty((len(chosen), SIDE, SIDE), np.uint8)
    places = np.zeros((3, len(chosen)), np.float32)
    for k, (index, image) in enumerate(zip(chosen, images)):
        present = samples.present[index] > 0
        x, y, d = samples.x[index], samples.y[index], samples.d[index]
        small = d > LARGE_PX if present else random.random() < HALVED
        if small:
            image, x, y, d = halved(image), (x - 0.5) / 2, (y - 0.5) / 2, d / 2
        else:
            left, top = SIDE // 2 + random.integers(-JITTER_PX, JITTER_PX + 1, 2)
            image, x, y = image[top:top + SIDE, left:left + SIDE], x - left, y - top
        if random.integers(2):
            image, x = image[:, ::-1], SIDE - 1 - x
        for _ in range(random.integers(4)):  # counter-clockwise
            image, x, y = np.rot90(image), y, SIDE - 1 - x
        out[k] = image
        if present:
            places[:, k] = x, y, d
    return out, places


def stretched(images):
    """float32[n, 1, 128, 128]: contrast normalisation as batches.normalised, in floats."""
    x = images.reshape(len(images), -1).astype(np.float32)
    spread = np.maximum(1, x.std(1, keepdims=True))
    x = (x - x.mean(1, keepdims=True)) * np.clip(SPREAD / spread, 0.5, 8)
    return (np.clip(x, -128, 127) * INPUT_SCALE).reshape(len(images), 1, SIDE, SIDE)


def place_loss(logits, centres, present, x, y, d):
    """Cross entropy over the cells, summed over each crop. A cell near the target's middle is to say yes (at least one
    is), one further out but still on it may say what it likes."""
    off = torch.hypot(centres[None, None, :] - x[:, None, None], centres[None, :, None] - y[:, None, None])
    there = present[:, None, None] > 0
    yes = there & (off < torch.clamp(0.2 * d, min=11.4)[:, None, None])
    either = there & ~yes & (off < torch.clamp(0.5 * d, min=24.0)[:, None, None])
    loss = F.binary_cross_entropy_with_logits(logits, yes.float(), reduction="none")
    return (loss * ~either).sum((1, 2)).mean()


class Pretrainer:
    def __init__(self, settings, samples, device):
        self.settings, self.samples, self.device = settings, samples, device
        torch.manual_seed(settings["seed"])
        self.network = CropNetwork(settings["network"]).to(device, memory_format=torch.channels_last)
        outputs = [self.network.score, self.network.place]
        self.optimizer = Optimizer(self.network, outputs, settings["learning_rate"], WEIGHT_DECAY)
        self.iteration = 0

    def learning_rate(self):
        rise = min(1.0, (self.iteration + 1) / 100)
        fall = 0.5 + 0.5 * math.cos(math.pi * self.iteration / self.settings["iterations"])
        return self.settings["learning_rate"] * max(0.01, rise * fall)

    def step(self):
        """One batch; returns class loss, place loss, accuracy."""
        random = np.random.default_rng([self.settings["seed"], 3, self.iteration])
        chosen = random.integers(0, len(self.samples), BATCH)
        images, places = crops(random, self.samples, chosen)
        x = torch.from_numpy(stretched(images)).to(self.device).contiguous(memory_format=torch.channels_last)
        present = torch.from_numpy(self.samples.present[chosen]).to(self.device)
        self.network.train()
        scores, logits = self.network(x)
        class_loss = F.cross_entropy(scores, present.long())
        places = torch.from_numpy(places).to(self.device)
        where = place_loss(logits, self.network.centres().to(self.device), present, *places)
        (class_loss + PLACE_WEIGHT * where).backward()
        self.optimizer.step(self.learning_rate())
        self.iteration += 1
        return class_loss.item(), where.item(), (scores.argmax(1) == present.long()).float().mean().item()

    def state(self):
        return {"iteration": self.iteration, "network": self.network.state_dict(),
                "optimizer": self.optimizer.state_dict(), "settings": self.settings}

    def restore(self, state):
        self.network.load_state_dict(state["network"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.iteration = state["iteration"]


def run(pretrainer, folder, until, log_every=50, latest_every=200):
    file, log = open_log(folder / "log.csv", pretrainer.iteration, LOG)
    start, sums = time.monotonic(), np.zeros(3)
    while pretrainer.iteration < until:
        sums += pretrainer.step()
        n = pretrainer.iteration
        if n % log_every == 0:
            loss, place, accuracy = sums / log_every
            row = {"iteration": n, "learning_rate": f"{pretrainer.learning_rate():.3e}", "loss": f"{loss:.5f}",
                   "place_loss": f"{place:.5f}", "accuracy": f"{accuracy:.5f}",
                   "seconds": f"{time.monotonic() - start:.1f}"}
            log.writerow(row)
            file.flush()
            print(" ".join(f"{k} {row[k]}" for k in LOG), flush=True)
            sums[:] = 0
        if n % latest_every == 0 or n == until:
            save(pretrainer.state(), folder / "latest.pt")
    file.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="the run's folder; one that exists is resumed with its own settings")
    parser.add_argument("--network", choices=["lite", "paper"], default="lite")
    parser.add_argument("--train", action="append", metavar="SET", help="a set whose training part to use; repeatable")
    parser.add_argument("--iterations", type=int, default=8000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--learning-rate", type=float, default=1.2e-2)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--until", type=int, help="stop at this iteration, to be resumed")
    arguments = parser.parse_args()
    folder = pathlib.Path(arguments.run)

    def new_settings():
        if not arguments.train:
            parser.error("a new run needs --train")
        settings = {name: getattr(arguments, name) for name in ("network", "iterations", "seed", "learning_rate")}
        settings["train"] = [os.path.abspath(path) for path in arguments.train]
        settings["manifests"] = [NavSet(path).manifest for path in settings["train"]]
        return settings

    settings = settings_of(folder, new_settings)
    make_repeatable(arguments.threads)
    samples = Samples([NavSet(path) for path in settings["train"]], "train")
    pretrainer = Pretrainer(settings, samples, "cuda" if torch.cuda.is_available() else "cpu")
    if state := latest(folder, pretrainer.device):
        pretrainer.restore(state)
    print(f"{settings['network']}: crops of {len(samples)} images; from iteration {pretrainer.iteration}", flush=True)
    run(pretrainer, folder, min(arguments.until or settings["iterations"], settings["iterations"]))


if __name__ == "__main__":
    main()
