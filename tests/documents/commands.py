#!/usr/bin/env python3
"""Runs every `berth` command that a document shows, as it stands there but for what this file names: cameras that are
not here, hours, and pictures of one's own.

usage: commands.py BERTH ROOT [WORDS]     WORDS: only commands with them
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

DOCUMENTS = ["README.md", "docs/*.md"]

# Not run: another program's or another machine's, or run by a test of its own.
LEFT_OUT = {
    r"build/jetson|/etc/berth|journalctl": "another machine's",
    r"camera_to_ros\.py": "the test camera_to_ros runs it",
    r"FAKE_CUDA|--backend cuda|build/release/berth": "cuda_test and verify run what it shows",
    r"docs/recording\.md": "the test recording_commands_run runs the whole page",
    r"^berth eval ": "needs a set of thousands of pictures; cli_eval_test runs it on a small one",
    r"^berth bench --explain --machine tx1": "cli_backends_test runs it",
    r"^berth verify$": "CI's section verify runs it",
}

# In place of what is not here, or takes long: pattern, replacement.
STAND_INS = [
    (r"video:approach\.mp4", "sim:scenarios/approach.toml"),
    (r"dir:x/", "dir:photos"),
    (r"--lockstep simd,vulkan", "--lockstep simd,cpu"),
    (r"--backend (vulkan|opencl)", "--backend cpu"),
    (r"--minutes 30 --cores 0,1 --realtime 50", "--max-frames 3"),
    (r"--minutes 5", "--max-frames 3"),
    (r"--view 0\.0\.0\.0:8040", "--view 127.0.0.1:0"),
    (r"--view(?= -|$)", "--view 127.0.0.1:0"),
    (r"^berth chaos$", "berth chaos --flips 20"),
    (r"^berth soak --hours 8", "berth soak --scenarios 1"),
    (r"seed in 1 2 3", "seed in 1"),
    (r"--flips 40000", "--flips 20"),
    (r"^berth flight --count 100", "berth flight --count 1 --frames 12"),
    (r"^berth flight --fps 30", "berth flight --fps 30 --frames 12"),
    (r"^berth demo", "berth demo --frames 12"),
    (r"^(berth table)(?! --only)", r"\1 --only still"),
    (r"^berth table", "berth table --frames 4 --fineness 1"),
    (r"^(berth calibrate .*) images/", r"\1 --source sim:scenarios/calibration.toml --views 20"),
    (r"(berth calibrate .*)--grid \dx\d", r"\1--grid 6x6"),
    (r"^berth survey --camera \S+ --marker-size 0\.05( --size 4=0\.04)? (.*)images/",
     r"berth survey --marker-size 0.05 --size 4=0.04 --size 5=0.04 \2scenarios/survey.toml"),
    (r"^berth run --config berth\.toml",
     """(echo 'source = "sim:scenarios/approach.toml"'; cat berth.toml) >own.toml; berth run --max-frames 3 --config own.toml"""),
]

# A run of the simulator ends by itself after seconds; a few frames show as much.
FEW_FRAMES = r"^berth run .*(sim:|dir:)"

# Serves until it is interrupted.
SERVES = r"^berth view "

CAMERA = r"v4l2:|aravis:|gst:"
NO_CAMERA = r"cannot be opened|gives no frame|cannot be made|without (Aravis|GStreamer)"


def commands_of(path):
    """Lines of ```sh blocks and of indented ones that call berth, with their numbers, without their comments."""
    fence = None
    for number, line in enumerate(path.read_text().splitlines(), 1):
        marks = re.match(r"\s*```(\w*)", line)
        if marks:
            fence = marks.group(1) if fence is None else None
            continue
        if fence == "sh" or (fence is None and line.startswith("    ")):
            command = re.sub(r"\s+#.*", "", line.strip())
            # With an ellipsis, a part in brackets or a placeholder it is a synopsis.
            is_synopsis = re.search(r"…|\[|[A-Z]{4}", command.replace("SERIAL", ""))
            if re.search(r"(^|[\s;/])berth ", command) and not is_synopsis:
                yield number, command


def prepare(folder, root):
    for name in ["bundles", "scenarios", "targets"]:
        os.symlink(root / name, folder / name)
    photo = root / "tests/data/tag36h11_7.png"
    for name in ["photos", "x"]:
        (folder / name).mkdir()
        shutil.copy(photo, folder / name)
    for name in ["photo.png", "photo.jpg"]:
        shutil.copy(photo, folder / name)
    shutil.copy(root / "bundles/approach.yaml", folder / "dock.yaml")
    (folder / "token").write_text("0123456789abcdef\n")
    (folder / "berth.toml").touch()
    pose = {"translation": {"x": 0, "y": 0, "z": 0}, "rotation": {"quaternion": {"W": 1, "X": 0, "Y": 0, "Z": 0}}}
    (folder / "field.json").write_text(json.dumps({"tags": [{"ID": 7, "pose": pose}], "field": {"length": 1, "width": 1}}))


def write_cameras(folder, width, height):
    text = f"""image_width: {width}
image_height: {height}
camera_matrix: {{rows: 3, cols: 3, data: [{width}, 0, {width / 2}, 0, {width}, {height / 2}, 0, 0, 1]}}
distortion_model: plumb_bob
distortion_coefficients: {{rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}}
"""
    for name in ["cam.yaml", "camera.yaml"]:
        (folder / name).write_text(text)


def run(command, folder, environment):
    # The photograph's size, or the simulator's.
    write_cameras(folder, *((320, 240) if command.startswith("berth detect") else (640, 480)))
    serves = re.search(SERVES, command)
    process = subprocess.Popen(["sh", "-euc", "exec " + command if serves else command], cwd=folder, env=environment,
                               stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    try:
        output, _ = process.communicate(timeout=2 if serves else 120)
    except subprocess.TimeoutExpired:
        process.send_signal(2 if serves else 9)
        output, _ = process.communicate()
    return process.returncode, output


def main():
    berth, root = (pathlib.Path(argument).resolve() for argument in sys.argv[1:3])
    words = " ".join(sys.argv[3:])
    environment = dict(os.environ, PATH=f"{berth.parent}:{os.environ['PATH']}", ROS_DOMAIN_ID="93")
    failures, ran, left_out = [], 0, 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        prepare(folder, root)
        # What the documents' commands take for made.
        for made in ["berth run --source sim:scenarios/approach.toml --max-frames 3 --record flight.mcap",
                     "cp flight.mcap approach.mcap"]:
            code, output = run(made, folder, environment)
            if code != 0:
                sys.exit(f"{made}: {output}")
        for path in sorted(path for pattern in DOCUMENTS for path in root.glob(pattern)):
            name = str(path.relative_to(root))
            for number, shown in commands_of(path):
                if words not in shown:
                    continue
                if any(re.search(pattern, shown) or re.search(pattern, name) for pattern in LEFT_OUT):
                    left_out += 1
                    continue
                ran += 1
                tried = [shown]
                if re.search(CAMERA, shown):
                    # As it stands the camera is not there, which is all that may be wrong with it.
                    code, output = run(shown, folder, environment)
                    if code != 2 or not re.search(NO_CAMERA, output) or "command line" in output:
                        failures.append((name, number, shown, code, output))
                    source = r"'gst:[^']*'" if "'gst:" in shown else r"(v4l2|aravis|gst):\S+"
                    scenario = "calibration" if "calibrate" in shown else "approach"
                    tried = [re.sub(source, f"sim:scenarios/{scenario}.toml", shown).replace(" --stream", "")]
                for pattern, replacement in STAND_INS:
                    tried[0] = re.sub(pattern, replacement, tried[0])
                if re.search(FEW_FRAMES, tried[0]) and "--max-frames" not in tried[0]:
                    tried[0] += " --max-frames 3"
                code, output = run(tried[0], folder, environment)
                if code == 2 and re.search(r"built without", output):
                    ran, left_out = ran - 1, left_out + 1
                elif code != 0:
                    failures.append((name, number, tried[0], code, output))
    for name, number, command, code, output in failures:
        print(f"{name}:{number}: {command}\n  exit code {code}\n  " + "\n  ".join(output.splitlines()[-6:]))
    print(f"{ran} commands of documents, {left_out} left out, {len(failures)} failed")
    return 1 if failures or ran == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
