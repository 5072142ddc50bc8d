"""Records runs with the command named on the command line, and has other programs' readers open them.

mcap checks every checksum and the indexes, mcap-ros2-support decodes the messages by their schemas, rosbags reads the
file as rosbag2 would.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from mcap.reader import make_reader
from mcap.records import Chunk, Statistics
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

BERTH, SCENARIOS = sys.argv[1:]
FRAMES = 6


def berth(*arguments):
    # Scenarios name each other from the repository's root.
    subprocess.run([BERTH, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL, cwd=Path(SCENARIOS).parent)


def check_by_mcap(path, images):
    """Every frame in every topic, by the index; the same again from start to end."""
    topics, last = {}, {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        statistics = reader.get_summary().statistics
        for _, channel, message, decoded in reader.iter_decoded_messages():
            topics[channel.topic] = topics.get(channel.topic, 0) + 1
            last[channel.topic] = decoded
            assert message.log_time > 1_500_000_000_000_000_000
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
    for topic in (images, "/berth/detections", "/berth/frame", "/berth/record", "/berth/camera_info", "/berth/pose"):
        assert topics[topic] == FRAMES, topics
    assert statistics.message_count == sum(topics.values())
    record = json.loads(last["/berth/record"].data)
    assert record["digest"] == f"{last['/berth/frame'].digest:016x}"
    assert [one.id for one in last["/berth/detections"].detections] == [one["id"] for one in record["detections"]]
    position = last["/berth/pose"].pose.pose.position
    largest = next(one for one in record["detections"] if one["id"] == 0)
    assert [position.x, position.y, position.z] == largest["pose"]["t"]
    assert last["/berth/camera_info"].width == 640
    assert metadata["berth"]["source"].startswith("sim:")
    assert metadata["berth.end"]["frames"] == str(FRAMES)
    with path.open("rb") as file:
        records = list(StreamReader(file, validate_crcs=True).records)
    assert sum(isinstance(one, Statistics) for one in records) == 1
    assert len([one for one in records if isinstance(one, Chunk)]) in (0, statistics.chunk_count)
    return last[images]


def check_by_rosbags(path):
    with AnyReader([path]) as reader:
        count = 0
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
            count += 1
        assert count == reader.message_count > 6 * FRAMES


def check_stations(folder):
    """Two stations' moments: the robot in the dock's frame, and back in tf."""
    path, log = folder / "both.mcap", folder / "log.jsonl"
    berth("stations", f"{SCENARIOS}/stations.toml", "--json", log, "--record", path, "--robot-frame", "r1/base_link")
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    topics = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            topics.setdefault(channel.topic, []).append(decoded)
        assert [a.name for a in reader.iter_attachments()] == ["stations.toml"]
        assert dict((m.name, m.metadata) for m in reader.iter_metadata())["berth.end"] == {"moments": str(len(lines))}
    assert [json.loads(one.data) for one in topics["/berth/moment"]] == lines
    assert len(topics["/berth/pose"]) == len(topics["/tf"]) == len(lines) == 20
    for line, pose, tf in zip(lines, topics["/berth/pose"], topics["/tf"]):
        where, (back,) = pose.pose.pose.position, tf.transforms
        assert pose.header.frame_id == back.child_frame_id == "dock" and back.header.frame_id == "r1/base_link"
        assert [where.x, where.y, where.z] == line["pose"]["t"]
        assert list(pose.pose.covariance) == line["pose"]["covariance"]
        # There and back is nowhere.
        turn, t = [line["pose"]["R"][i:i + 3] for i in (0, 3, 6)], back.transform.translation
        for row, there in zip(turn, line["pose"]["t"]):
            assert abs(row[0] * t.x + row[1] * t.y + row[2] * t.z + there) < 1e-12
    status = topics["/diagnostics"][0].status
    assert [one.name for one in status] == ["berth: stations", "berth: recorder"]
    assert "disagreement" in [value.key for value in status[0].values]
    with AnyReader([path]) as reader:
        for connection, _, raw_message in reader.messages():
            reader.deserialize(raw_message, connection.msgtype)


with tempfile.TemporaryDirectory() as folder:
    raw, png, saved = (Path(folder) / name for name in ("raw.mcap", "png.mcap", "saved.mcap"))
    run = ("run", "--source", f"sim:{SCENARIOS}/approach.toml", "--max-frames", FRAMES, "--record")
    berth(*run, raw)
    image = check_by_mcap(raw, "/berth/image")
    assert (image.encoding, image.width, image.height, len(image.data)) == ("mono8", 640, 480, 640 * 480)
    check_by_rosbags(raw)
    berth(*run, png, "--record-images", "png")
    image = check_by_mcap(png, "/berth/image/compressed")
    assert image.format == "png" and bytes(image.data)[:4] == b"\x89PNG"
    check_by_rosbags(png)
    # A file that was cut off and recovered is whole for them, too.
    whole = raw.read_bytes()
    raw.write_bytes(whole[: len(whole) - 9])
    berth("recover", raw, "-o", saved)
    check_by_rosbags(saved)
    assert saved.read_bytes()[-2000:-1000] == whole[-2000:-1000]
    check_stations(Path(folder))
