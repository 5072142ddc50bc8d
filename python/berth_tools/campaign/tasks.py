"""What a task is, and what each kind of it does on a worker.

A task's result is a set of small files, made of its specification alone: the same on every worker, at every time.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import math
import pathlib
import re
import subprocess
import tempfile
from dataclasses import dataclass, field
from typing import Any


class CampaignError(Exception):
    """What is wrong, in words for people, with the remedy."""


@dataclass(frozen=True)
class Task:
    """One piece of work.

    name: of its folder among the results. spec: all that its result depends on, as JSON has it. inputs: small files that
    are carried to the worker, by name; what is large is read where the specification says.
    """

    name: str
    spec: dict[str, Any]
    inputs: dict[str, bytes] = field(default_factory=dict)


def digest_of(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def read_input(path: str) -> bytes:
    try:
        return pathlib.Path(path).read_bytes()
    except OSError as error:
        raise CampaignError(f"{path}: cannot be read ({error.strerror}); check the name") from error


def berth_version(berth: str) -> str:
    """What that command says it is; two that say the same come to the same bits."""
    try:
        return subprocess.run([berth, "--version"], check=True, capture_output=True, text=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        raise CampaignError(f"{berth}: it does not run ({error}); give the command's path by --berth") from error


def accuracy_tasks(seeds: list[int], arguments: list[str], version: str) -> list[Task]:
    """`berth table` with these arguments, once for each seed."""
    return [Task(f"accuracy-{seed:06d}", {"kind": "accuracy", "seed": seed, "arguments": arguments, "berth": version})
            for seed in seeds]


def render_tasks(scenarios: list[str], seeds: list[int], frames: int, version: str) -> list[Task]:
    """The first frames of each scenario with each seed in place of its own. frames: 0 for all that it has."""
    tasks = []
    for path in scenarios:
        content = read_input(path)
        stem = pathlib.Path(path).stem
        for seed in seeds:
            spec = {"kind": "render", "seed": seed, "frames": frames, "scenario": stem, "sha256": digest_of(content),
                    "berth": version}
            tasks.append(Task(f"render-{stem}-{seed:06d}", spec, {"scenario.toml": content}))
    return unique(tasks)


def evaluation_tasks(recordings: list[str], arguments: list[str], version: str) -> list[Task]:
    """`berth run` over each recording, with these arguments. Workers read the recordings by the paths given."""
    for unfit in ("--fps", "--stream", "--json"):
        if any(argument == unfit or argument.startswith(unfit + "=") for argument in arguments):
            raise CampaignError(f"{unfit} stands behind --, but evaluations search every frame once; leave it out")
    tasks = []
    for path in recordings:
        spec = {"kind": "evaluate", "recording": pathlib.Path(path).name, "sha256": file_digest(path),
                "arguments": arguments, "berth": version}
        tasks.append(Task(f"evaluate-{pathlib.Path(path).stem}", spec, {"path": str(pathlib.Path(path).resolve()).encode()}))
    return unique(tasks)


def file_digest(path: str) -> str:
    """Of a file that may be larger than the memory."""
    digest = hashlib.sha256()
    try:
        with open(path, "rb") as file:
            for block in iter(lambda: file.read(1 << 20), b""):
                digest.update(block)
    except OSError as error:
        raise CampaignError(f"{path}: cannot be read ({error.strerror}); workers need it under this path") from error
    return digest.hexdigest()


def unique(tasks: list[Task]) -> list[Task]:
    seen = set()
    for task in tasks:
        if task.name in seen:
            raise CampaignError(f"two of the files are called alike ({task.name}); results are named by them: rename one")
        seen.add(task.name)
    return tasks


def perform(task: Task, berth: str) -> dict[str, bytes]:
    """A task's result: the content of its files, by name. berth: the command, on the worker.

    Raises CampaignError where it cannot be had.
    """
    if berth_version(berth) != task.spec["berth"]:
        raise CampaignError(f"{berth}: this worker has {berth_version(berth)}, the campaign {task.spec['berth']}; "
                            "install the same everywhere")
    return {"accuracy": accuracy, "render": render, "evaluate": evaluate}[task.spec["kind"]](task, berth)


def command(arguments: list[str]) -> str:
    done = subprocess.run(arguments, capture_output=True, text=True)
    if done.returncode != 0:
        said = done.stderr.strip().splitlines() or ["nothing"]
        raise CampaignError(f"{' '.join(arguments)}: exit code {done.returncode}: {said[-1]}")
    return done.stdout


def accuracy(task: Task, berth: str) -> dict[str, bytes]:
    with tempfile.TemporaryDirectory() as folder:
        command([berth, "table", *task.spec["arguments"], "--seed", str(task.spec["seed"]), "--out", folder])
        return {"table.csv": (pathlib.Path(folder) / "table.csv").read_bytes()}


def with_seed(scenario: str, seed: int) -> str:
    """The scenario with another seed: its line before the first table, or a new one."""
    at = re.search(r"(?m)^\s*\[", scenario)
    head, rest = (scenario[:at.start()], scenario[at.start():]) if at else (scenario, "")
    head = re.sub(r"(?m)^\s*seed\s*=.*\n?", "", head)
    return f"seed = {seed}\n{head}{rest}"


def render(task: Task, _: str) -> dict[str, bytes]:
    import berth  # only here: the other kinds do with the command

    files, truth = {}, []
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / f"{task.spec['scenario']}.toml"
        path.write_text(with_seed(task.inputs["scenario.toml"].decode(), task.spec["seed"]))
        for frame in berth.Source(f"sim:{path}"):
            if task.spec["frames"] and frame.sequence >= task.spec["frames"]:
                break
            name = f"{frame.sequence:06d}.pgm"
            height, width = frame.image.shape
            files[name] = f"P5\n{width} {height}\n255\n".encode() + frame.image.tobytes()
            truth += [{"image": name, "mid_exposure_ns": frame.mid_exposure_ns, "family": marker.family, "id": marker.id,
                       "size_m": marker.size_m, "corners": marker.corners.tolist(),
                       "R": marker.pose.R.tolist(), "t": marker.pose.t.tolist()} for marker in frame.truth]
    files["truth.jsonl"] = "".join(json.dumps(one) + "\n" for one in truth).encode()
    return files


def pose_errors(pose: dict[str, Any], true: dict[str, Any]) -> tuple[float, float]:
    """mm and degrees between two poses."""
    apart = math.sqrt(sum((a - b) ** 2 for a, b in zip(pose["t"], true["t"])))
    # Of a small turn, the sine of its half is a difference; from the trace alone its cosine would be lost in rounding.
    chord = math.sqrt(sum((a - b) ** 2 for a, b in zip(pose["R"], true["R"])) / 8)
    return 1000 * apart, math.degrees(2 * math.asin(min(1.0, chord)))


def evaluate(task: Task, berth: str) -> dict[str, bytes]:
    log = command([berth, "run", "--source", f"mcap:{task.inputs['path'].decode()}", *task.spec["arguments"], "--json", "-"])
    rows = io.StringIO()
    table = csv.writer(rows, lineterminator="\n")
    table.writerow(["frame", "family", "id", "shown", "found", "error_mm", "error_deg"])
    for line in filter(None, log.split("\n")):  # labels may hold other ends of lines
        frame = json.loads(line)
        found = {(one["family"], one["id"]): one for one in frame["detections"]}
        shown = {(one["family"], one["id"]): one for one in frame.get("truth", [])}
        for which in sorted({*found, *shown}):
            errors = ["", ""]
            if which in found and which in shown and "pose" in found[which]:
                errors = [f"{error:.6f}" for error in pose_errors(found[which]["pose"], shown[which]["pose"])]
            table.writerow([frame["frame"], *which, int(which in shown), int(which in found), *errors])
        if not found and not shown:
            table.writerow([frame["frame"], "", "", 0, 0, "", ""])
    return {"frames.csv": rows.getvalue().encode()}
