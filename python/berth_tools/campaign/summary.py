"""The results of all tasks as one table: read from the folder in the tasks' order, so that nothing else matters."""

from __future__ import annotations

import csv
import hashlib
import io
import math
import os
import pathlib
from typing import Any, Iterable

from .run import folder_of
from .tasks import Task

AXES = ["x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"]


def rms(values: list[float]) -> str:
    return f"{math.sqrt(math.fsum(v * v for v in values) / len(values)):.6f}" if values else ""


def largest(values: list[float]) -> str:
    return f"{max(abs(v) for v in values):.6f}" if values else ""


def rows_of(path: pathlib.Path) -> list[dict[str, str]]:
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def accuracy(tasks: list[Task], out: pathlib.Path) -> Iterable[list[Any]]:
    """By experiment and method: frames that show the marker, those in which it was found, RMS and largest errors."""
    groups: dict[tuple[str, str, str], list[dict[str, str]]] = {}
    for task in tasks:
        for row in rows_of(folder_of(out, task) / "table.csv"):
            if row["shown"] == "1":
                groups.setdefault((row["experiment"], row["size_m"], row["method"]), []).append(row)
    yield ["experiment", "size_m", "method", "shown", "found", *(f"rms_{a}" for a in AXES), *(f"max_{a}" for a in AXES)]
    for which, rows in groups.items():
        found = [row for row in rows if row["found"] == "1"]
        errors = [[float(row[f"error_{axis}"]) for row in found] for axis in AXES]
        yield [*which, len(rows), len(found), *map(rms, errors), *map(largest, errors)]


def render(tasks: list[Task], out: pathlib.Path) -> Iterable[list[Any]]:
    """By task: images, markers in them, and a digest of all of its files."""
    yield ["scenario", "seed", "images", "markers", "sha256"]
    for task in tasks:
        folder = folder_of(out, task)
        digest = hashlib.sha256()
        files = sorted(folder.iterdir())
        for file in files:
            digest.update(file.name.encode() + b"\0" + file.read_bytes())
        markers = (folder / "truth.jsonl").read_text().count("\n")
        yield [task.spec["scenario"], task.spec["seed"], sum(file.suffix == ".pgm" for file in files), markers, digest.hexdigest()]


def evaluate(tasks: list[Task], out: pathlib.Path) -> Iterable[list[Any]]:
    """By recording: frames, markers that are there by the truth, those found, those found that are not there."""
    yield ["recording", "frames", "shown", "found", "not_there", "rms_mm", "max_mm", "rms_deg", "max_deg"]
    for task in tasks:
        rows = rows_of(folder_of(out, task) / "frames.csv")
        found = [row for row in rows if row["found"] == "1"]
        known = [row for row in found if row["error_mm"]]
        mm, deg = ([float(row[key]) for row in known] for key in ("error_mm", "error_deg"))
        shown = sum(row["shown"] == "1" for row in rows)
        # Without truth nobody can say that something is not there.
        false = sum(row["shown"] == "0" for row in found) if shown else ""
        yield [task.spec["recording"], len({row["frame"] for row in rows}), shown, len(found), false, rms(mm), largest(mm),
               rms(deg), largest(deg)]


def summarize(tasks: list[Task], out: str | os.PathLike[str]) -> str:
    """Writes summary.csv of these tasks, all of one kind and done; the same for people to read is returned."""
    out = pathlib.Path(out)
    kind = {"accuracy": accuracy, "render": render, "evaluate": evaluate}[tasks[0].spec["kind"]]
    rows = list(kind(tasks, out))
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    part = out / ".summary.csv"
    part.write_text(text.getvalue(), encoding="utf-8")
    part.replace(out / "summary.csv")
    cells = [[str(cell) for cell in row] for row in rows]
    widths = [max(len(row[i]) for row in cells) for i in range(len(cells[0]))]
    return "".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() + "\n" for row in cells)
