#!/usr/bin/env python3
"""Berth's `simd` beside OpenVINO int8, ONNX Runtime int8 and ncnn on networks of the sizes of `lite` and `paper`, in one run.

Weights are random: time does not depend on them. Each engine gets the same layers and a window of 256 x 256; int8 ones
read one ONNX file with quantised layers (onnxruntime.quantization, per channel), ncnn's wheel has no tool for int8 and
runs in float. Engines take turns, one process at a time; the figures are medians over the rounds, `least` is the least of
all passes. Processor time is that of all threads, waiting ones too: on a busy machine the one to compare, by one thread.

  python3 -m venv venv && venv/bin/pip install openvino onnxruntime onnx ncnn numpy sympy
  venv/bin/python bench/compare_networks.py [--network lite] [--rounds 9]
"""
import argparse
import os
import pathlib
import platform
import statistics
import struct
import subprocess
import sys
import tempfile
import time

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "training"))
import model_file  # noqa: E402

SIDE = 256
# channels, kernel, stride, pad, groups, pool; then the fully connected layers (training/model.py).
NETWORKS = {
    "lite": ([(32, 8, 4, 0, 1, True), (64, 5, 1, 2, 1, True), (96, 3, 1, 1, 1, False), (96, 3, 1, 1, 1, False),
              (64, 3, 1, 1, 1, True)], [256, 64, 5]),
    "paper": ([(96, 11, 4, 0, 1, True), (256, 5, 1, 2, 2, True), (384, 3, 1, 1, 1, False), (384, 3, 1, 1, 2, False),
               (256, 3, 1, 1, 2, True)], [4096, 4096, 5]),
}
ALPHA, BETA = 1e-4, 0.75


def shapes(convolutions):
    """(inputs, side before, side after the convolution, side after pooling) of each."""
    inputs, side = 1, SIDE
    for channels, kernel, stride, pad, _, pool in convolutions:
        after = (side + 2 * pad - kernel) // stride + 1
        pooled = (after - 3) // 2 + 1 if pool else after
        yield inputs, side, after, pooled
        inputs, side = channels, pooled


def weights_of(name):
    """Float weights and biases, layer by layer."""
    random = np.random.default_rng(1)
    convolutions, full = NETWORKS[name]
    layers = []
    for (channels, kernel, _, _, groups, _), (inputs, _, _, pooled) in zip(convolutions, shapes(convolutions)):
        fan = inputs // groups * kernel * kernel
        layers.append((random.normal(0, (2 / fan)**0.5, (channels, inputs // groups, kernel, kernel)).astype(np.float32),
                       random.normal(0, 0.1, channels).astype(np.float32)))
        size = channels * pooled * pooled
    for outputs in full:
        layers.append((random.normal(0, (2 / size)**0.5, (outputs, size)).astype(np.float32),
                       random.normal(0, 0.1, outputs).astype(np.float32)))
        size = outputs
    return layers


def write_onnx(name, path):
    import onnx
    from onnx import TensorProto, helper, numpy_helper
    convolutions, _ = NETWORKS[name]
    nodes, constants, x = [], [], "image"

    def node(op, inputs, **attributes):
        nodes.append(helper.make_node(op, inputs, [f"t{len(nodes)}"], f"{op}_{len(nodes)}", **attributes))
        return nodes[-1].output[0]

    def constant(value):
        constants.append(numpy_helper.from_array(value, f"w{len(constants)}"))
        return constants[-1].name

    layers = weights_of(name)
    for (_, kernel, stride, pad, groups, pool), (weights, bias) in zip(convolutions, layers):
        x = node("Conv", [x, constant(weights), constant(bias)], kernel_shape=[kernel] * 2, strides=[stride] * 2,
                 pads=[pad] * 4, group=groups)
        x = node("LRN", [node("Relu", [x])], size=5, alpha=ALPHA, beta=BETA, bias=1.0)
        if pool:
            x = node("MaxPool", [x], kernel_shape=[3, 3], strides=[2, 2])
    x = node("Flatten", [x])
    for i, (weights, bias) in enumerate(layers[len(convolutions):]):
        x = node("Gemm", [x, constant(weights), constant(bias)], transB=1)
        if i + len(convolutions) + 1 < len(layers):
            x = node("Relu", [x])
    image = helper.make_tensor_value_info("image", TensorProto.FLOAT, [1, 1, SIDE, SIDE])
    output = helper.make_tensor_value_info(x, TensorProto.FLOAT, [1, 5])
    graph = helper.make_graph(nodes, name, [image], [output], constants)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8), path)


def quantise(source, path):
    from onnxruntime.quantization import CalibrationDataReader, QuantFormat, QuantType, quantize_static

    class Pictures(CalibrationDataReader):
        def __init__(self):
            random = np.random.default_rng(2)
            self.left = [random.normal(0, 1, (1, 1, SIDE, SIDE)).astype(np.float32) for _ in range(4)]

        def get_next(self):
            return {"image": self.left.pop()} if self.left else None

    quantize_static(source, path, Pictures(), quant_format=QuantFormat.QDQ, per_channel=True,
                    activation_type=QuantType.QUInt8, weight_type=QuantType.QInt8)


def write_ncnn(name, stem):
    convolutions, full = NETWORKS[name]
    layers = weights_of(name)
    lines, blobs = ["Input image 0 1 image 0=256 1=256 2=1"], b""
    last = "image"

    def add(kind, fields):
        nonlocal last
        to = f"t{len(lines)}"
        lines.append(f"{kind} l{len(lines)} 1 1 {last} {to} {fields}")
        last = to

    for (channels, kernel, stride, pad, groups, pool), (weights, bias) in zip(convolutions, layers):
        kind, group = ("Convolution", "") if groups == 1 else ("ConvolutionDepthWise", f" 7={groups}")
        add(kind, f"0={channels} 1={kernel} 3={stride} 4={pad} 5=1 6={weights.size}{group} 9=1")
        blobs += struct.pack("<I", 0) + weights.tobytes() + bias.tobytes()
        add("LRN", f"0=0 1=5 2={ALPHA} 3={BETA}")
        if pool:
            add("Pooling", "0=0 1=3 2=2 5=1")
    for i, (weights, bias) in enumerate(layers[len(convolutions):]):
        add("InnerProduct", f"0={len(bias)} 1=1 2={weights.size}" + (" 9=1" if i + 1 < len(full) else ""))
        blobs += struct.pack("<I", 0) + weights.tobytes() + bias.tobytes()
    pathlib.Path(stem + ".param").write_text(
        "\n".join(["7767517", f"{len(lines)} {len(lines)}", *lines]) + "\n")
    pathlib.Path(stem + ".bin").write_bytes(blobs)
    return last


def write_berth(name, path):
    convolutions, full = NETWORKS[name]
    random = np.random.default_rng(3)

    def signed(*shape):
        return random.integers(-127, 128, shape, dtype=np.int8)

    def requantisation(outputs, terms):
        # Sums of random products have this deviation; activations then fill 0 to 127 about half.
        shift = max(0, int(np.log2(terms**0.5 * 73 * 60)) - 13)
        multiplier = int(np.clip(2**22 * 40 / (terms**0.5 * 73 * 60 / 2**shift), 1, 32767))
        return np.zeros(outputs, np.int32), np.full(outputs, multiplier, np.int32), shift

    # The table of two segments of docs/network-arithmetic.md for activations of 1/16.
    sums = [32 * i for i in range(64)] + [1024 * (i - 62) for i in range(64, 103)]
    table = np.array([round(2**14 * (1 + ALPHA / 5 * 2 * s / 256)**-BETA) for s in sums] + [0], np.int32)
    layers = []
    for (channels, kernel, stride, pad, groups, pool), (inputs, _, _, pooled) in zip(convolutions, shapes(convolutions)):
        if inputs == 1:  # four pixels a word
            weights = signed(channels, 4, kernel, -(-kernel // 4))
            steps, pads = (stride, stride // 4), (pad, pad // 4)
        else:
            weights, steps, pads = signed(channels, inputs // groups, kernel, kernel), (stride, stride), (pad, pad)
        bias, multiplier, shift = requantisation(channels, weights[0].size)
        layers.append(model_file.Convolve(weights, bias, multiplier, shift, steps, pads, groups))
        layers.append(model_file.LocalResponseNorm(table))
        if pool:
            layers.append(model_file.MaxPool(3, 2))
    size, grid = channels, pooled
    for outputs in full[:-1]:
        weights = signed(outputs, grid, grid, size)
        layers.append(model_file.FullyConnected(weights, *requantisation(outputs, weights[0].size)))
        size, grid = outputs, 1
    layers.append(model_file.Heads(signed(full[-1], size), np.zeros(full[-1], np.int32)))
    logistic = np.array([round(32768 / (1 + np.exp(-z / 256))) for z in range(-2048, 2048)], np.uint16)
    model_file.write(model_file.Model(name, "random weights", 1, 0, layers, [(1, 20)] * 4, logistic), path)


class Berth:
    def __init__(self, threads, name, folder, program):
        self.command = [program, f"{folder}/{name}.berthnet", "--threads", str(threads), "--runs"]

    def run(self, runs):
        out = subprocess.run([*self.command, str(runs)], check=True, capture_output=True, text=True).stdout
        return tuple(map(float, out.split()[1:4]))


def timed(call, runs):
    """Median and least wall time, median processor time, ms; the runs for the latter warm up."""
    def once(clock):
        start = clock()
        call()
        return 1e3 * (clock() - start)

    processor = [once(time.process_time) for _ in range(runs)]
    wall = [once(time.perf_counter) for _ in range(runs)]
    return statistics.median(wall), min(wall), statistics.median(processor)


class OpenVino:
    def __init__(self, threads, name, folder, _):
        import openvino
        core = openvino.Core()
        self.request = core.compile_model(f"{folder}/{name}-int8.onnx", "CPU", {
            "INFERENCE_NUM_THREADS": threads, "NUM_STREAMS": 1, "PERFORMANCE_HINT": "LATENCY"}).create_infer_request()
        self.image = np.random.default_rng(4).normal(0, 1, (1, 1, SIDE, SIDE)).astype(np.float32)
        self.request.infer({0: self.image})

    def run(self, runs):
        return timed(self.request.infer, runs)


class OnnxRuntime:
    def __init__(self, threads, name, folder, _):
        import onnxruntime
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.inter_op_num_threads = 1
        self.session = onnxruntime.InferenceSession(f"{folder}/{name}-int8.onnx", options, ["CPUExecutionProvider"])
        self.image = np.random.default_rng(4).normal(0, 1, (1, 1, SIDE, SIDE)).astype(np.float32)

    def run(self, runs):
        return timed(lambda: self.session.run(None, {"image": self.image}), runs)


class Ncnn:
    def __init__(self, threads, name, folder, _):
        import ncnn
        self.ncnn = ncnn
        self.net = ncnn.Net()
        self.net.opt.num_threads = threads
        self.net.load_param(f"{folder}/{name}.param")
        self.net.load_model(f"{folder}/{name}.bin")
        self.last = pathlib.Path(f"{folder}/{name}.last").read_text()
        self.image = ncnn.Mat(np.random.default_rng(4).normal(0, 1, (1, SIDE, SIDE)).astype(np.float32))

    def once(self):
        extractor = self.net.create_extractor()
        extractor.input("image", self.image)
        return extractor.extract(self.last)

    def run(self, runs):
        return timed(self.once, runs)


ENGINES = {"Berth simd int8": Berth, "OpenVINO int8": OpenVino, "ONNX Runtime int8": OnnxRuntime, "ncnn float": Ncnn}


def processor():
    text = pathlib.Path("/proc/cpuinfo").read_text() if pathlib.Path("/proc/cpuinfo").exists() else ""
    fields = dict(line.split("\t: ", 1) for line in text.replace("\t\t", "\t").splitlines() if "\t: " in line)
    flags = fields.get("flags", "").split()
    vnni = [f for f in ("avx512_vnni", "avx_vnni") if f in flags]
    return (f"{fields.get('model name', platform.processor())}, family {fields.get('cpu family')} model "
            f"{fields.get('model')}, {os.cpu_count()} cores; VNNI: {', '.join(vnni) or 'none'}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--network", action="append", choices=list(NETWORKS))
    parser.add_argument("--rounds", type=int, default=9)
    parser.add_argument("--runs", type=int, default=20, help="an engine's passes a turn, after as many to warm up")
    parser.add_argument("--threads", type=int, action="append")
    parser.add_argument("--program", default=str(ROOT / "build/release/network_time"))
    arguments = parser.parse_args()
    print(f"{processor()}; load at the start {os.getloadavg()[0]:.1f}\n")
    print("| network | threads | engine | ms | least | processor ms | of OpenVINO's | by processor time |\n"
          "|---|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.network or NETWORKS:
            write_onnx(name, f"{folder}/{name}.onnx")
            quantise(f"{folder}/{name}.onnx", f"{folder}/{name}-int8.onnx")
            pathlib.Path(f"{folder}/{name}.last").write_text(write_ncnn(name, f"{folder}/{name}"))
            write_berth(name, f"{folder}/{name}.berthnet")
            for threads in arguments.threads or [1, 2]:
                engines, missing = {}, {}
                for title, kind in ENGINES.items():
                    try:
                        engines[title] = kind(threads, name, folder, arguments.program)
                    except ImportError as error:
                        missing[title] = str(error)
                times = {title: [] for title in engines}
                for _ in range(arguments.rounds):
                    for title, engine in engines.items():
                        times[title].append(engine.run(arguments.runs))
                results = {title: (statistics.median(v[0] for v in values), min(v[1] for v in values),
                                   statistics.median(v[2] for v in values)) for title, values in times.items()}
                rival = results.get("OpenVINO int8")
                for title, (wall, least, cpu) in results.items():
                    ratios = f"{wall / rival[0]:.2f} | {cpu / rival[2]:.2f}" if rival else "- | -"
                    print(f"| {name} | {threads} | {title} | {wall:.3f} | {least:.3f} | {cpu:.3f} | {ratios} |", flush=True)
                for title, why in missing.items():
                    print(f"| {name} | {threads} | {title} | not installed: {why} | | | | |", flush=True)


if __name__ == "__main__":
    main()
