#!/usr/bin/env python3
"""Turns a trained run into an integer network, RUN to NET.berthnet, and says what that costs.

Images of the sets' training parts give the ranges of activations; others of them choose, layer by layer, how much of a
range to keep (all, 99.99 %, 99.9 %, least squares), by how far scores and geometry move from the float network's."""
import argparse
import sys
from dataclasses import dataclass

import numpy as np
import torch

import float_network
import float_run
import model_file
from batches import Samples
from fine_tune import FineTuner, SimulatedNetwork
from integer_network import IntegerNetwork
from navset import NavSet
from progress import Progress
from quantisation import METHODS, Builder, DoesNotFit, Ranges, correct_biases, dequantised, signal_to_noise


@dataclass
class Difference:
    """Between integers and floats on the same images. logits: rms of the differences of present - absent, each held to
    +-8 (the ends of the score's table); geometry: rms in the network's units, on targets."""
    changed: int
    logits: float
    geometry: float

    @property
    def error(self):
        """To be made small; a tenth of a logit counts as much as 1.3 px of the centre or 1 % of d."""
        return self.logits + 10 * self.geometry

    def __str__(self):
        return f"{self.changed} decisions, logits {self.logits:.4f}, geometry {self.geometry:.5f}"


def difference(got, exact, targets):
    """got, exact: float64[n, 5 or 2]."""
    logits = [np.clip(heads[:, 1] - heads[:, 0], -8, 8) for heads in (got, exact)]
    changed = int(((logits[0] >= 0) != (logits[1] >= 0)).sum())
    rms = float(np.sqrt(np.mean((logits[0] - logits[1]) ** 2)))
    off = (got - exact)[targets, 2:]
    return Difference(changed, rms, float(np.sqrt(np.mean(off**2))) if off.size else 0.0)


def scaled(layers):
    """Names of the steps that have a sigma of their own."""
    return [layer.name for layer in layers if not isinstance(layer, (float_network.Pool, float_network.Heads))]


class Search:
    """Tries sigmas on images that gave no ranges."""

    def __init__(self, run, ranges, images, targets):
        self.run, self.ranges, self.images, self.targets = run, ranges, images, targets
        self.builder, self.exact = Builder(run, ranges), run.outputs(images)

    def sigmas(self, methods):
        """methods: by step. A norm's `same` is its input's sigma: nothing is rounded twice where it changes little."""
        out = {}
        for layer in self.run.layers:
            if layer.name in methods:
                method = methods[layer.name]
                sigma = sigma if method == "same" else self.ranges.sigma(layer.name, method)
                out[layer.name] = sigma
        return out

    def tried(self, methods, corrected=False):
        """(Quantised, Difference), or (None, None) where they do not fit."""
        try:
            quantised = self.builder.build(self.sigmas(methods))
        except DoesNotFit:
            return None, None
        if corrected:
            correct_biases(quantised, self.ranges)
        return quantised, self.measured(quantised)

    def measured(self, quantised):
        got = IntegerNetwork(quantised.model, self.run.device).found(self.images).raw
        return difference(dequantised(quantised, got), self.exact, self.targets)

    def names(self):
        return scaled(self.run.layers)

    def alternatives(self):
        """(step, method) pairs worth a try. A normalisation that takes less than a tenth off keeps its input's sigma."""
        largest, layers = self.ranges.largest, self.run.layers
        for before, layer in zip([None, *layers], layers):
            if layer.name not in self.names():
                continue
            if isinstance(layer, float_network.Norm) and largest[layer.name] > 0.9 * largest[before.name]:
                continue
            for method in METHODS:
                yield layer.name, method

    def best(self, report, progress=None):
        """The methods by step that came out best: the best one for all, then layer by layer."""
        names, tries = self.names(), []
        norms = {layer.name for layer in self.run.layers if isinstance(layer, float_network.Norm)}
        for method in METHODS:
            methods = {name: "same" if name in norms else method for name in names}
            _, found = self.tried(methods)
            report(f"| all {method} | {found or 'does not fit'} |")
            if found:
                tries.append((found.error, methods, found))
        if not tries:
            raise DoesNotFit(f"{self.run.name}: no method fits all layers; is this run trained?")
        error, methods, found = min(tries, key=lambda one: one[0])
        alternatives = list(self.alternatives())
        for k, (name, method) in enumerate(alternatives, 1):
            changed = {**methods, name: method}
            other = self.tried(changed)[1] if method != methods[name] else None
            if other and other.error < 0.99 * error:  # a hundredth is chance
                error, methods, found = other.error, changed, other
                report(f"| {name} {method} | {found} |")
            if progress:
                progress(k, len(alternatives))
        return methods


def chosen_images(folders, count, seed):
    """Samples of all training parts, and `count` of their indices by seed, targets as frequent as there."""
    samples = Samples([NavSet(folder) for folder in folders], "train")
    order = np.random.default_rng([seed, 4]).permutation(len(samples))
    if count > len(samples):
        raise ValueError(f"{count} images wanted, the sets' training parts have {len(samples)}")
    return samples, order[:count]


def layer_table(quantised, methods, noise):
    yield "| layer | greatest | by | shift | M | weights' greatest | dB so far | dB alone |"
    yield "|---|---|---|---|---|---|---|---|"
    for name, layer in zip(quantised.names, quantised.model.layers):
        greatest = "" if isinstance(layer, model_file.Heads) else f"{127 * quantised.sigmas[name]:.3g}"
        shift = multipliers = weights = ""
        if hasattr(layer, "shift"):
            shift, multipliers = layer.shift, f"{layer.multiplier.min()} to {layer.multiplier.max()}"
        if hasattr(layer, "weights"):
            top = np.abs(layer.weights.reshape(len(layer.weights), -1).astype(int)).max(1)
            weights = f"{top.min()} to {top.max()}"
        yield (f"| {name} | {greatest} | {methods.get(name, '')} | {shift} | {multipliers} | {weights} | "
               f"{noise[name][0]:.1f} | {noise[name][1]:.1f} |")


def notes_of(run, folders):
    """What the file says about its origin."""
    def sets(manifests):
        return ", ".join(f"{m['set']} seed {m['seed']} ({m['image_hash']})" for m in manifests if "seed" in m) or "unknown sets"

    manifests = run.settings.get("manifests", [])  # of the training sets, then of the test's
    trained, calibrated = sets(manifests[:-1] or manifests), sets(NavSet(folder).manifest for folder in folders)
    return (f"{run.settings['network']} of run {run.name}, iteration {run.iteration} of {run.settings['iterations']}, seed "
            f"{run.settings['seed']}; trained on {trained}; calibrated on {calibrated}")


def quantised_well(run, images, search_images, targets, name, notes):
    """(Quantised, methods by step, Ranges, Search or None) of a float network; prints the choice. images: for the ranges;
    search_images: for the choice of methods, of them `targets` show one. No search_images: least squares."""
    ranges, search = Ranges(run, images), None
    if len(search_images):
        print("\n| methods | changed against float |\n|---|---|", flush=True)
        search = Search(run, ranges, search_images, targets)
        methods = search.best(lambda line: print(line, flush=True), Progress("choosing", 1))
        sigmas = search.sigmas(methods)
    else:
        methods = {name: "least squares" for name in scaled(run.layers)}
        sigmas = {name: ranges.sigma(name, method) for name, method in methods.items()}
    builder = Builder(run, ranges)
    quantised = builder.build(sigmas, name, notes)
    plain = search.measured(quantised) if search else None
    correct_biases(quantised, ranges)
    if search:
        corrected = search.measured(quantised)
        print(f"| biases corrected | {corrected} |", flush=True)
        if corrected.error > plain.error:
            quantised = builder.build(sigmas, name, notes)
    return quantised, methods, ranges, search


def fine_tuned(run, quantised, samples, images, sigmas, arguments):
    """The network trained on with its rounding; `run` is left with the weights that came out."""
    scales = quantised.scales()
    simulated = SimulatedNetwork(run.network, quantised.sigmas, scales)
    for name, module in float_run.weighted_modules(run.network).items():  # start where the correction has left the biases
        layer = quantised.model.layers[quantised.names.index(name)]
        if name != "conv1" or run.settings["normalise"]:
            module.bias.data = torch.from_numpy(layer.bias * quantised.units[name]).to(module.bias)
    tuner = FineTuner(simulated, run.settings, run.mean, samples, arguments.fine_tune, arguments.learning_rate, run.device)
    before, after = tuner.tune(Progress("fine-tuning", arguments.fine_tune))
    print(f"\nFine-tuning, {arguments.fine_tune} iterations: loss {before:.5f} to {after:.5f}.")
    run.layers = float_run.layers_of(run.network)
    tuned = Builder(run, Ranges(run, images), scales)
    return tuned.build(sigmas, quantised.model.name, f"{quantised.model.notes}; fine-tuned {arguments.fine_tune} "
                       f"iterations at {arguments.learning_rate:g}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", help="a run's folder (its newest state), or one snapshot in it")
    parser.add_argument("--calibrate", action="append", required=True, metavar="SET", help="repeatable")
    parser.add_argument("-o", "--output", required=True, metavar="NET.berthnet")
    parser.add_argument("--name", help="the network's name in the file (default: the run's)")
    parser.add_argument("--images", type=int, default=300, help="for the ranges")
    parser.add_argument("--search-images", type=int, default=300,
                        help="for the choice of methods; 0: least squares everywhere")
    parser.add_argument("--fine-tune", type=int, default=0, metavar="N",
                        help="train on for N iterations with the integers' rounding, if too many decisions change")
    parser.add_argument("--learning-rate", type=float, default=2e-5, help="of --fine-tune")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--device", choices=["auto", "cpu", "cuda"], default="auto")
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    device = arguments.device if arguments.device != "auto" else "cuda" if torch.cuda.is_available() else "cpu"
    try:
        run = float_run.load(arguments.run, device)
        samples, order = chosen_images(arguments.calibrate, arguments.images + arguments.search_images, arguments.seed)
        for_ranges, for_search = order[:arguments.images], order[arguments.images:]
        print(f"{run.name}, iteration {run.iteration}; {len(for_ranges)} images for ranges, {len(for_search)} for the "
              "choice")
        search_images = samples.images(for_search) if len(for_search) else []
        quantised, methods, ranges, search = quantised_well(
            run, samples.images(for_ranges), search_images, samples.present[for_search] > 0, arguments.name or run.name,
            notes_of(run, arguments.calibrate))
        if arguments.fine_tune:
            sigmas = {name: quantised.sigmas[name] for name in methods}
            quantised = fine_tuned(run, quantised, samples, ranges.images, sigmas, arguments)
            if search:
                print(f"| fine-tuned | {search.measured(quantised)} |")
        print()
        for line in layer_table(quantised, methods, signal_to_noise(quantised, run, ranges.images[:50])):
            print(line)
        size = model_file.write(quantised.model, arguments.output)
        print(f"\n{arguments.output}: {size} bytes; {quantised.model.notes}")
    except (DoesNotFit, model_file.ModelError, FileNotFoundError, ValueError) as error:
        sys.exit(f"quantise.py: {error}")


if __name__ == "__main__":
    main()
