// Recordings of streams: nothing is lost in silence, a replay comes to the same bits, and a source gives the frames
// back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <functional>
#include <set>

#include "berth/backend.hpp"
#include "berth/bundle.hpp"
#include "camera/sources.hpp"
#include "frame_queue.hpp"
#include "frame_record.hpp"
#include "recorder.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_reader.hpp"
#include "recording/mcap_writer.hpp"
#include "recording/recover.hpp"
#include "ros2/messages.hpp"
#include "sim/random.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "support/counted_allocations.hpp"
#include "support/memory_file.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using cli::FrameQueue;
using cli::Json;
using cli::ObservedFrame;
using cli::QueuedFrame;
using test::CommandRun;
using test::complaint;
using test::run_berth;
using test::ScratchFolder;
using test::text_of;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// Two markers closed in on, small and quick.
std::string scenario(const ScratchFolder& folder, int frames, const std::string& more = "") {
  return folder.write("s.toml",
                      "seed = 5\n[camera]\nwidth = 160\nheight = 120\nframe_rate_hz = 100\nreadout_ms = 2\n" + more +
                          "[trajectory]\nkind = \"approach\"\nframes = " + std::to_string(frames) +
                          "\nfrom_range_m = 0.6\nto_range_m = 0.4\nto_offset_m = [0.0, 0.0]\n"
                          "[[marker]]\nfamily = \"tag36h11\"\nid = 3\nsize_m = 0.1\nposition_m = [0, 0, 0]\n");
}

/// What a stream would hand over, numbered.
struct HandedFrame {
  explicit HandedFrame(int width = 16, int height = 8) : image(width, height) {
    result.detections.resize(2);
    for (Detection& detection : result.detections) detection.family = &family("tag36h11");
  }
  ObservedFrame observed() {
    return {label, image.view(), result, 7, Mode::docking, camera, nullptr, nullptr, truth, targets, "simd", 0, {}, {}};
  }
  void number(u64 n) {
    result.stamp.sequence = n;
    image.view().at(0, 0) = static_cast<u8>(n);
  }

  std::string label = "frame";
  GrayImage image;
  FrameResult result;
  std::optional<CameraModel> camera;
  std::vector<TruthMarker> truth;
  std::vector<TruthTarget> targets;
};

std::vector<Json> records_of(const std::string& path) {
  std::vector<Json> records;
  mcap::Reader reader(path);
  while (const mcap::Message* message = reader.next()) {
    if (reader.channels().at(message->channel).topic != "/berth/record") continue;
    CdrReader fields(message->data, message->size);
    records.push_back(Json::parse(fields.string()));
  }
  return records;
}

TEST(FrameQueue, GivesWhatItWasGiven) {
  FrameQueue queue(2, true, 16, 8);
  HandedFrame handed;
  handed.number(5);
  handed.camera = paper_camera();
  queue.push(handed.observed(), 100, false);
  bool closed = true;
  const QueuedFrame* frame = queue.next(std::chrono::milliseconds(0), closed);
  ASSERT_NE(frame, nullptr);
  EXPECT_FALSE(closed);
  EXPECT_EQ(frame->result.stamp.sequence, 5u);
  EXPECT_EQ(frame->result.detections.size(), 2u);
  EXPECT_EQ(frame->came_ns, 100);
  EXPECT_EQ(frame->camera->fx, paper_camera().fx);
  EXPECT_EQ(queue.picture(*frame).at(0, 0), 5);
  EXPECT_EQ(queue.next(std::chrono::milliseconds(0), closed), nullptr);
  EXPECT_FALSE(closed);
  queue.close();
  EXPECT_EQ(queue.next(std::chrono::milliseconds(0), closed), nullptr);
  EXPECT_TRUE(closed);
}

// A disk that does not keep up costs pictures first, then frames; each is counted, and the next one tells of it.
TEST(FrameQueue, DropsAndCountsWhatThereIsNoRoomFor) {
  FrameQueue queue(2, true, 16, 8);
  HandedFrame handed;
  for (u64 i = 0; i < 11; ++i) {
    handed.number(i);
    queue.push(handed.observed(), 0, false);
  }
  EXPECT_EQ(queue.dropped_pictures(), 6u);
  EXPECT_EQ(queue.dropped_frames(), 3u);
  bool closed = false;
  for (u64 i = 0; i < 8; ++i) {
    const QueuedFrame* frame = queue.next(std::chrono::milliseconds(0), closed);
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->result.stamp.sequence, i);
    EXPECT_EQ(frame->picture >= 0, i < 2);
    EXPECT_EQ(frame->missed_frames, 0u);
    if (i != 3) continue;
    // There is room again.
    handed.number(20);
    queue.push(handed.observed(), 0, false);
  }
  const QueuedFrame* frame = queue.next(std::chrono::milliseconds(0), closed);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->result.stamp.sequence, 20u);
  EXPECT_EQ(frame->missed_frames, 3u);
  EXPECT_EQ(queue.picture(*frame).at(0, 0), 20);
  EXPECT_EQ(queue.next(std::chrono::milliseconds(0), closed), nullptr);
}

TEST(FrameQueue, WaitsForRoomWhereItMay) {
  FrameQueue queue(1, true, 16, 8);
  constexpr u64 kFrames = 200;
  std::thread stream([&] {
    HandedFrame handed;
    for (u64 i = 0; i < kFrames; ++i) {
      handed.number(i);
      queue.push(handed.observed(), 0, true);
    }
    queue.close();
  });
  bool closed = false;
  u64 came = 0;
  while (!closed) {
    const QueuedFrame* frame = queue.next(std::chrono::milliseconds(100), closed);
    if (frame == nullptr) continue;
    EXPECT_EQ(frame->result.stamp.sequence, came);
    EXPECT_EQ(queue.picture(*frame).at(0, 0), static_cast<u8>(came));
    ++came;
  }
  stream.join();
  EXPECT_EQ(came, kFrames);
  EXPECT_EQ(queue.dropped_frames() + queue.dropped_pictures(), 0u);
}

TEST(FrameQueue, TakesNoMemoryForAFrame) {
  FrameQueue queue(4, true, 64, 48);
  HandedFrame handed(64, 48);
  handed.label = std::string(60, 'x');
  handed.result.bundles.resize(2);
  bool closed = false;
  const auto once_round = [&] {
    for (int i = 0; i < 40; ++i) {
      queue.push(handed.observed(), 0, false);
      queue.next(std::chrono::milliseconds(0), closed);
    }
  };
  once_round();
  const std::size_t before = test::allocations();
  once_round();
  EXPECT_EQ(test::allocations(), before);
}

TEST(FrameRecord, NamesTheFirstFieldThatDiffers) {
  const Json was = {{"frame", 1}, {"a", {{"b", {1.5, 2.5, -0.0}}}}, {"stages_us", {{"x", 1}}}};
  Json is = was;
  EXPECT_EQ(cli::first_difference(was, is), "");
  is["stages_us"]["x"] = 9;
  EXPECT_EQ(cli::first_difference(was, is), "");
  is["a"]["b"][1] = 2.5000000000000004;
  EXPECT_EQ(cli::first_difference(was, is), "a.b[1] is 2.5000000000000004, was 2.5");
  is["a"]["b"] = {1.5, 2.5, 0.0};
  EXPECT_EQ(cli::first_difference(was, is), "a.b[2] is 0.0, was -0.0");
  is["a"]["b"] = {1.5};
  EXPECT_EQ(cli::first_difference(was, is), "a.b has 1 entries, had 3");
  is = was;
  is.erase("a");
  EXPECT_THAT(cli::first_difference(was, is), HasSubstr("a is missing"));
  EXPECT_THAT(cli::first_difference(is, was), HasSubstr("a is new"));
}

/// Through the recorder, at once: what a stream of so many small frames leaves.
void record_small(const std::string& path, u64 frames) {
  std::ostringstream out, err;
  cli::Console console(out, err, false);
  cli::RecordOptions options;
  options.file = path;
  cli::Recorder recorder(options, {}, false, std::nullopt, console);
  const DetectorConfig config;
  const std::string backend = "none";
  HandedFrame handed(96, 64);
  recorder.begin({96, 64, config, backend});
  sim::Random random(9);
  for (u64 i = 0; i < frames; ++i) {
    handed.number(i);
    for (int k = 0; k < 3000; ++k) handed.image.view().data[100 + k] = static_cast<u8>(random.bits());
    recorder.observe(handed.observed());
  }
  std::ostringstream people;
  recorder.finish(people);
  ASSERT_THAT(people.str(), HasSubstr(std::to_string(frames) + " frames"));
  ASSERT_EQ(err.str(), "");
}

TEST(Recorder, AThousandFramesCutAtAHundredPlaces) {
  const ScratchFolder folder;
  record_small(folder / "a.mcap", 1000);
  const std::string bytes = text_of(folder / "a.mcap");
  std::vector<std::pair<u64, u64>> chunks;  // where each ends, and the messages up to there
  {
    mcap::RecordScan scan(folder / "a.mcap");
    mcap::Problems problems;
    mcap::ChunkCodec codec;
    mcap::Chunk chunk;
    mcap::Bytes records;
    u64 messages = 0;
    while (scan.next(problems)) {
      if (scan.op() != mcap::Op::chunk) continue;
      ASSERT_EQ(mcap::open_chunk(scan.content(), codec, chunk, records), "");
      mcap::FieldReader fields(records.data(), records.size());
      for (; fields.left() > 0; ++messages) {
        fields.number<u8>();
        fields.take(fields.number<u64>());
      }
      ASSERT_TRUE(fields.ok());
      chunks.emplace_back(scan.offset() + mcap::kRecordHead + scan.content().size(), messages);
    }
  }
  ASSERT_GE(chunks.size(), 5u);
  EXPECT_EQ(records_of(folder / "a.mcap").size(), 1000u);
  sim::Random random(2);
  test::MemoryFile cut, saved;
  for (int i = 0; i < 100; ++i) {
    const auto size = static_cast<u64>(random.integer(8, static_cast<int>(bytes.size()) - 1));
    SCOPED_TRACE(size);
    cut.fill(bytes.substr(0, size));
    u64 whole = 0, messages = 0;
    for (const auto& [end, count] : chunks) {
      if (end <= size) std::tie(whole, messages) = std::make_pair(whole + 1, count);
    }
    const mcap::Recovery found = mcap::examine(cut.path());
    ASSERT_EQ(found.chunks, whole);
    ASSERT_EQ(found.messages, messages);
    if (whole == 0 || i % 10 != 0) continue;
    mcap::recover(cut.path(), saved.path(), "test");
    ASSERT_TRUE(mcap::examine(saved.path()).whole);
    // No frame is parted: each has its record.
    ASSERT_EQ(found.messages_by_topic.at("/berth/image"), found.messages_by_topic.at("/berth/record"));
  }
}

// What did not fit says so in the recording, by topic, and a replay says what it could not compare.
TEST(Recorder, WritesDownWhatWasDropped) {
  const ScratchFolder folder;
  FrameQueue queue(2, true, 16, 8);
  HandedFrame handed;
  for (u64 i = 0; i < 11; ++i) {
    handed.number(i);
    queue.push(handed.observed(), 1'000'000'000, false);
  }
  cli::RecordingFile file(folder / "a.mcap", cli::RecordPictures::raw);
  file.begin({}, DetectorConfig(), "simd on this", std::nullopt, 0);
  bool closed = false;
  while (const QueuedFrame* frame = queue.next(std::chrono::milliseconds(0), closed)) {
    file.write(*frame, queue.picture(*frame), queue.dropped_pictures(), queue.dropped_frames());
    if (frame->result.stamp.sequence == 7) queue.push(handed.observed(), 2'000'000'000, false);
  }
  file.finish(queue.dropped_pictures(), queue.dropped_frames());
  mcap::Reader reader(folder / "a.mcap");
  while (reader.next() != nullptr) {
  }
  ASSERT_NE(reader.find_metadata("berth.end"), nullptr);
  const auto& end = reader.find_metadata("berth.end")->values;
  EXPECT_EQ(end.at("frames"), "9");
  EXPECT_EQ(end.at("dropped /berth/image"), "9");
  EXPECT_EQ(end.at("dropped /berth/detections"), "3");
  EXPECT_EQ(end.count("dropped /diagnostics"), 0u);
  EXPECT_EQ(records_of(folder / "a.mcap").back().at("missed"), 3);
  const std::unique_ptr<Source> source = open_mcap(folder / "a.mcap");
  std::vector<u64> numbers;
  while (const auto frame = source->next()) numbers.push_back(frame->stamp.sequence);
  EXPECT_THAT(numbers, ElementsAre(0, 1, 10));
  EXPECT_EQ(source->health().lost, 9u);
}

// RLIMIT_FSIZE fails as a full disk does: at some byte, and from then on.
TEST(Recorder, AFullDiskEndsTheRecordingAndNotTheRun) {
  const ScratchFolder folder;
  const std::string source = "sim:" + scenario(folder, 30);
  rlimit usual = {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &usual), 0);
  rlimit small = usual;
  small.rlim_cur = 100'000;
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const CommandRun run = run_berth({"run", "--source", source, "--record", folder / "a.mcap"});
  setrlimit(RLIMIT_FSIZE, &usual);
  std::signal(SIGXFSZ, before);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.out, HasSubstr("30 frames, 30 with markers"));
  EXPECT_THAT(run.err, HasSubstr("a.mcap: writing the recording failed (File too large); free some space"));
  const mcap::Recovery found = mcap::examine(folder / "a.mcap");
  EXPECT_TRUE(found.whole);
  // What was on the disk before stays, as much as it is; with what the run says it dropped, it is every frame.
  const auto kept = found.messages_by_topic.find("/berth/record");
  const u64 frames = kept == found.messages_by_topic.end() ? 0 : kept->second;
  ASSERT_LT(frames, 30u);
  EXPECT_THAT(run.out, HasSubstr("a.mcap: " + std::to_string(frames) + " frame"));
  EXPECT_THAT(run.out, HasSubstr("dropped " + std::to_string(30 - frames) + " of "));
}

TEST(Record, ReplaysToTheSameBitsOnEveryBackend) {
  const ScratchFolder folder;
  const std::string file = folder / "a.mcap";
  const CommandRun run = run_berth({"run", "--source", "sim:" + scenario(folder, 12), "--record", file, "--digests"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("recording   " + file + ": 12 frames, "));
  const std::vector<Json> records = records_of(file);
  ASSERT_EQ(records.size(), 12u);
  EXPECT_EQ(records[11]["frame"], 11);
  EXPECT_EQ(records[11]["clock"], "simulation");
  EXPECT_EQ(records[11]["truth"].size(), 1u);
  EXPECT_GT(records[11]["digests"].size(), 5u);
  EXPECT_EQ(records[11]["detections"][0]["id"], 3);
  EXPECT_TRUE(records[11]["detections"][0].contains("pose"));
  // The scenario is not needed any more.
  std::filesystem::remove(folder / "s.toml");
  for (const char* backend : {"reference", "cpu", "simd", "opencl", "vulkan"}) {
    SCOPED_TRACE(backend);
    try {
      open_backend(backend, {});
    } catch (const Error&) {
      continue;  // tests of the backends say whether it must be there
    }
    const CommandRun replay = run_berth({"replay", file, "--backend", backend});
    EXPECT_EQ(replay.exit_code, 0) << replay.err << replay.out;
    EXPECT_THAT(replay.out, HasSubstr("backend " + std::string(backend)));
    EXPECT_THAT(replay.out, HasSubstr("replay      12 frames, each equal to the recording bit for bit"));
  }
  const CommandRun some = run_berth({"replay", file, "--max-frames", "5"});
  EXPECT_EQ(some.exit_code, 0) << some.err;
  EXPECT_THAT(some.out, HasSubstr("replay      5 frames, each equal to the recording bit for bit\n"));
  EXPECT_THAT(some.out, Not(HasSubstr("no picture")));
}

TEST(Record, OfNoFrameIsAWholeFile) {
  const ScratchFolder folder;
  const std::string picture = folder.write("a.png", std::string("no picture"));
  const CommandRun run = run_berth({"run", "--source", picture, "--record", folder / "a.mcap"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.out, HasSubstr("a.mcap: 0 frames, 0.0 MB\n"));
  EXPECT_TRUE(mcap::examine(folder / "a.mcap").whole);
}

TEST(Record, AtACamerasPaceToo) {
  const ScratchFolder folder;
  const std::string file = folder / "a.mcap";
  const CommandRun run = run_berth({"run", "--source", "sim:" + scenario(folder, 12), "--record", file, "--fps", "50"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const CommandRun replay = run_berth({"replay", file});
  EXPECT_EQ(replay.exit_code, 0) << replay.err << replay.out;
  EXPECT_THAT(replay.out, HasSubstr(", each equal to the recording bit for bit"));
  const std::vector<Json> records = records_of(file);
  ASSERT_FALSE(records.empty());
  EXPECT_EQ(records[0]["clock"], "monotonic");
  EXPECT_GT(records[0]["laps_us"]["latency"], 0);

  // Windows that went by results of frames before the last one.
  const CommandRun tracked =
      run_berth({"run", "--source", "sim:" BERTH_SOURCE_DIR "/scenarios/track.toml", "--max-frames", "20", "--record",
                 folder / "b.mcap", "--fps", "50", "--track", "--filter"});
  ASSERT_EQ(tracked.exit_code, 0) << tracked.err;
  EXPECT_THAT(tracked.out, HasSubstr("in windows"));
  const CommandRun again = run_berth({"replay", folder / "b.mcap"});
  EXPECT_EQ(again.exit_code, 0) << again.err << again.out;
}

TEST(Record, KeepsEverythingThatAReplayNeeds) {
  const ScratchFolder folder;
  const std::string file = folder / "a.mcap", source = scenario(folder, 4);
  write_camera_info(folder / "cam.yaml", paper_camera(160, 120));
  Bundle bundle;
  bundle.name = "dock";
  bundle.markers.push_back({&family("tag36h11"), 3, 0.1, {}});
  write_bundle(folder / "dock.yaml", bundle);
  const CommandRun run = run_berth({"run", "--source", "sim:" + source, "--camera", folder / "cam.yaml", "--bundle",
                                    folder / "dock.yaml", "--corners", "photometric", "--max-hamming", "1", "--track",
                                    "--filter", "--record", file, "--record-images", "png", "--backend", "cpu"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(records_of(file)[3]["bundles"][0]["used"], 1);
  EXPECT_EQ(records_of(file)[3]["filtered"].size(), 1u);
  EXPECT_TRUE(records_of(file)[3].contains("search"));
  for (const char* name : {"cam.yaml", "dock.yaml", "s.toml"}) std::filesystem::remove(folder / name);
  const CommandRun replay = run_berth({"replay", file});
  EXPECT_EQ(replay.exit_code, 0) << replay.err << replay.out;
  EXPECT_THAT(replay.out, HasSubstr("recorded by berth "));
  EXPECT_THAT(replay.out, HasSubstr("backend cpu on "));
  EXPECT_THAT(replay.out, HasSubstr("replay      4 frames, each equal to the recording bit for bit"));
}

/// The recording with one frame's record changed, and without the picture of another.
void tamper(const std::string& from, const std::string& to, int frame, const std::function<void(Json&)>& change,
            int without_picture = -1) {
  mcap::Reader reader(from);
  mcap::Writer writer(to, "ros2", "test");
  for (const mcap::Metadata& metadata : reader.metadata()) writer.add(metadata);
  for (const auto& [id, channel] : reader.channels()) {
    writer.add(*reader.schema_of_channel(id));
    writer.add(channel);
  }
  while (const mcap::Message* message = reader.next()) {
    const bool is_picture = reader.channels().at(message->channel).topic == "/berth/image";
    if (is_picture && static_cast<int>(message->sequence) == without_picture) continue;
    mcap::Message copy = *message;
    ros2::CdrWriter cdr;
    if (reader.channels().at(message->channel).topic == "/berth/record") {
      Json record = Json::parse(CdrReader(message->data, message->size).string());
      if (record["frame"] == frame) change(record);
      cdr.begin();
      cdr.string(cli::to_line(record));
      copy.data = cdr.bytes().data();
      copy.size = cdr.bytes().size();
    }
    writer.write(copy);
  }
  writer.finish();
}

TEST(Replay, NamesTheFirstFrameAndFieldThatDiffers) {
  const ScratchFolder folder;
  ASSERT_EQ(run_berth({"run", "--source", "sim:" + scenario(folder, 5), "--record", folder / "a.mcap"}).exit_code, 0);
  tamper(folder / "a.mcap", folder / "b.mcap", 3, [](Json& record) {
    double& z = record["detections"][0]["pose"]["t"][2].get_ref<double&>();
    z = std::nextafter(z, 1.0);
  });
  const CommandRun replay = run_berth({"replay", folder / "b.mcap"});
  EXPECT_EQ(replay.exit_code, 1);
  EXPECT_THAT(replay.out, HasSubstr("replay      1 of 5 frames differ; the first: frame 3 ("));
  EXPECT_THAT(replay.out, HasSubstr("): detections[0].pose.t[2] is 0."));
  tamper(folder / "a.mcap", folder / "c.mcap", 0, [](Json& record) { record["digest"] = "0123456789abcdef"; });
  EXPECT_THAT(run_berth({"replay", folder / "c.mcap"}).out, HasSubstr("): digest is "));
  // A record that makes no sense is a complaint, not a crash.
  tamper(folder / "a.mcap", folder / "d.mcap", 1, [](Json& record) { record["truth"] = "none"; });
  const CommandRun odd = run_berth({"replay", folder / "d.mcap"});
  EXPECT_NE(odd.exit_code, 0);
  EXPECT_THAT(odd.err, HasSubstr("a frame's record cannot be read"));
}

/// A recording whose disk did not keep up: frame 2 has no picture, and one is missing before frame 4.
TEST(Replay, SaysWhatItCouldNotCompare) {
  const ScratchFolder folder;
  for (const bool filtered : {false, true}) {
    std::vector<std::string> run = {"run", "--source", "sim:" + scenario(folder, 6), "--record", folder / "a.mcap"};
    if (filtered) run.push_back("--filter");
    ASSERT_EQ(run_berth(run).exit_code, 0);
    tamper(
        folder / "a.mcap", folder / "b.mcap", 4, [](Json& record) { record["missed"] = 1; }, 2);
    const CommandRun replay = run_berth({"replay", folder / "b.mcap"});
    EXPECT_EQ(replay.exit_code, 1);
    EXPECT_THAT(replay.out,
                HasSubstr(filtered ? "replay      2 frames, each equal" : "replay      5 frames, each equal"));
    EXPECT_THAT(replay.out, HasSubstr("1 more have no picture to replay"));
    EXPECT_THAT(replay.out, HasSubstr("1 were dropped while recording"));
    const bool says = replay.out.find("3 follow a gap and were not compared") != std::string::npos;
    EXPECT_EQ(says, filtered) << replay.out;
  }
}

TEST(Replay, RefusesWhatIsNoRecordingOfARun) {
  const ScratchFolder folder;
  mcap::Writer(folder / "empty.mcap", "", "").finish();
  const CommandRun run = run_berth({"replay", folder / "empty.mcap"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("empty.mcap: it does not say how it was made"));
  {
    mcap::Writer writer(folder / "odd.mcap", "", "");
    writer.add(mcap::Metadata{"berth", {{"camera", "{\"width\": 0}"}, {"options", "[]"}}});
    writer.finish();
  }
  EXPECT_THAT(run_berth({"replay", folder / "odd.mcap"}).err, HasSubstr("field 'options' cannot be read"));
  EXPECT_THAT(complaint([&] { open_mcap(folder / "odd.mcap"); }), HasSubstr("the recorded camera cannot be read"));
  const std::string source = scenario(folder, 2);
  const std::vector<std::string> record = {
      "run", "--source", "sim:" + source, "--record", folder / "a.mcap", "--record-images", "none"};
  ASSERT_EQ(run_berth(record).exit_code, 0);
  EXPECT_THAT(run_berth({"replay", folder / "a.mcap"}).err, HasSubstr("record with pictures"));
}

TEST(Recover, SaysHowMuchWasSaved) {
  const ScratchFolder folder;
  const std::string file = folder / "a.mcap";
  ASSERT_EQ(run_berth({"run", "--source", "sim:" + scenario(folder, 5), "--record", file}).exit_code, 0);
  EXPECT_THAT(run_berth({"recover", file}).out, HasSubstr("there is nothing to recover"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.recovered.mcap"));
  const std::string bytes = text_of(file);
  folder.write("a.mcap", bytes.substr(0, bytes.size() - 100));
  const CommandRun cut = run_berth({"replay", file});
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_THAT(cut.err, HasSubstr("berth recover makes a whole file of the rest"));
  EXPECT_THAT(cut.out, HasSubstr("replay      5 frames, each equal"));
  const CommandRun recover = run_berth({"recover", file});
  EXPECT_EQ(recover.exit_code, 0) << recover.err;
  EXPECT_THAT(recover.out, HasSubstr("whole chunks saved"));
  EXPECT_THAT(recover.out, HasSubstr("/berth/image               5"));
  EXPECT_EQ(run_berth({"replay", folder / "a.recovered.mcap"}).exit_code, 0);
  EXPECT_EQ(run_berth({"recover", file, "-o", file}).exit_code, 2);
}

TEST(McapSource, FeedsARunWithTheFramesAsTheyCame) {
  const ScratchFolder folder;
  const std::string source = scenario(folder, 3), file = folder / "a.mcap";
  ASSERT_EQ(run_berth({"run", "--source", "sim:" + source, "--record", file}).exit_code, 0);
  const std::unique_ptr<Source> simulated = open_source("sim:" + source), recorded = open_source(file);
  EXPECT_EQ(recorded->camera()->fx, simulated->camera()->fx);
  EXPECT_EQ(recorded->camera()->distortion, simulated->camera()->distortion);
  for (int i = 0; i < 3; ++i) {
    const std::optional<SourceFrame> was = simulated->next(), is = recorded->next();
    ASSERT_TRUE(was && is);
    EXPECT_EQ(is->label, was->label);
    EXPECT_STREQ(is->stamp.clock, was->stamp.clock);
    EXPECT_EQ(is->stamp.mid_exposure_ns, was->stamp.mid_exposure_ns);
    EXPECT_EQ(is->stamp.exposure_start_ns, was->stamp.exposure_start_ns);
    EXPECT_EQ(is->stamp.arrival_ns, was->stamp.arrival_ns);
    ASSERT_EQ(is->truth.size(), was->truth.size());
    EXPECT_EQ(is->truth[0].corners, was->truth[0].corners);
    EXPECT_EQ(is->truth[0].pose.t, was->truth[0].pose.t);
    ASSERT_EQ(is->image.width(), was->image.width());
    for (int y = 0; y < is->image.height(); ++y) {
      ASSERT_TRUE(
          std::equal(is->image.view().row(y), is->image.view().row(y) + is->image.width(), was->image.view().row(y)));
    }
  }
  EXPECT_EQ(recorded->next(), std::nullopt);
  const CommandRun run = run_berth({"run", "--source", "mcap:" + file, "--record", file});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("it is the source itself"));
  EXPECT_TRUE(mcap::examine(file).whole);
}

/// Images as ROS' camera drivers record them.
TEST(McapSource, ReadsOthersImages) {
  const ScratchFolder folder;
  mcap::Writer writer(folder / "a.mcap", "ros2", "test");
  writer.add(mcap::Schema{1, "sensor_msgs/msg/Image", "ros2msg", ""});
  writer.add(mcap::Schema{2, "sensor_msgs/msg/CompressedImage", "ros2msg", ""});
  writer.add(mcap::Channel{1, 1, "/camera/image_raw", "cdr", {}});
  writer.add(mcap::Channel{2, 2, "/camera/image_raw/compressed", "cdr", {}});
  ros2::CdrWriter cdr;
  const auto send = [&](mcap::u16 channel) {
    writer.write({channel, 0, 0, 0, cdr.bytes().data(), cdr.bytes().size()});
  };
  const auto image = [&](const char* encoding, std::vector<u8> pixels, u32 step, u32 width = 1) {
    cdr.begin();
    cdr.int32(2);
    cdr.uint32(5);
    cdr.string("camera");
    cdr.uint32(1);  // height
    cdr.uint32(width);
    cdr.string(encoding);
    cdr.uint8(0);
    cdr.uint32(step);
    cdr.length(pixels.size());
    cdr.octets(pixels.data(), pixels.size());
    send(1);
  };
  image("mono8", {7, 9}, 2);
  image("rgb8", {255, 0, 0}, 3);
  image("bgr8", {255, 0, 0}, 3);
  image("mono16", {0, 0x80}, 2);
  image("bayer_rggb8", {1}, 1);
  image("mono8", {7}, 1, 100);
  image("mono8", {7}, 1, 1u << 30);
  writer.write({1, 0, 0, 0, cdr.bytes().data(), 9});
  writer.finish();
  const std::unique_ptr<Source> source = open_mcap(folder / "a.mcap");
  const auto next_pixel = [&] {
    const std::optional<SourceFrame> frame = source->next();
    EXPECT_EQ(frame->stamp.mid_exposure_ns, 2'000'000'005);
    EXPECT_STREQ(frame->stamp.clock, "ros");
    return int{frame->image.view().at(0, 0)};
  };
  EXPECT_EQ(next_pixel(), 7);
  EXPECT_EQ(next_pixel(), 76);
  EXPECT_EQ(next_pixel(), 29);
  EXPECT_EQ(next_pixel(), 128);
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("a.mcap#4: its encoding 'bayer_rggb8' is not supported"));
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("a.mcap#5: an image is smaller than it says"));
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("1073741824"));
  EXPECT_THAT(complaint([&] { source->next(); }), HasSubstr("an image is damaged"));
  EXPECT_EQ(source->next(), std::nullopt);

  mcap::Writer second(folder / "b.mcap", "ros2", "test");
  second.add(mcap::Schema{2, "sensor_msgs/msg/CompressedImage", "ros2msg", ""});
  second.add(mcap::Channel{2, 2, "/camera/image_raw/compressed", "cdr", {}});
  const std::string png = text_of(std::string(BERTH_TEST_DATA) + "/tag36h11_7.png");
  const std::vector<u8> file(png.begin(), png.end());
  ros2::write(ros2::CompressedImage{{1, "camera"}, "png", file}, cdr);
  second.write({2, 0, 0, 0, cdr.bytes().data(), cdr.bytes().size()});
  second.finish();
  EXPECT_THAT(run_berth({"run", "--source", folder / "b.mcap"}).out, HasSubstr("1 frame, 1 with markers"));
}

}  // namespace
}  // namespace berth
