// What a recorder leaves on the disk, wherever that ends.
#include "recorder.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <csignal>
#include <sstream>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "camera/sources.hpp"
#include "frame_queue.hpp"
#include "recording/mcap_reader.hpp"
#include "recording/recover.hpp"
#include "recording_file.hpp"
#include "sim/random.hpp"
#include "support/command_run.hpp"
#include "support/handed_frame.hpp"
#include "support/memory_file.hpp"
#include "support/recorded_run.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using cli::FrameQueue;
using cli::QueuedFrame;
using test::CommandRun;
using test::HandedFrame;
using test::records_of;
using test::run_berth;
using test::ScratchFolder;
using test::small_scenario;
using test::text_of;
using testing::ElementsAre;
using testing::HasSubstr;

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
  const std::string source = "sim:" + small_scenario(folder, 30);
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

}  // namespace
}  // namespace berth
