#!/usr/bin/env python3
"""`berth run --ros` as other programs see it: publish_test.py BERTH SOURCE_ROOT [unittest's arguments]

Subscribers are PyPI's cyclonedds with types of their own (ros_types.py); what they receive has to be what the run's JSON
log says. Everything stays on 127.0.0.1.
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

# Without multicast, which the loopback device has not.
os.environ["CYCLONEDDS_URI"] = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces><AllowMulticast>false</AllowMulticast></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>40</MaxAutoParticipantIndex>
<Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>"""
# Four domains whose ports the kernel gives to nobody else (0 to 101), and that another run beside this one rarely has.
FIRST_DOMAIN = 60 + os.getpid() % 10 * 4
os.environ["ROS_DOMAIN_ID"] = str(FIRST_DOMAIN)

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

import ros_types as ros

BERTH, ROOT = sys.argv[1], pathlib.Path(sys.argv[2])
SCENARIO = "sim:" + str(ROOT / "scenarios/approach.toml")
# Deep enough for a machine that lets a process wait for seconds.
DEEP = [f"--ros-qos={topic}=4000" for topic in ("pose", "detected_dock_pose", "tf", "detections", "camera_info")]
CAMERA = """image_width: 320
image_height: 240
camera_matrix: {rows: 3, cols: 3, data: [334, 0, 159.5, 0, 334, 119.5, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-0.1116, 0.1242, 0, 0, 0]}
"""
RELIABLE, LATCHED = Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.TransientLocal


def reader(participant, topic, datatype, *policies):
    qos = Qos(Policy.History.KeepAll, *(policies or (RELIABLE,)))
    return DataReader(participant, Topic(participant, "rt/" + topic, datatype), qos=qos)


def taken(source):
    """All messages that have come, without notices of a writer's end."""
    return [m for m in source.take(N=100000) if m.sample_info.valid_data]


def first_of(source, seconds=20):
    """Waits for messages; those that came."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        messages = taken(source)
        if messages:
            return messages
        time.sleep(0.005)
    return []


def ns(header):
    return header.stamp_.sec_ * 10**9 + header.stamp_.nanosec_


def rotation(q):
    x, y, z, w = q.x_, q.y_, q.z_, q.w_
    return [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]


class Published(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def berth_command(self, *arguments):
        run = subprocess.Popen([BERTH, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT)
        self.addCleanup(run.kill)
        return run

    def berth(self, *arguments):
        return self.berth_command("run", *arguments)

    def output_of(self, run):
        output = run.communicate(timeout=120)[0]
        self.assertEqual(run.returncode, 0, output)
        return output

    def assert_pose(self, position, orientation, expected):
        self.assertEqual([position.x_, position.y_, position.z_], expected["t"])
        for a, b in zip(rotation(orientation), expected["R"]):
            self.assertAlmostEqual(a, b, delta=1e-14)

    def test_every_frame_of_300_a_second_arrives_as_the_log_has_it(self):
        number = FIRST_DOMAIN + 1
        domain = DomainParticipant(number)
        pose = reader(domain, "pose", ros.PoseWithCovarianceStamped)
        dock = reader(domain, "detected_dock_pose", ros.PoseStamped)
        tf = reader(domain, "tf", ros.TFMessage)
        detections = reader(domain, "detections", ros.AprilTagDetectionArray)
        camera = reader(domain, "camera_info", ros.CameraInfo)
        diagnostics = reader(domain, "diagnostics", ros.DiagnosticArray)
        log = os.path.join(self.folder.name, "log.jsonl")
        run = self.berth("--source", SCENARIO, "--max-frames=4", "--fps=300", "--minutes=0.08334", "--slots=64",
                         "--json", log, "--ros", f"--ros-domain={number}", "--ros-source-time", "--ros-wait=30",
                         "--ros-dock=tag36h11:4", "--ros-mount=base_link,0.2,0,0.3,0,90,0", *DEEP)
        early = first_of(pose)
        # Who comes while it runs gets what is kept, and nothing else.
        kept = first_of(reader(domain, "tf_static", ros.TFMessage, RELIABLE, LATCHED))
        late = reader(domain, "camera_info", ros.CameraInfo, RELIABLE, LATCHED)
        self.assertTrue(first_of(late))
        unkept = reader(domain, "tf_static", ros.TFMessage, RELIABLE)
        output = self.output_of(run)
        self.assertEqual(taken(unkept), [])

        lines = [json.loads(line) for line in pathlib.Path(log).read_text().splitlines()]
        summary = lines.pop()["summary"] if "summary" in lines[-1] else {}
        self.assertGreaterEqual(summary["offered"], 1500)
        self.assertEqual(summary["delivered"], len(lines))
        # A queue may run over on a machine that is busy enough; what was sent has to arrive.
        published, dropped = map(int, re.search(rf"(\d+) frames published in domain {number}, (\d+) dropped", output).groups())
        self.assertEqual(published + dropped, len(lines))
        self.assertGreater(published, len(lines) / 2)
        by_time = {line["mid_exposure_ns"]: line for line in lines}
        poses, docks, tfs = early + taken(pose), taken(dock), taken(tf)
        arrays, cameras, reports = taken(detections), taken(camera), taken(diagnostics)
        times = [ns(m.header_) for m in arrays]
        self.assertEqual(len(times), published)
        self.assertEqual(times, sorted(set(times)))
        for messages in (poses, docks, arrays, cameras):
            self.assertEqual([ns(m.header_) for m in messages], times)
            self.assertEqual({m.header_.frame_id_ for m in messages}, {"camera_optical_frame"})
        self.assertEqual(len(tfs), published)

        for when, p, d, t, a in zip(times, poses, docks, tfs, arrays):
            seen = {f"{s['family']}:{s['id']}": s for s in by_time[when]["detections"]}
            expected = seen["tag36h11:4"]["pose"]
            self.assert_pose(p.pose_.pose_.position_, p.pose_.pose_.orientation_, expected)
            self.assertEqual(list(p.pose_.covariance_), expected["covariance"])
            self.assert_pose(d.pose_.position_, d.pose_.orientation_, expected)
            self.assertEqual({s.child_frame_id_ for s in t.transforms_}, set(seen))
            for s in t.transforms_:
                self.assertEqual(ns(s.header_), when)
                self.assert_pose(s.transform_.translation_, s.transform_.rotation_, seen[s.child_frame_id_]["pose"])
            self.assertEqual([f"{s.family_}:{s.id_}" for s in a.detections_], list(seen))
            for s in a.detections_:
                expected = seen[f"{s.family_}:{s.id_}"]
                self.assertEqual([s.centre_.x_, s.centre_.y_], expected["center"])
                self.assertEqual(s.hamming_, expected["hamming"])
                for i, corner in enumerate(s.corners_):
                    self.assertEqual([corner.x_, corner.y_], expected["corners"][(i + 1) % 4])

        info = cameras[0]
        self.assertEqual((info.width_, info.height_, info.distortion_model_), (640, 480, "plumb_bob"))
        self.assertEqual(list(info.k_), [669.42, 0, 308.825, 0, 672.51, 237.615, 0, 0, 1])
        self.assertEqual(list(info.d_)[:2], [-0.1116, 0.1242])

        self.assertEqual(len(kept), 1)
        (mount,) = kept[0].transforms_
        self.assertEqual((mount.header_.frame_id_, mount.child_frame_id_), ("base_link", "camera_optical_frame"))
        # Pitched by 90 degrees the camera looks down: its z is the parent's -z, its x the parent's -y.
        for a, b in zip(rotation(mount.transform_.rotation_), [0, -1, 0, -1, 0, 0, 0, 0, -1]):
            self.assertAlmostEqual(a, b, delta=1e-12)

        last = {v.key_: v.value_ for v in reports[-1].status_[0].values_}
        self.assertEqual(int(last["frames"]), published)
        self.assertEqual(int(last["frames_with_pose"]), published)
        self.assertEqual(int(last["frames_not_published"]), dropped)

    def test_two_robots_in_one_domain_and_qualities_that_do_not_match(self):
        number = FIRST_DOMAIN + 2
        domain = DomainParticipant(number)
        first = reader(domain, "robot1/pose", ros.PoseWithCovarianceStamped)
        second = reader(domain, "robot2/pose", ros.PoseWithCovarianceStamped, Policy.Reliability.BestEffort)
        asks_too_much = reader(domain, "robot2/pose", ros.PoseWithCovarianceStamped, RELIABLE)
        shared = reader(domain, "all_tf", ros.TFMessage)
        images = reader(domain, "robot1/image_raw/compressed", ros.CompressedImage)
        elsewhere = reader(DomainParticipant(FIRST_DOMAIN + 3), "robot1/pose", ros.PoseWithCovarianceStamped)
        only = [f"--ros-topic={topic}=off" for topic in ("detected_dock_pose", "detections", "diagnostics")]
        common = ["--source", SCENARIO, "--ros", f"--ros-domain={number}", "--ros-wait=30", "--ros-topic=tf=/all_tf", *only]
        runs = [
            self.berth(*common, "--max-frames=6", "--ros-namespace=robot1", "--ros-frame-prefix=robot1/", "--ros-images=png",
                       "--ros-image-rate=1000"),
            self.berth(*common, "--max-frames=4", "--ros-namespace=/robot2", "--ros-frame-prefix=robot2/",
                       "--ros-qos=pose=best_effort,5"),
        ]
        outputs = [self.output_of(run) for run in runs]
        self.assertEqual(len(taken(first)), 6)
        seconds = taken(second)
        self.assertLessEqual(1, len(seconds))
        self.assertLessEqual(len(seconds), 4)
        self.assertEqual({m.header_.frame_id_ for m in seconds}, {"robot2/camera_optical_frame"})
        self.assertEqual(taken(asks_too_much), [])
        self.assertEqual(taken(elsewhere), [])
        self.assertNotIn("not offered", outputs[0])
        self.assertIn("readers asked for what is not offered: pose (reliability); see --ros-qos", outputs[1])
        children = [t.child_frame_id_.split("/")[0] for m in taken(shared) for t in m.transforms_]
        self.assertEqual((children.count("robot1"), children.count("robot2")), (30, 20))
        # The frames are told by the rate that the encoder keeps up with; each that comes is whole.
        pictures = taken(images)
        self.assertTrue(pictures)
        for picture in pictures:
            self.assertEqual(picture.format_, "png")
            self.assertEqual(bytes(picture.data_[:8]), b"\x89PNG\r\n\x1a\n")

    def test_the_pose_of_two_stations(self):
        number = FIRST_DOMAIN + 2
        domain = DomainParticipant(number)
        pose = reader(domain, "pair/pose", ros.PoseWithCovarianceStamped)
        dock = reader(domain, "pair/detected_dock_pose", ros.PoseStamped)
        tf = reader(domain, "tf", ros.TFMessage)
        diagnostics = reader(domain, "pair/diagnostics", ros.DiagnosticArray)
        own = reader(domain, "robot1/pose", ros.PoseWithCovarianceStamped)
        log = pathlib.Path(self.folder.name, "log.jsonl")
        top = (f'ros = true\nros-domain = {number}\nros-namespace = "pair"\nros-topic = "tf=/tf"\nros-wait = 30\n'
               'ros-source-time = true\nros-frame-prefix = "r1/"\nrobot-frame = "base_footprint"\n')
        file = pathlib.Path(self.folder.name, "stations.toml")
        station = (ROOT / "scenarios/stations.toml").read_text().replace(
            "[robot]", f'[robot]\nros = true\nros-domain = {number}\nros-namespace = "robot1"\nros-wait = 30\n'
            'ros-topic = ["tf=off", "detections=off", "camera_info=off", "diagnostics=off", "detected_dock_pose=off"]', 1)
        file.write_text(top + station)
        output = self.output_of(self.berth_command("stations", str(file), "--json", str(log)))
        lines = [json.loads(line) for line in log.read_text().splitlines()]
        self.assertEqual(len(lines), 20)
        self.assertIn("both   ROS 2       20 moments published in domain", output)
        poses, docks, tfs, reports = taken(pose), taken(dock), taken(tf), taken(diagnostics)
        self.assertEqual(len(taken(own)), 20)
        for messages in (poses, docks, tfs):
            self.assertEqual(len(messages), 20)
        for line, p, d, t in zip(lines, poses, docks, tfs):
            self.assertEqual(ns(p.header_), line["time_ns"])
            self.assertEqual(p.header_.frame_id_, "r1/dock")
            self.assert_pose(p.pose_.pose_.position_, p.pose_.pose_.orientation_, line["pose"])
            self.assertEqual(list(p.pose_.covariance_), line["pose"]["covariance"])
            # The dock from the robot: the way back.
            R, t_robot = line["pose"]["R"], line["pose"]["t"]
            back = {"R": [R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]],
                    "t": [-sum(R[3 * i + j] * t_robot[i] for i in range(3)) for j in range(3)]}
            self.assertEqual(len(t.transforms_), 1)
            (one,) = t.transforms_
            self.assertEqual((one.header_.frame_id_, one.child_frame_id_), ("r1/base_footprint", "r1/dock"))
            self.assertEqual(d.header_.frame_id_, "r1/base_footprint")
            for position, orientation in ((one.transform_.translation_, one.transform_.rotation_),
                                          (d.pose_.position_, d.pose_.orientation_)):
                for a, b in zip([position.x_, position.y_, position.z_], back["t"]):
                    self.assertAlmostEqual(a, b, delta=1e-12)
                for a, b in zip(rotation(orientation), back["R"]):
                    self.assertAlmostEqual(a, b, delta=1e-12)
        (status,) = reports[-1].status_
        values = {v.key_: v.value_ for v in status.values_}
        self.assertEqual((status.name_, values["moments"], values["by_both"]), ("berth: stations", "20", "20"))
        self.assertEqual(float(values["disagreement"]), round(lines[-1]["disagreement"], 3))

    def test_stations_that_disagree_give_no_pose(self):
        number = FIRST_DOMAIN + 1
        domain = DomainParticipant(number)
        pose = reader(domain, "pose", ros.PoseWithCovarianceStamped)
        diagnostics = reader(domain, "diagnostics", ros.DiagnosticArray)
        file = pathlib.Path(self.folder.name, "stations.toml")
        # A camera turned by 5 degrees on its mount.
        bent = (ROOT / "scenarios/stations.toml").read_text().replace("0,0.12,0,0,0,0", "0,0.12,0,5,0,0", 1)
        file.write_text(f"ros = true\nros-domain = {number}\nros-wait = 30\n"
                        'ros-topic = ["detected_dock_pose=off", "tf=off"]\n' + bent)
        self.output_of(self.berth_command("stations", str(file)))
        self.assertEqual(taken(pose), [])
        (status,) = taken(diagnostics)[-1].status_
        values = {v.key_: v.value_ for v in status.values_}
        self.assertEqual(values["disagreed"], "20")
        self.assertGreater(float(values["disagreement"]), 28)

    def test_a_reader_behind_a_cut_cable_holds_no_frame_up(self):
        # A reliable reader that asks for all, and from its first message on neither takes nor acknowledges anything: to
        # the writer, a partition of the network.
        number = FIRST_DOMAIN + 3
        code = (f"import os, sys; sys.path.insert(0, {str(pathlib.Path(__file__).parent)!r}); sys.argv = ['', '', '']\n"
                "import publish_test as p, signal\n"
                f"domain = p.DomainParticipant({number})\n"
                "pose = p.reader(domain, 'pose', p.ros.PoseWithCovarianceStamped)\n"
                "assert p.first_of(pose, 60)\n"
                "print('cut', flush=True); os.kill(os.getpid(), signal.SIGSTOP)\n")
        other = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
        self.addCleanup(other.stdout.close)
        self.addCleanup(other.wait)
        self.addCleanup(other.kill)
        log = os.path.join(self.folder.name, "log.jsonl")
        run = self.berth("--source", SCENARIO, "--max-frames=4", "--fps=300", "--minutes=0.03", "--json", log, "--ros",
                         f"--ros-domain={number}", "--ros-wait=30", "--ros-topic=detected_dock_pose=off", "--ros-topic=tf=off",
                         "--ros-topic=detections=off", "--ros-topic=diagnostics=off")
        output = self.output_of(run)
        self.assertEqual(other.stdout.readline(), "cut\n")
        summary = json.loads(pathlib.Path(log).read_text().splitlines()[-1])["summary"]
        self.assertEqual(summary["offered"], 540)
        # A writer that waited for the reader would hold the stream's thread up, and frames would be dropped for it.
        self.assertLess(summary["dropped"]["reader"], 270, output)

    def test_commands_in_the_documents_run(self):
        text = (ROOT / "docs/ros2.md").read_text()
        commands = [line for block in re.findall(r"```sh\n(.*?)```", text, re.S) for line in block.splitlines()
                    if line.startswith("berth run")]
        self.assertGreaterEqual(len(commands), 5)
        # A picture in place of the camera.
        camera = pathlib.Path(self.folder.name, "cam.yaml")
        camera.write_text(CAMERA)
        picture = ROOT / "tests/data/tag36h11_7.png"
        for command in commands:
            words = command.replace("cam.yaml", str(camera)).split()
            source = words.index("--source") + 1
            self.assertTrue(words[source].startswith("v4l2:"))
            words[source] = f"file:{picture}"
            with self.subTest(command):
                output = self.output_of(self.berth(*words[2:]))
                self.assertRegex(output, r"/(robot1/|dock/)?pose +%d sent" % ("--ros-dock" not in words))
                self.assertIn("1 frames published in domain "
                              + ("7" if "--ros-domain" in words else str(FIRST_DOMAIN)), output)

    def test_the_docking_servers_settings_turn_a_marker_into_a_dock(self):
        text = (ROOT / "docs/ros2.md").read_text()
        import math
        angles = [float(re.search(rf"external_detection_rotation_{axis}: (\S+)", text)[1])
                  for axis in ("roll", "pitch", "yaw")]
        (sr, cr), (sp, cp), (sy, cy) = ((math.sin(a), math.cos(a)) for a in angles)
        # Its x axis, as opennav_docking turns it: by roll, then pitch, then yaw about fixed axes.
        dock = [[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr]]
        # A marker has x right, y down, z into it; a robot in the dock x into it, y left, z up.
        for row, expected in zip(dock, [[0, -1, 0], [0, 0, -1], [1, 0, 0]]):
            for a, b in zip(row, expected):
                self.assertAlmostEqual(a, b, delta=1e-3)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2)
