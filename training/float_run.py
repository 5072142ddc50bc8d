"""A trained run as it goes into quantisation: its newest weights without batch normalisation, step by step."""
import json
import pathlib

import torch

from float_network import Connected, Convolution, FloatNetwork, Heads, Norm, Pool
from model import SIDE, Network
from train import INPUT_SCALE


def weighted_modules(network):
    """Convolutions and fully connected layers by step, without the heads."""
    return {**{f"conv{i}": conv for i, conv in enumerate(network.convs, 1)},
            **{f"fc{i}": layer for i, layer in enumerate(network.hidden, len(network.convs) + 1)}}


def layers_of(network):
    """A Network without batch normalisation, layer by layer, with its weights of now."""
    layers, side = [], SIDE
    for i, (spec, conv) in enumerate(zip(network.specs, network.convs), 1):
        weights, bias = conv.weight.detach(), conv.bias.detach()
        layers.append(Convolution(f"conv{i}", weights, bias, (spec.stride,) * 2, (spec.pad,) * 2, spec.groups))
        layers.append(Norm(f"norm{i}", network.lrn.alpha * 5))
        side = (side + 2 * spec.pad - spec.kernel) // spec.stride + 1
        if spec.pool:
            layers.append(Pool(f"pool{i}", 3, 2))
            side = (side - 3) // 2 + 1
    for i, layer in enumerate(network.hidden, len(network.convs) + 1):
        weights = layer.weight.detach()
        layers.append(Connected(f"fc{i}", weights.reshape(len(weights), -1, side, side), layer.bias.detach()))
        side = 1
    heads = (network.score, network.geometry)
    layers.append(Heads("heads",
                        *(torch.cat([getattr(head, part).detach() for head in heads]) for part in ("weight", "bias"))))
    return layers


class FloatRun(FloatNetwork):
    def __init__(self, network, settings, mean, iteration, name, device="cpu"):
        self.network = network.eval().folded().to(device)
        super().__init__(layers_of(self.network), settings["normalise"], mean, INPUT_SCALE, name, device)
        self.settings, self.iteration = settings, iteration


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
