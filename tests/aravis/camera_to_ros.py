#!/usr/bin/env python3
"""From a camera at 300 frames/s to a ROS 2 node: camera_to_ros.py BERTH FAKE_CAMERA SOURCE_ROOT [--frames N] [--lost SHARE]

Aravis' fake GigE Vision camera, `berth run --stream --ros`, a subscriber of PyPI's cyclonedds with types of its own. The
camera is killed after N frames, and a second one sends N more. Whatever the machine: every frame that the cameras took
has become a pose or is counted, each as it was shown; every pose has arrived, stamped with the camera's time of its
frame. How many came in time, how old and what the process holds is printed. All of it is on loopback, unless
camera_to_ros_veth.sh has put a network between.
"""
import argparse
import bisect
import ctypes
import fcntl
import json
import os
import pathlib
import queue
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "ros2"))
# The camera's address, where the network is made already.
ADDRESS = os.environ.get("BERTH_TEST_CAMERA", "127.0.0.1")
IS_LOOPBACK = ADDRESS == "127.0.0.1"
if IS_LOOPBACK:
    os.environ["CYCLONEDDS_URI"] = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""


def enter_own_network():
    """Where port 3956 is free whatever else is tested on the machine; stays where it is if the kernel does not let it."""
    new_user, new_network, up, set_flags = 0x10000000, 0x40000000, 1, 0x8914
    libc = ctypes.CDLL(None)
    if libc.unshare(new_network) and libc.unshare(new_user | new_network):
        return
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        fcntl.ioctl(control, set_flags, struct.pack("16sh", b"lo", up).ljust(40, b"\0"))


if IS_LOOPBACK:
    enter_own_network()  # before there is a second thread

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import ros_types as ros

DOMAIN = 60 + os.getpid() % 40
FPS, EXPOSURE_NS = 300, 500_000
LENS = """image_width: 640
image_height: 480
camera_matrix: {rows: 3, cols: 3, data: [668, 0, 319.5, 0, 668, 239.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
"""
# Or --ros-wait would wait for their readers.
OTHERS_OFF = [f"--ros-topic={name}=off" for name in ("detected_dock_pose", "tf", "detections", "camera_info", "diagnostics")]
PATIENCE_S = 60
LINE_BYTES = 20  # a time of this century, ns
# A frame has 300 kB.
MOST_GROWTH_KB = 8000
COMPLAINED = 2  # of a camera that was lost


def check(holds, what):
    if not holds:
        raise AssertionError(what)


class Camera:
    """A fake camera's process; `sent` has the times at which it took its frames, on its clock, ns."""

    def __init__(self, program, scenario, shown, path, lost):
        self.path = pathlib.Path(path)
        self.process = subprocess.Popen([program, scenario, str(shown), f"sent={self.path}", f"lost={lost}",
                                         f"address={ADDRESS}"],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        check(self.process.stdout.readline() == b"ready\n", "the fake camera does not run")
        self.ready_ns = time.time_ns()

    def sent(self):
        return [int(line) for line in self.path.read_text().splitlines()]

    def frames_sent(self):
        """By the file's size: reading it would take the subscriber's time."""
        return self.path.stat().st_size // LINE_BYTES

    def silence_after(self, frames):
        self.process.stdin.write(b"%d\n" % frames)
        self.process.stdin.flush()

    def kill(self):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()


class Subscriber(threading.Thread):
    """What has come: (time of arrival, stamp, position), times by the system's clock, ns."""

    def __init__(self):
        super().__init__(daemon=True)
        domain = DomainParticipant(DOMAIN)
        self.reader = DataReader(domain, Topic(domain, "rt/pose", ros.PoseWithCovarianceStamped),
                                 qos=Qos(Policy.History.KeepAll, Policy.Reliability.Reliable(duration(seconds=1))))
        self.poses, self.is_over = [], False

    def run(self):
        while not self.is_over:
            for message in self.reader.take_iter(timeout=duration(milliseconds=100)):
                now = time.time_ns()
                if not message.sample_info.valid_data:
                    continue
                stamp, position = message.header_.stamp_, message.pose_.pose_.position_
                self.poses.append((now, stamp.sec_ * 10**9 + stamp.nanosec_, [position.x_, position.y_, position.z_]))


class Run:
    """`berth run`; `output` has its lines so far."""

    def __init__(self, command):
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.output, self.lines = "", queue.SimpleQueue()
        self.reader = threading.Thread(target=lambda: [self.lines.put(line) for line in self.process.stdout], daemon=True)
        self.reader.start()

    def read(self):
        while not self.lines.empty():
            self.output += self.lines.get()
        return self.output

    def wait_until(self, is_so, what, patience_s=PATIENCE_S):
        until = time.monotonic() + patience_s
        while not is_so():
            check(self.process.poll() is None, "berth ended while waiting for " + what + ":\n" + self.read())
            check(time.monotonic() < until, "no " + what + ":\n" + self.read())
            time.sleep(0.002)

    def losses(self):
        return self.read().count("the camera is lost")

    def anonymous_kb(self):
        return int(re.search(r"RssAnon:\s+(\d+)", pathlib.Path(f"/proc/{self.process.pid}/status").read_text())[1])

    def end(self):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(timeout=PATIENCE_S)
        self.reader.join()
        return self.read()


def shape(line):
    """What was found in a frame, bit for bit; poses go by sizes, which the simulator knows."""
    return json.dumps([[d["family"], d["id"], d["corners"]] for d in line["detections"]])


class Frame:
    """What is asked of a line of the log: a minute's lines, whole, are gigabytes."""

    def __init__(self, line):
        self.number, self.clock, self.time_ns = line["frame"], line["clock"], line["mid_exposure_ns"]
        self.shape = hash(shape(line))
        self.position = next(d["pose"]["t"] for d in line["detections"] if d["id"] == 0)


def read_log(path):
    """The frames, and the summary at the end."""
    frames = []
    with open(path) as file:
        for line in map(json.loads, file):
            if "summary" in line:
                return frames, line["summary"]
            frames.append(Frame(line))
    raise AssertionError("the log has no end")


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def fly(given, folder):
    """Both cameras' lives. Returns the cameras, what berth said, its log's lines and summary, what is found in the frames
    shown, poses, memory at times, and how often a camera was given up that was there."""
    scenario = "sim:" + str(given.root / "scenarios/approach.toml")
    lens, direct, log = (os.path.join(folder, name) for name in ("lens.yaml", "direct.jsonl", "log.jsonl"))
    pathlib.Path(lens).write_text(LENS)
    engine = ["--camera", lens, "--size", "0.1"]
    subprocess.run([given.berth, "run", "--source", scenario, f"--max-frames={given.shown}", "--json", direct, *engine],
                   check=True, stdout=subprocess.DEVNULL)
    expected = {hash(shape(json.loads(line))) for line in pathlib.Path(direct).read_text().splitlines()}

    def camera():
        path = os.path.join(folder, f"sent{len(cameras)}")
        cameras.append(Camera(given.fake_camera, scenario, given.shown, path, given.lost))

    cameras = []
    camera()
    subscriber = Subscriber()
    subscriber.start()
    source = (f"aravis:{ADDRESS},width=640,height=480,fps={FPS},packet_size=9000,exposure_us={EXPOSURE_NS // 1000},"
              f"resend=off,time=camera,buffers=32,watchdog_ms=500{given.keys}")
    run = Run([given.berth, "run", "--source", source, "--stream", "--slots=8", "--json", log, *engine, "--ros",
               f"--ros-domain={DOMAIN}", "--ros-source-time", "--ros-wait=30", "--ros-dock=tag36h11:0",
               "--ros-qos=pose=4000", *OTHERS_OFF, *given.also])

    def wait_for_frames(one, frames):
        run.wait_until(lambda: one.frames_sent() >= frames, "frames", PATIENCE_S + given.frames / FPS)

    try:
        run.wait_until(lambda: len(subscriber.poses) >= 10, "poses")
        memory_kb = [run.anonymous_kb()]
        # Killed on the way, not in silence.
        for _ in range(2):
            wait_for_frames(cameras[0], cameras[0].frames_sent() + given.frames // 2)
            memory_kb.append(run.anonymous_kb())
        cameras[0].kill()
        run.wait_until(lambda: run.losses() >= 1, "complaint of the camera that was killed")
        camera()
        run.wait_until(lambda: subscriber.poses[-1][1] > cameras[1].ready_ns, "poses after its return")
        frames = cameras[1].frames_sent() + given.frames
        cameras[1].silence_after(given.frames)
        wait_for_frames(cameras[1], frames)
        memory_kb.append(run.anonymous_kb())
        # Silent for so long that it is given up: all that came before has been taken.
        losses = run.losses()
        run.wait_until(lambda: run.losses() > losses, "complaint of the camera that is silent")
        output = run.end()
    finally:
        run.process.kill()
        for one in cameras:
            one.kill()
    check(run.process.returncode == COMPLAINED, f"berth ended with {run.process.returncode}:\n{output}")
    lines, summary = read_log(log)
    sent = int(re.search(r"/pose +(\d+) sent", output)[1])
    until = time.monotonic() + PATIENCE_S
    while len(subscriber.poses) < sent and time.monotonic() < until:
        time.sleep(0.01)
    subscriber.is_over = True
    subscriber.join()
    return cameras, output, lines, summary, expected, subscriber.poses, memory_kb, losses - 1


def check_frames(cameras, lines, summary, expected, given_up):
    """Every frame is accounted for, and none is another than was shown. Returns how many were sent, and how many
    of those between a camera's first and last that were processed were not."""
    taken = [camera.sent() for camera in cameras]
    delivered = [line.time_ns - EXPOSURE_NS // 2 for line in lines]
    check(all(line.clock == "camera" for line in lines), "frames on another clock")
    check(delivered == sorted(set(delivered)), "frames in another order than the camera's")
    check(set(delivered) <= set(taken[0] + taken[1]), "frames at times that are not the camera's")
    for line in lines:
        check(line.shape in expected, f"frame {line.number} is none of those shown")
    check(len(lines) == summary["delivered"], "the log lacks frames")
    dropped, camera = sum(summary["dropped"].values()), summary["camera"]
    check(summary["offered"] == len(lines) + dropped, "the pipeline's counts do not add up")
    counted = dropped + camera["skipped"] + camera["lost"] + camera["incomplete"] + camera["repeated"] + camera["misdated"]
    missing = sum(map(len, taken)) - len(lines)
    # What nobody can count: frames of which nothing came, before the first that did or after the last, also where the
    # camera was given up without need, on a machine that let a process wait for so long.
    uncounted, gaps = 0, []
    for times in taken:
        here = [i for i, when in enumerate(times) if delivered[bisect.bisect_left(delivered, when) % len(delivered)] == when]
        check(here, "a camera gave no frame")
        uncounted += here[0] + len(times) - 1 - here[-1]
        gaps += [b - a - 1 for a, b in zip(here, here[1:])]
    check(camera["reopened"] >= 1, "the camera was not opened again")
    uncounted += sum(sorted(gaps, reverse=True)[:given_up])
    check(counted <= missing <= counted + uncounted,
          f"{missing} frames did not become results, {counted} are counted, {uncounted} could not be: {summary}")
    return sum(map(len, taken)), sum(gaps)


def check_poses(lines, output, poses):
    published, unpublished = map(int, re.search(r"(\d+) frames published in domain \d+, (\d+) dropped", output).groups())
    sent = int(re.search(r"/pose +(\d+) sent", output)[1])
    check(published + unpublished == len(lines), "frames that were neither published nor dropped")
    check(sent == published, "frames without a pose")
    check(len(poses) == sent, f"{len(poses)} of {sent} poses arrived")
    by_time = {line.time_ns: line.position for line in lines}
    for _, stamp, position in poses:
        check(by_time.get(stamp) == position, f"the pose of {stamp} is not the log's")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("berth")
    parser.add_argument("fake_camera")
    parser.add_argument("root", type=pathlib.Path)
    parser.add_argument("--frames", type=int, default=300, help="of each camera, once poses come")
    parser.add_argument("--shown", type=int, default=4, help="images that it shows in turn")
    parser.add_argument("--lost", type=float, default=0, help="share of the packets")
    parser.add_argument("--also", action="append", default=[], help="an option for berth run")
    parser.add_argument("--keys", default="", help="more of the camera's keys, e.g. ,packet_socket=on")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cameras, output, lines, summary, expected, poses, memory_kb, given_up = fly(given, folder)
        print(output)
        total, missing = check_frames(cameras, lines, summary, expected, given_up)
        check_poses(lines, output, poses)
        ages_ms = [(came - stamp + EXPOSURE_NS // 2) / 1e6 for came, stamp, _ in poses]
        back = next(came for came, stamp, _ in poses if stamp > cameras[1].ready_ns)
        print(f"{total} frames sent, {len(lines)} processed: {100 * len(lines) / (len(lines) + missing):.2f} % of those between each "
              "camera's first and last that were")
        print(f"not processed: {json.dumps(summary['dropped'])}, {json.dumps(summary['camera'])}")
        print(f"age, from the camera's time to the subscriber: p50 {quantile(ages_ms, 0.5):.2f}, p99 {quantile(ages_ms, 0.99):.2f}, "
              f"at most {max(ages_ms):.2f} ms")
        print(f"{(back - cameras[1].ready_ns) / 1e6:.0f} ms from the camera's return to the first pose")
        print(f"memory that is not of files, kB: {memory_kb[0]} after ten frames, {memory_kb[1]} after half of the first "
              f"camera's, {memory_kb[2]} at its end, {memory_kb[3]} at the other's")
        check(memory_kb[2] - memory_kb[1] < MOST_GROWTH_KB, "the heap grows")


if __name__ == "__main__":
    main()
