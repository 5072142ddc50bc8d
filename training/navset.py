"""A set that berth_navset wrote: images, labels, manifest."""
import csv
import json
import pathlib

import numpy as np

SIDE = 256
_INTEGERS = {"index", "class", "x0", "y0", "x1", "y1", "full_x0", "full_y0", "full_x1", "full_y1"}
_WORDS = {"part", "subject", "light", "background", "livery"}


def _typed(row):
    return {key: value if key in _WORDS else int(value) if key in _INTEGERS else float(value)
            for key, value in row.items()}


class NavSet:
    """images u8[count, 256, 256] (mapped, not read), labels: a dict for each image, manifest: a dict."""

    def __init__(self, folder):
        folder = pathlib.Path(folder)
        self.manifest = json.loads((folder / "manifest.json").read_text())
        with open(folder / "labels.csv", newline="") as file:
            self.labels = [_typed(row) for row in csv.DictReader(file)]
        self.images = np.memmap(folder / "images.u8", np.uint8, "r").reshape(-1, SIDE, SIDE)
        if len(self.images) != len(self.labels):
            raise ValueError(f"{folder}: {len(self.images)} images, {len(self.labels)} labels")

    def part(self, name):
        """Indices of the `train` or `test` part."""
        return np.array([i for i, row in enumerate(self.labels) if row["part"] == name], dtype=np.int64)

    def column(self, name):
        return np.array([row[name] for row in self.labels])
