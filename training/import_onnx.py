#!/usr/bin/env python3
"""Brings another framework's classifier into Berth: NET.onnx, of Berth's layers, to NET.berthnet; says which layer it
cannot and why, and what the integers cost.

Two fifths of the images give the ranges of activations, two fifths choose how much of them to keep (quantise.py), the
last fifth is held back for the figures at the end."""
import argparse
import pathlib
import sys
import zlib
from fractions import Fraction

import numpy as np
import torch

import calibration_images
import model_file
import onnx_network
from float_network import FloatNetwork
from integer_network import IntegerNetwork
from onnx_graph import Unsupported
from quantisation import DoesNotFit, dequantised, signal_to_noise
from quantise import difference, layer_table, quantised_well

CLAMPED = 16  # grey levels that a padded first layer may lose at one end


def number(text):
    """A float from `0.45`, `1e-3` or `1/255`."""
    try:
        return float(Fraction(text))
    except (ValueError, ZeroDivisionError, OverflowError):
        raise argparse.ArgumentTypeError(f"'{text}' is no number such as 0.0039 or 1/255") from None


def network_of(imported, arguments, name):
    """FloatNetwork of what was imported, its input as the options say."""
    first, mean = imported.layers[0], 0.0 if arguments.normalise else arguments.mean
    scale = 1 / 64 if arguments.scale is None else arguments.scale
    if scale <= 0:
        raise ValueError(f"--scale is {scale:g}; it has to be above 0")
    if not arguments.normalise and max(first.pad) and abs(mean - 128) > CLAMPED:
        raise Unsupported(f"{first.name}: pads are {list(first.pad)} in the first layer, around images of mean {mean:g}: "
                          f"beyond the border is the mean, which has to be 128 +- {CLAMPED} for that; train it without "
                          "padding there, with such a mean, or on normalised windows")
    return FloatNetwork(imported.layers, arguments.normalise, mean, scale, name)


def compared(imported, network, image):
    """A line on how far the float network is from the graph on one image; ValueError if it is another network."""
    runtime, exact = imported.exact(network.input(image[None]).numpy())
    got = network.outputs(image[None])[0]
    off = float(np.abs(got - exact).max())
    if not off <= 1e-3 * (1 + np.abs(exact).max()):
        raise ValueError(f"the layers read give {got}, {runtime} {exact}: please report this network")
    return f"Float layers against {runtime}, one image: outputs at most {off:.2g} apart."


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("net", metavar="NET.onnx")
    parser.add_argument("--calibrate", required=True, metavar="DIR", help="a folder of pictures, or a navigation set")
    parser.add_argument("-o", "--output", required=True, metavar="OUT.berthnet")
    parser.add_argument("--mean", type=number, help="what was taken off grey levels (0 to 255) for the network's input")
    parser.add_argument("--scale", type=number, help="what they were multiplied by then, such as 1/255")
    parser.add_argument("--normalise", action="store_true", help="the input is a window brought to mean 0 and standard "
                        "deviation 48 as in batches.py, times --scale (default 1/64)")
    parser.add_argument("--name", help="the network's name in the file (default: the file's)")
    parser.add_argument("--images", type=int, default=750, help="at most so many of DIR")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    if arguments.normalise and arguments.mean is not None:
        parser.error("--normalise takes each window's own mean off: leave --mean out")
    if not arguments.normalise and (arguments.mean is None or arguments.scale is None):
        parser.error("what does the network take? --mean M --scale S for (grey - M) * S, or --normalise")
    torch.set_num_threads(arguments.threads)
    path = pathlib.Path(arguments.net)
    try:
        imported = onnx_network.read(path)
        network = network_of(imported, arguments, arguments.name or path.stem)
        images, present, words = calibration_images.load(arguments.calibrate, arguments.images, arguments.seed)
        print(f"{path}: {len(network.layers)} layers. Calibration: {words}.")
        for note in imported.notes:
            print(f"{note}.")
        print(compared(imported, network, images[0]), flush=True)
        fifth = len(images) // 5
        for_ranges, for_search, held_back = images[:2 * fifth], images[2 * fifth:4 * fifth], images[4 * fifth:]
        exact = network.outputs(images[2 * fifth:])
        targets = exact[:, 1] > exact[:, 0] if present is None else present[2 * fifth:]
        given = "windows' own mean and contrast" if arguments.normalise else f"grey - {arguments.mean:g}"
        notes = f"imported from {path.name} (CRC-32 {zlib.crc32(path.read_bytes()):08x}); input {given}, times " \
                f"{network.scale:.6g}; calibrated on {words}"
        quantised, methods, _, _ = quantised_well(network, for_ranges, for_search, targets[:2 * fifth], network.name, notes)
        print()
        for line in layer_table(quantised, methods, signal_to_noise(quantised, network, for_ranges[:50])):
            print(line)
        got = dequantised(quantised, IntegerNetwork(quantised.model).found(held_back).raw)
        found = difference(got, exact[2 * fifth:], targets[2 * fifth:])
        print(f"\nIntegers against floats, {len(held_back)} images held back, changed: {found}.")
        size = model_file.write(quantised.model, arguments.output)
        print(f"{arguments.output}: {size} bytes; {quantised.model.notes}")
    except (DoesNotFit, Unsupported, model_file.ModelError, OSError, ValueError) as error:
        sys.exit(f"import_onnx.py: {error}")


if __name__ == "__main__":
    main()
