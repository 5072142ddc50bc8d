"""A trained run as it goes into quantisation: its newest weights without batch normalisation, step by step."""
import json
import pathlib
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F

from batches import normalised
from model import Network
from train import INPUT_SCALE


@dataclass
class Step:
    """name and title of an integer layer, x: what comes out of it in float, sums: before ReLU, where there is one."""
    name: str
    x: torch.Tensor
    sums: torch.Tensor = None


class FloatRun:
    def __init__(self, network, settings, mean, iteration, name, device="cpu"):
        self.network = network.eval().folded().to(device)
        self.settings, self.mean, self.iteration, self.name, self.device = settings, mean, iteration, name, device

    def input(self, images):
        """float[n, 1, 256, 256] from u8[n, 256, 256], as in training."""
        grey = normalised(images) if self.settings["normalise"] else images
        x = torch.from_numpy(grey.astype(np.float32))
        return ((x - self.mean) * INPUT_SCALE)[:, None].to(self.device)

    @torch.no_grad()
    def steps(self, x):
        """One Step for each layer of the integer network."""
        network = self.network
        for i, (spec, conv) in enumerate(zip(network.specs, network.convs), 1):
            sums = conv(x)
            x = F.relu(sums)
            yield Step(f"conv{i}", x, sums)
            x = network.lrn(x)
            yield Step(f"norm{i}", x)
            if spec.pool:
                x = F.max_pool2d(x, 3, 2)
                yield Step(f"pool{i}", x)
        x = x.flatten(1)
        for i, layer in enumerate(network.hidden, len(network.convs) + 1):
            sums = layer(x)
            x = F.relu(sums)
            yield Step(f"fc{i}", x[:, :, None, None], sums[:, :, None, None])
        heads = torch.cat([network.score(x), network.geometry(x)], 1)[:, :, None, None]
        yield Step("heads", heads, heads)

    def outputs(self, images, batch=10, progress=None):
        """float64[n, 5]: two scores, three numbers of geometry."""
        out = []
        for first in range(0, len(images), batch):
            for step in self.steps(self.input(images[first:first + batch])):
                pass
            out.append(step.x.flatten(1).cpu().double().numpy())
            if progress:
                progress(min(len(images), first + batch))
        return np.concatenate(out)


def newest(folder):
    """Path of a run's latest state."""
    paths = [path for path in [folder / "latest.pt", *sorted(folder.glob("snapshot-*.pt"))] if path.exists()]
    if not paths:
        raise FileNotFoundError(f"{folder}: no latest.pt and no snapshots; train.py writes the first after 200 iterations")
    return max(paths, key=lambda path: path.stat().st_mtime)


def load(path, device="cpu"):
    """FloatRun of a run's folder (its newest state) or of one snapshot."""
    path = pathlib.Path(path)
    if not path.exists():
        raise FileNotFoundError(f"{path}: no such run or snapshot")
    folder = path if path.is_dir() else path.parent
    state = torch.load(newest(folder) if path.is_dir() else path, map_location="cpu", weights_only=True)
    settings = json.loads((folder / "run.json").read_text()) if (folder / "run.json").exists() else state["settings"]
    network = Network(settings["network"])
    network.load_state_dict(state["network"])
    return FloatRun(network, settings, state["mean"], state["iteration"], folder.name, device)
