"""The Python module: its arrays, its threads, its errors, its example, and every program of docs/python.md."""

import ast
import gc
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np

import berth

ROOT = pathlib.Path(__file__).resolve().parents[2]
PHOTO = str(ROOT / "tests/data/tag36h11_7.png")
SIDE_M = 0.1


def photo():
    return next(berth.Source(PHOTO)).image


def detector_for(image, **settings):
    height, width = image.shape
    camera = berth.CameraModel.paper(width, height)
    return berth.Detector(width, height, camera=camera, marker_size_m=SIDE_M, **settings)


class Arrays(unittest.TestCase):
    def test_images_of_a_source_are_views_that_outlive_it(self):
        image = photo()
        gc.collect()
        self.assertFalse(image.flags.owndata or image.flags.writeable)
        self.assertEqual((image.shape, image.dtype), ((240, 320), np.uint8))
        self.assertGreater(int(image.max()) - int(image.min()), 100)

    def test_results_are_views_that_outlive_what_they_are_of(self):
        marker = detector_for(photo()).detect(photo()).detections[0]
        pose = marker.pose
        for owner, name in [(marker, "corners"), (marker, "corner_covariance"), (pose, "R"), (pose, "covariance")]:
            count = sys.getrefcount(owner)
            view = getattr(owner, name)
            self.assertEqual(sys.getrefcount(owner), count + 1, name)
            self.assertTrue(np.shares_memory(view, getattr(owner, name)), name)
            del view
        covariance, corners = pose.covariance, marker.corners
        del marker, pose, owner
        gc.collect()
        self.assertTrue((np.linalg.eigvalsh(covariance) > 0).all())
        with self.assertRaises(ValueError):
            corners[0, 0] = 0

    def test_rows_may_be_further_apart_than_they_are_long(self):
        image = photo()
        padded = np.full((240, 350), 255, np.uint8)
        padded[:, :320] = image
        detector = detector_for(image)
        one, two = (detector.detect(view).detections[0].corners for view in (image, padded[:, :320]))
        np.testing.assert_array_equal(one, two)

    def test_what_is_no_gray_image_is_refused(self):
        detector = detector_for(photo())
        for bad, part in [
            (np.zeros((240, 320, 3), np.uint8), "give 8-bit gray of shape"),
            (np.zeros((240, 320), np.float32), "give 8-bit gray of shape"),
            (np.zeros((240, 640), np.uint8)[:, ::2], "ascontiguousarray"),
            (np.zeros((240, 320), np.uint8)[::-1], "ascontiguousarray"),
            (np.zeros((480, 640), np.uint8), "frame is 640x480"),
            ("dock.png", "neither an array nor a SourceFrame"),
        ]:
            with self.assertRaisesRegex(berth.Error, part):
                detector.detect(bad)


class Results(unittest.TestCase):
    def test_frames_of_a_simulated_approach_are_near_the_truth(self):
        frames = []
        for frame in berth.run(f"sim:{ROOT}/scenarios/track.toml", marker_size_m=SIDE_M, full_every=30):
            frames.append(frame)
            if len(frames) == 3:
                break
        self.assertEqual([frame.whole for frame in frames], [True, False, False])
        track = berth.PoseFilter(berth.Source(f"sim:{ROOT}/scenarios/track.toml").camera, SIDE_M)
        for frame in frames:
            (marker,), (truth,) = frame.detections, frame.source.truth
            self.assertEqual((frame.status, marker.family, marker.id), ("ok", truth.family, truth.id))
            self.assertLess(np.abs(marker.corners - truth.corners).max(), 0.5)
            np.testing.assert_allclose(marker.pose.t, truth.pose.t, atol=0.01)
            np.testing.assert_allclose(marker.pose.R @ marker.pose.R.T, np.eye(3), atol=1e-12)
            filtered = track.update(frame.mid_exposure_ns, marker)
            self.assertTrue(filtered.has_pose and filtered.measured)
            self.assertEqual(set(frame.times_ns), {"device", "decode", "pose"})
        self.assertFalse(track.foretell(frames[-1].mid_exposure_ns + 1).measured)
        track.reset()
        self.assertFalse(track.update(frames[-1].mid_exposure_ns + 2, None).has_pose)

    def test_bundles_and_targets_have_poses(self):
        for scenario, settings, results in [
            ("nested", {"families": ["tagCustom48h12"],
                        "bundles": berth.read_bundles(str(ROOT / "bundles/nested.yaml"))}, "bundles"),
            ("port", {"targets": [berth.DiscTarget.read(str(ROOT / "targets/port.yaml"))]}, "targets"),
        ]:
            source = berth.Source(f"sim:{ROOT}/scenarios/{scenario}.toml")
            frame = next(berth.run(source, camera=source.camera, **settings))
            (found,) = getattr(frame, results)
            self.assertEqual(found.name, scenario)
            self.assertGreater(found.used, 0)
            self.assertEqual(found.pose.covariance.shape, (6, 6))

    def test_errors_name_the_value_and_the_remedy(self):
        image = photo()
        with self.assertRaisesRegex(berth.Error, "corners is 'best'; use 'edges' or 'photometric'"):
            detector_for(image, corners="best")
        with self.assertRaisesRegex(berth.Error, "no backend 'quantum'"):
            detector_for(image, backend="quantum")
        with self.assertRaisesRegex(berth.Error, "there is no such file or folder"):
            berth.Source("nowhere.png")
        with self.assertRaisesRegex(berth.Error, "the detector for 640x480"):
            berth.Detector(640, 480, camera=berth.CameraModel.paper(320, 240), marker_size_m=SIDE_M)
        marker = berth.Detector(320, 240).detect(image).detections[0]
        self.assertIsNone(marker.pose)
        with self.assertRaisesRegex(berth.Error, "the marker has no pose"):
            berth.PoseFilter(berth.CameraModel.paper(), SIDE_M).update(1, marker)


class Threads(unittest.TestCase):
    def test_detect_lets_other_threads_run(self):
        """No thread gives up the GIL by itself here: the other one runs only if detect does."""
        image, ran, held = photo(), threading.Event(), threading.Lock()
        detector = detector_for(image)

        def other():
            with held:
                ran.set()

        interval = sys.getswitchinterval()
        held.acquire()
        thread = threading.Thread(target=other)
        thread.start()
        try:
            sys.setswitchinterval(1000)
            held.release()
            frames = 0
            while not ran.is_set() and frames < 20000:
                detector.detect(image)
                frames += 1
        finally:
            sys.setswitchinterval(interval)
        self.assertLess(frames, 20000)
        thread.join()

    def test_threads_may_share_a_detector(self):
        image = photo()
        detector = detector_for(image, corners="photometric")
        expected = detector.detect(image).detections[0].corners
        wrong = []

        def look():
            for _ in range(20):
                if not np.array_equal(detector.detect(image).detections[0].corners, expected):
                    wrong.append(1)

        threads = [threading.Thread(target=look) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])


class Programs(unittest.TestCase):
    def test_the_example_prints_a_pose(self):
        said = subprocess.run([sys.executable, str(ROOT / "examples/print_pose.py"), PHOTO], check=True,
                              capture_output=True, text=True).stdout
        self.assertRegex(said, r"^tag36h11 7 at -?\d\.\d{4} -?\d\.\d{4} 0\.\d{4} m\n$")

    def test_every_program_of_the_document_runs(self):
        programs = re.findall(r"```python\n(.*?)```", (ROOT / "docs/python.md").read_text(), re.DOTALL)
        self.assertGreater(len(programs), 2)
        back = os.getcwd()
        with tempfile.TemporaryDirectory() as folder:
            for name in ("scenarios", "bundles"):
                os.symlink(ROOT / name, pathlib.Path(folder, name))
            os.symlink(PHOTO, pathlib.Path(folder, "dock.png"))
            berth.CameraModel.paper(320, 240).write(f"{folder}/camera.yaml")
            os.chdir(folder)
            try:
                for program in programs:
                    exec(compile(program, "docs/python.md", "exec"), {})
            finally:
                os.chdir(back)

    def test_the_stubs_name_what_there_is(self):
        tree = ast.parse(pathlib.Path(berth.__file__).with_name("_berth.pyi").read_text())
        classes = {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)}
        for name, node in classes.items():
            members = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
            public = {member for member in vars(getattr(berth, name)) if not member.startswith("_")}
            self.assertLessEqual(public, members, name)
        self.assertLessEqual({"Detector", "Source", "CameraModel", "FrameResult", "PoseFilter"}, set(classes))


if __name__ == "__main__":
    unittest.main()
