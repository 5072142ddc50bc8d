#!/usr/bin/env python3
"""What an integer network is worth on a set's test part, as Markdown: accuracy, misses and false positives by threshold,
d and range, centre, confusion by range, light, occlusion and subject; with --float RUN, what integers changed."""
import argparse
import sys
from dataclasses import dataclass

import numpy as np
import torch
from PIL import ImageDraw

import contact_sheet
import float_run
import model_file
from batches import BATCH
from integer_network import IntegerNetwork
from model import SIZE_UNIT_PX
from navset import NavSet
from progress import Progress

TARGET_M = 0.4  # the diameter that d stands for
THRESHOLDS = [t / 100 for t in range(40, 81, 5)]
RANGES_M = [0, 1, 1.5, 2, 3, 4, 6, np.inf]
VISIBLE = [0.5, 0.65, 0.8, 0.95, 0.9999, np.inf]


@dataclass
class Results:
    """Of n images: score 0 .. 1, centre and d in px, what is true of them, and the rows of their labels."""
    score: np.ndarray
    x: np.ndarray
    y: np.ndarray
    d: np.ndarray
    present: np.ndarray
    rows: list

    def column(self, name):
        return np.array([row[name] for row in self.rows])

    def counts(self, threshold, chosen=None):
        """(misses, targets, false positives, negatives) among `chosen`."""
        chosen = np.ones(len(self.score), bool) if chosen is None else chosen
        found, present = self.score[chosen] >= threshold, self.present[chosen]
        return int((~found & present).sum()), int(present.sum()), int((found & ~present).sum()), int((~present).sum())


def results(model, navset, indices, device="cpu", progress=None):
    """Results of the network on a set's images; d and centre are NaN for one without geometry."""
    network, raw = IntegerNetwork(model, device), []
    for first in range(0, len(indices), BATCH):
        raw.append(network.found(navset.images[indices[first:first + BATCH]]))
        if progress:
            progress(min(len(indices), first + BATCH))
    rows = [navset.labels[i] for i in indices]

    def all_of(name, unit):
        parts = [getattr(part, name) for part in raw]
        return np.full(len(rows), np.nan) if parts[0] is None else np.concatenate(parts) / unit

    present = np.array([row["class"] == 1 for row in rows])
    x, y, d = (all_of(name, 2.0**16) for name in "xyd")
    return Results(all_of("score", 2.0**15), x, y, d, present, rows)


def float_results(run, navset, indices, progress=None):
    """The same of a float run."""
    out = []
    for first in range(0, len(indices), BATCH):
        out.append(run.outputs(navset.images[indices[first:first + BATCH]]))
        if progress:
            progress(min(len(indices), first + BATCH))
    out, rows = np.concatenate(out), [navset.labels[i] for i in indices]
    score = 1 / (1 + np.exp(np.clip(out[:, 0] - out[:, 1], -50, 50)))
    present = np.array([row["class"] == 1 for row in rows])
    return Results(score, 127.5 + 128 * out[:, 2], 127.5 + 128 * out[:, 3], SIZE_UNIT_PX * np.exp(out[:, 4]), present, rows)


def percent(part, whole, digits=2):
    return f"{100 * part / whole:.{digits}f} %" if whole else "-"


def threshold_table(results, others=None):
    yield "| threshold | accuracy | misses | false positives | true-positive rate | false-positive rate |" + \
        (" changed against float |" if others else "")
    yield "|---|---|---|---|---|---|" + ("---|" if others else "")
    for threshold in THRESHOLDS:
        misses, targets, false, negatives = results.counts(threshold)
        line = (f"| {threshold:.2f} | {percent(targets + negatives - misses - false, targets + negatives, 3)} | {misses} | "
                f"{false} | {percent(targets - misses, targets)} | {percent(false, negatives)} |")
        if others:
            line += f" {int(((results.score >= threshold) != (others.score >= threshold)).sum())} |"
        yield line


def geometry_table(results, threshold, others=None):
    """On targets that were found, at least 80 % visible and 1.5 to 6 m away."""
    visible, distance = results.column("visible"), results.column("range_m")
    wanted = results.present & (visible >= 0.8) & (distance >= 1.5) & (distance <= 6)
    found = wanted & (results.score >= threshold)
    yield f"Targets at 1.5 to 6 m, at least 80 % visible: {int(wanted.sum())}, found: {int(found.sum())}."
    if not found.any() or np.isnan(results.d).all():
        return
    columns = [("int8", results)] + ([("float", others)] if others else [])
    yield ""
    yield "| error of the found ones | " + " | ".join(f"{name} median | {name} p90" for name, _ in columns) + " |"
    yield "|---|" + "---|---|" * len(columns)
    d, x, y, depth = (results.column(name)[found] for name in ("d_px", "x", "y", "depth_m"))
    focal = results.column("focal_px")[found]

    def errors(of):
        yield "d", np.abs(of.d[found] / d - 1)
        yield "depth (f D / d)", np.abs(focal * TARGET_M / of.d[found] / depth - 1)
        yield "centre, share of d", np.hypot(of.x[found] - x, of.y[found] - y) / d

    for rows in zip(*(errors(of) for _, of in columns)):
        yield f"| {rows[0][0]} | " + " | ".join(f"{100 * np.median(values):.2f} % | {100 * np.percentile(values, 90):.2f} %"
                                                for _, values in rows) + " |"


def confusion_table(title, results, threshold, groups):
    """groups: (name, chosen) pairs."""
    yield f"| {title} | images | misses | of targets | false positives | of negatives |"
    yield "|---|---|---|---|---|---|"
    for name, chosen in groups:
        misses, targets, false, negatives = results.counts(threshold, chosen)
        if targets + negatives:
            yield (f"| {name} | {targets + negatives} | {misses} | {percent(misses, targets)} | {false} | "
                   f"{percent(false, negatives)} |")


def by_word(results, words):
    for word in sorted(set(words) - {""}):
        yield word, words == word


def by_interval(results, values, edges, unit):
    for low, high in zip(edges, edges[1:]):
        name = f"{low:g} to {high:g} {unit}" if np.isfinite(high) else f"{low:g} {unit} and more"
        yield name, results.present & (values >= low) & (values < high)


def by_visibility(results):
    visible = results.column("visible")
    for low, high in zip(VISIBLE, VISIBLE[1:]):
        name = "whole" if not np.isfinite(high) else f"{100 * low:.0f} to {100 * high:.0f} % visible"
        yield name, results.present & (visible >= low) & (visible < high)


def report(results, threshold, others=None):
    """Lines of Markdown."""
    yield from threshold_table(results, others)
    yield ""
    yield f"From here on the threshold is {threshold:.2f}."
    yield ""
    yield from geometry_table(results, threshold, others)
    backgrounds = np.array([name.split("-")[0] for name in results.column("background")])
    for title, groups in [("range", by_interval(results, results.column("range_m"), RANGES_M, "m")),
                          ("hidden", by_visibility(results)), ("light", by_word(results, results.column("light"))),
                          ("subject", by_word(results, results.column("subject"))),
                          ("livery", by_word(results, results.column("livery"))),
                          ("background", by_word(results, backgrounds))]:
        yield ""
        yield from confusion_table(title, results, threshold, groups)


def failures(navset, indices, results, threshold, most=96):
    """A picture of misses, then false positives, the worst first; or None."""
    found = results.score >= threshold
    misses = sorted(np.flatnonzero(~found & results.present), key=lambda i: results.score[i])
    false = sorted(np.flatnonzero(found & ~results.present), key=lambda i: -results.score[i])
    misses = misses[:max(most // 2, most - len(false))]
    order = [*misses, *false[:most - len(misses)]]
    if not order:
        return None
    side, columns = contact_sheet.SIDE + 4, min(8, len(order))
    picture = contact_sheet.sheet(navset, [indices[i] for i in order], columns)
    draw = ImageDraw.Draw(picture)
    for k, i in enumerate(order):
        x, y = k % columns * side + 2, k // columns * side + 2
        draw.rectangle([x, y, x + contact_sheet.SIDE - 1, y + 11], fill=(90, 0, 0) if results.present[i] else (90, 60, 0))
        draw.text((x + 2, y), f"{'missed' if results.present[i] else 'false positive'}, score {results.score[i]:.3f}, "
                  f"image {indices[i]}", fill=(255, 255, 255))
    return picture


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("net", metavar="NET.berthnet")
    parser.add_argument("set", help="folder that berth_navset wrote; its test part is used")
    parser.add_argument("--float", metavar="RUN", help="the run it was made of: its folder, or a snapshot")
    parser.add_argument("--threshold", type=float, default=0.5, help="for everything but the first table")
    parser.add_argument("--failures", metavar="PNG", help="a picture of the misses and false positives")
    parser.add_argument("--device", choices=["auto", "cpu", "cuda"], default="auto")
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    torch.set_num_threads(arguments.threads)
    device = arguments.device if arguments.device != "auto" else "cuda" if torch.cuda.is_available() else "cpu"
    try:
        model, navset = model_file.read(arguments.net), NavSet(arguments.set)
        indices = navset.part("test")
        if not len(indices):
            raise ValueError(f"{arguments.set} has no test part")
        got, others = results(model, navset, indices, device, Progress("integers", len(indices))), None
        if arguments.float:
            run = float_run.load(arguments.float, device)
            others = float_results(run, navset, indices, Progress("float", len(indices)))
    except (model_file.ModelError, FileNotFoundError, ValueError) as error:
        sys.exit(f"evaluate.py: {error}")
    manifest = navset.manifest
    print(f"# {model.name} on {manifest['set']}, seed {manifest.get('seed', '-')}: {len(indices)} test images\n")
    print(f"{model.notes}.\n")
    if others:
        misses, _, false, _ = others.counts(0.5)
        print(f"Float ({run.name}, iteration {run.iteration}) at 0.50: {misses} misses, {false} false positives.\n")
    for line in report(got, arguments.threshold, others):
        print(line)
    if arguments.failures:
        picture = failures(navset, indices, got, arguments.threshold)
        if picture:
            picture.save(arguments.failures)


if __name__ == "__main__":
    main()
