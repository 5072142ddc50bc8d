#!/usr/bin/env python3
"""What other libraries make of Berth's ROS 2 messages: read_messages.py ROS2_SAMPLES

The program named writes one message of each sort (sample_messages.cpp). PyPI's rosbags reads them by its own
definitions of ROS 2's messages, mcap-ros2-support by the schemas that Berth gives; both must find the values below.
"""
import math
import pathlib
import subprocess
import sys
import tempfile

from mcap_ros2._dynamic import generate_dynamic
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROTATION = {"x": 0.5, "y": -0.5, "z": 0.1, "w": 0.7}
POSE = {"position": {"x": 0.25, "y": -0.5, "z": 2.0}, "orientation": ROTATION}
TRANSFORM = {"translation": POSE["position"], "rotation": ROTATION}
HEADER = {"stamp": {"sec": 1700000000, "nanosec": 123456789}, "frame_id": "camera"}
TF_HEADER = {"stamp": {"sec": 1, "nanosec": 500000000}, "frame_id": "camera"}
COVARIANCE = [float(i) for i in range(1, 37)]
TAG = {
    "family": "tag36h11", "id": 7, "hamming": 1, "goodness": 0.0, "decision_margin": 40.5,
    "centre": {"x": 50.25, "y": 60.5},
    "corners": [{"x": 41.0, "y": 70.0}, {"x": 62.0, "y": 71.0}, {"x": 60.0, "y": 51.0}, {"x": 40.0, "y": 50.0}],
}


def camera(model, d):
    fx, fy, cx, cy = 669.42, 672.51, 308.825, 237.615
    return {
        "header": HEADER, "height": 480, "width": 640, "distortion_model": model, "d": d,
        "k": [fx, 0, cx, 0, fy, cy, 0, 0, 1], "r": [1, 0, 0, 0, 1, 0, 0, 0, 1],
        "p": [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], "binning_x": 0, "binning_y": 0,
        "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
    }


EXPECTED = [
    ("geometry_msgs/msg/PoseStamped", {"header": HEADER, "pose": POSE}),
    ("geometry_msgs/msg/PoseWithCovarianceStamped",
     {"header": HEADER, "pose": {"pose": POSE, "covariance": COVARIANCE}}),
    ("tf2_msgs/msg/TFMessage", {"transforms": [
        {"header": TF_HEADER, "child_frame_id": "tag36h11:7", "transform": TRANSFORM},
        {"header": TF_HEADER, "child_frame_id": "dock", "transform": TRANSFORM}]}),
    ("apriltag_msgs/msg/AprilTagDetectionArray",
     {"header": HEADER, "detections": [TAG, {**TAG, "family": "aruco4x4_50", "id": 49}]}),
    ("sensor_msgs/msg/Image",
     {"header": HEADER, "height": 2, "width": 3, "encoding": "mono8", "is_bigendian": 0, "step": 3,
      "data": [1, 2, 3, 4, 5, 6]}),
    ("sensor_msgs/msg/CompressedImage", {"header": HEADER, "format": "png", "data": [1, 2, 3, 99, 4, 5, 6, 99]}),
    ("sensor_msgs/msg/CameraInfo", camera("plumb_bob", [-0.1116, 0.1242, 0, 0, 0])),
    ("sensor_msgs/msg/CameraInfo", camera("rational_polynomial", [-0.1116, 0.1242, 0, 0, 0, 0, 0, 0.25])),
    ("sensor_msgs/msg/CameraInfo", camera("equidistant", [-0.1116, 0.1242, 0, 0])),
    ("diagnostic_msgs/msg/DiagnosticArray",
     {"header": {"stamp": {"sec": 2, "nanosec": 1}, "frame_id": ""},
      "status": [{"level": 1, "name": "berth: camera", "message": "12 frames dropped", "hardware_id": "v4l2:video0",
                  "values": [{"key": "dropped", "value": "12"}, {"key": "fps", "value": "70.5"}]},
                 {"level": 0, "name": "berth: detector", "message": "", "hardware_id": "simd", "values": []}]}),
    ("berth_msgs/msg/Frame",
     {"header": HEADER, "sequence": 18000000000000000000, "digest": 0x0123456789abcdef, "label": "a.png",
      "clock": "monotonic", "exposure_start_ns": 5000000000, "mid_exposure_ns": 5000500000,
      "arrival_ns": 5003000000, "status": "ok", "mode": "docking", "change": "marker read", "backend": "simd",
      "latency_ns": 1234567, "quads": 12,
      "times": [{"stage": "device", "ns": 800000}, {"stage": "decode", "ns": 70000}],
      "digests": [{"stage": "threshold", "digest": 0xfedcba9876543210}, {"stage": "contours", "digest": 1}]}),
]


def check(expected, found, where):
    """Compares with dictionaries, lists and values; fields of `found` that are not expected must not be."""
    if isinstance(expected, dict):
        names = set(getattr(found, "__slots__", None) or vars(found)) - {"__msgtype__"}
        extra = {n for n in names if not n.startswith("_")} - set(expected)
        # Constants are no values; the homography is checked in C++.
        extra -= {"OK", "WARN", "ERROR", "STALE", "homography"}
        assert not extra, f"{where}: {extra} are not expected"
        for name, value in expected.items():
            check(value, getattr(found, name), f"{where}.{name}")
    elif isinstance(expected, list):
        assert len(expected) == len(found), f"{where}: {len(found)} elements, {len(expected)} expected"
        for i, value in enumerate(expected):
            check(value, found[i], f"{where}[{i}]")
    elif isinstance(expected, float):
        assert math.isclose(expected, found, abs_tol=1e-15), f"{where}: {found}, {expected} expected"
    else:
        found = found[0] if isinstance(found, bytes) else found  # a `byte`
        assert expected == found, f"{where}: {found}, {expected} expected"


def main():
    store = get_typestore(Stores.ROS2_HUMBLE)
    ours = get_typestore(Stores.EMPTY)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.argv[1], folder], check=True)
        files = pathlib.Path(folder)
        assert len(list(files.glob("*.cdr"))) == len(EXPECTED)
        for i, (name, values) in enumerate(EXPECTED):
            assert (files / f"{i}.type").read_text() == name
            data, schema = (files / f"{i}.cdr").read_bytes(), (files / f"{i}.msg").read_text()
            types = get_types_from_msg(schema, name)
            for part, definition in types.items():
                if part in store.fielddefs:
                    assert store.fielddefs[part][1] == definition[1], f"{part} is not ROS 2's"
            unknown = {part: types[part] for part in types if part not in store.fielddefs}
            if unknown:
                assert {part.split("/")[0] for part in unknown} <= {"apriltag_msgs", "berth_msgs"}
                store.register(unknown)
            message = store.deserialize_cdr(data, name)
            check(values, message, f"rosbags: {name}")
            # Byte for byte what it would have written itself.
            assert bytes(store.serialize_cdr(message, name)) == data, f"rosbags writes {name} otherwise"
            check(values, generate_dynamic(name, schema)[name](data), f"mcap_ros2: {name}")
    print(f"{len(EXPECTED)} messages read by rosbags and mcap-ros2-support")


if __name__ == "__main__":
    main()
