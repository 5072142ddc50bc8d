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
    subprocess.run([BERTH, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


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
