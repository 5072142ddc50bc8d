// Recordings as files: what is written is read again; what is cut off or damaged is told, and the rest is saved.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "recording/mcap_reader.hpp"
#include "recording/mcap_writer.hpp"
#include "recording/recover.hpp"
#include "sim/random.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "support/memory_file.hpp"
#include "support/scratch_folder.hpp"

namespace berth::mcap {
namespace {

using test::complaint;
using test::MemoryFile;
using test::ScratchFolder;
using test::text_of;
using testing::HasSubstr;
using testing::SizeIs;

struct Written {
  u16 channel;
  u32 sequence;
  u64 log_time, publish_time;
  std::string data;
  bool operator==(const Written& other) const {
    return channel == other.channel && sequence == other.sequence && log_time == other.log_time &&
           publish_time == other.publish_time && data == other.data;
  }
};

/// Two topics, `chunks` chunks of three messages each, some compressible and some not.
std::vector<Written> write_small(const std::string& path, int chunks = 4) {
  sim::Random random(1);
  Writer writer(path, "ros2", "berth test");
  writer.add(Schema{1, "std_msgs/msg/String", "ros2msg", "string data\n"});
  writer.add(Channel{1, 1, "/a", "cdr", {{"note", "first"}}});
  writer.add(Channel{2, 1, "/b", "cdr", {}});
  writer.add(Attachment{"camera.yaml", "application/yaml", {'x', ':', '1'}}, 5);
  writer.add(Metadata{"berth", {{"version", "1"}, {"backend", "simd"}}});
  std::vector<Written> all;
  for (int i = 0; i < 3 * chunks; ++i) {
    std::string data(static_cast<std::size_t>(random.integer(0, 60)), 'a');
    if (i % 2 == 0) {
      for (char& c : data) c = static_cast<char>(random.bits());
    }
    all.push_back({static_cast<u16>(1 + i % 2), static_cast<u32>(i), u64{1'000'000'000} + i, u64{7} * i, data});
    const Written& one = all.back();
    writer.write({one.channel, one.sequence, one.log_time, one.publish_time,
                  reinterpret_cast<const u8*>(one.data.data()), one.data.size()});
    if (i % 3 == 2) writer.end_chunk();
  }
  writer.finish();
  return all;
}

std::vector<Written> read_all(Reader& reader) {
  std::vector<Written> all;
  while (const Message* message = reader.next()) {
    all.push_back({message->channel, message->sequence, message->log_time, message->publish_time,
                   std::string(reinterpret_cast<const char*>(message->data), message->size)});
  }
  return all;
}

/// Where each whole chunk ends.
std::vector<u64> chunk_ends(const std::string& path) {
  RecordScan scan(path);
  Problems problems;
  std::vector<u64> ends;
  while (scan.next(problems)) {
    if (scan.op() == Op::chunk) ends.push_back(scan.offset() + kRecordHead + scan.content().size());
  }
  return ends;
}

/// Every byte of the lengths that stand before the records.
std::set<u64> length_bytes(const std::string& path) {
  RecordScan scan(path);
  Problems problems;
  std::set<u64> bytes;
  while (scan.next(problems)) {
    for (u64 i = 1; i < kRecordHead; ++i) bytes.insert(scan.offset() + i);
  }
  return bytes;
}

std::size_t whole_chunks(const std::vector<u64>& ends, u64 size) {
  return static_cast<std::size_t>(std::count_if(ends.begin(), ends.end(), [&](u64 end) { return end <= size; }));
}

TEST(Mcap, IsReadAsItWasWritten) {
  const ScratchFolder folder;
  const std::vector<Written> written = write_small(folder / "a.mcap");
  Reader reader(folder / "a.mcap");
  EXPECT_EQ(read_all(reader), written);
  EXPECT_TRUE(reader.complete());
  EXPECT_EQ(reader.problems().count(), 0u);
  EXPECT_EQ(reader.channels().at(1).topic, "/a");
  EXPECT_EQ(reader.channels().at(1).metadata.at("note"), "first");
  EXPECT_EQ(reader.schema_of_channel(2)->name, "std_msgs/msg/String");
  EXPECT_EQ(reader.schema_of_channel(3), nullptr);
  ASSERT_NE(reader.find_metadata("berth"), nullptr);
  EXPECT_EQ(reader.find_metadata("berth")->values.at("backend"), "simd");
  ASSERT_NE(reader.find_attachment("camera.yaml"), nullptr);
  EXPECT_EQ(reader.find_attachment("camera.yaml")->data, (Bytes{'x', ':', '1'}));
  EXPECT_EQ(reader.find_attachment("other"), nullptr);
  const Recovery found = examine(folder / "a.mcap");
  EXPECT_TRUE(found.whole);
  EXPECT_EQ(found.messages_by_topic, (std::map<std::string, u64>{{"/a", 6}, {"/b", 6}}));
}

// What a camera's computer leaves behind when its power goes.
TEST(Mcap, IsReadUpToTheLastWholeChunkWhereverItIsCut) {
  const ScratchFolder folder;
  const std::vector<Written> written = write_small(folder / "a.mcap");
  const std::vector<u64> ends = chunk_ends(folder / "a.mcap");
  ASSERT_THAT(ends, SizeIs(4));
  const std::string bytes = text_of(folder / "a.mcap");
  MemoryFile cut;
  const std::string path = cut.path();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    SCOPED_TRACE(size);
    cut.fill(bytes.substr(0, size));
    if (size < kMagic.size()) {
      EXPECT_THAT(complaint([&] { examine(path); }), HasSubstr(std::to_string(size) + " bytes are too few"));
      continue;
    }
    const Recovery found = examine(path);
    ASSERT_FALSE(found.whole);
    ASSERT_EQ(found.problems.count(), 0u) << found.problems.kept()[0];
    ASSERT_EQ(found.chunks, whole_chunks(ends, size));
    Reader reader(path);
    const std::vector<Written> read = read_all(reader);
    ASSERT_EQ(read, std::vector<Written>(written.begin(), written.begin() + static_cast<int>(3 * found.chunks)));
  }
}

TEST(Mcap, WhatIsWholeOfACutFileBecomesAWholeFile) {
  const ScratchFolder folder;
  const std::vector<Written> written = write_small(folder / "a.mcap");
  const std::vector<u64> ends = chunk_ends(folder / "a.mcap");
  const std::string bytes = text_of(folder / "a.mcap");
  for (std::size_t chunks = 1; chunks <= ends.size(); ++chunks) {
    // Right behind the chunk; in the midst of its indexes; shortly before the next one is whole.
    for (const u64 size : {ends[chunks - 1], ends[chunks - 1] + 20, (chunks < 4 ? ends[chunks] : bytes.size()) - 1}) {
      SCOPED_TRACE(size);
      const std::string path = folder.write("cut.mcap", bytes.substr(0, size));
      const Recovery found = recover(path, folder / "out.mcap", "berth test");
      EXPECT_EQ(found.chunks, chunks);
      EXPECT_EQ(found.file_bytes, size);
      const Recovery again = examine(folder / "out.mcap");
      EXPECT_TRUE(again.whole);
      Reader reader(folder / "out.mcap");
      EXPECT_EQ(read_all(reader),
                std::vector<Written>(written.begin(), written.begin() + static_cast<int>(3 * chunks)));
      EXPECT_NE(reader.find_metadata("berth"), nullptr);
      EXPECT_NE(reader.find_attachment("camera.yaml"), nullptr);
    }
  }
  // All of it saved: the same file.
  folder.write("cut.mcap", bytes.substr(0, bytes.size() - 1));
  recover(folder / "cut.mcap", folder / "out.mcap", "berth test");
  EXPECT_EQ(text_of(folder / "out.mcap"), bytes);
}

TEST(Mcap, NothingWholeIsNoRecovery) {
  const ScratchFolder folder;
  write_small(folder / "a.mcap");
  const std::string bytes = text_of(folder / "a.mcap");
  const std::string path = folder.write("cut.mcap", bytes.substr(0, chunk_ends(folder / "a.mcap")[0] - 1));
  EXPECT_THAT(complaint([&] { recover(path, folder / "out.mcap", ""); }), HasSubstr("nothing to recover"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out.mcap"));
  EXPECT_THAT(complaint([&] { recover(path, folder.path() + "/./cut.mcap", ""); }), HasSubstr("the recording itself"));
  EXPECT_EQ(text_of(path).size(), chunk_ends(folder / "a.mcap")[0] - 1);
  EXPECT_THAT(complaint([&] { Reader reader(folder.write("b.txt", std::string("no recording"))); }),
              HasSubstr("does not begin as MCAP files do"));
  EXPECT_THAT(complaint([&] { Reader reader(folder.path()); }), HasSubstr("no regular file"));
  EXPECT_THAT(complaint([&] { Reader reader(folder / "none.mcap"); }), HasSubstr("cannot be read"));
}

// Not one bit may turn over unseen, and what it does not touch is still there.
TEST(Mcap, EveryDamagedByteIsTold) {
  const ScratchFolder folder;
  const std::vector<Written> written = write_small(folder / "a.mcap");
  const std::vector<u64> ends = chunk_ends(folder / "a.mcap");
  const std::string bytes = text_of(folder / "a.mcap");
  const std::set<u64> lengths = length_bytes(folder / "a.mcap");
  MemoryFile file;
  for (std::size_t at = kMagic.size(); at < bytes.size(); ++at) {
    SCOPED_TRACE(at);
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << at % 8));
    file.fill(damaged);
    const Recovery found = examine(file.path());
    ASSERT_FALSE(found.whole);
    // A length may swallow what comes next; of anything else a chunk at most is lost, and reading goes on behind it.
    if (lengths.count(at) != 0) continue;
    ASSERT_GE(found.chunks, at < ends.back() ? 3u : 4u);
    Reader reader(file.path());
    std::size_t missing = written.size();
    for (const Written& one : read_all(reader)) missing -= std::count(written.begin(), written.end(), one) == 1 ? 1 : 0;
    ASSERT_LE(missing, 3u);
  }
}

TEST(Mcap, AnyBytesAreReadWithoutHarm) {
  const ScratchFolder folder;
  write_small(folder / "a.mcap");
  const std::string bytes = text_of(folder / "a.mcap");
  MemoryFile file;
  sim::Random random(3);
  for (int round = 0; round < 500; ++round) {
    SCOPED_TRACE(round);
    std::string damaged = bytes.substr(0, static_cast<std::size_t>(random.integer(8, static_cast<int>(bytes.size()))));
    for (int i = random.integer(1, 12); i > 0 && damaged.size() > kMagic.size(); --i) {
      const int at = random.integer(8, static_cast<int>(damaged.size()) - 1);
      // Lengths are mostly 0: large ones are what a reader may trip over.
      damaged[static_cast<std::size_t>(at)] = random.chance(0.5) ? '\xff' : static_cast<char>(random.bits());
    }
    file.fill(damaged);
    EXPECT_LE(examine(file.path()).chunks, 4u);
    Reader reader(file.path());
    EXPECT_LE(read_all(reader).size(), 12u);
  }
}

TEST(Mcap, AChunkThatClaimsTheWorldIsRefused) {
  const ScratchFolder folder;
  std::string bytes(kMagic.begin(), kMagic.end());
  Bytes record;
  FieldWriter fields(record);
  fields.number(static_cast<u8>(Op::chunk));
  fields.number(u64{8 + 8 + 8 + 4 + 4 + 8 + 2});
  for (const u64 value : {u64{0}, u64{0}, u64{1} << 40}) fields.number(value);
  fields.number(u32{0});
  fields.string("");
  fields.number(u64{2});
  fields.number(u16{0});
  bytes.append(record.begin(), record.end());
  const Recovery found = examine(folder.write("bomb.mcap", bytes));
  ASSERT_EQ(found.problems.count(), 1u);
  EXPECT_THAT(found.problems.kept()[0], HasSubstr("the chunk at byte 8 is left out: it claims 1099511627776 bytes"));
}

TEST(McapWriter, AFullDiskLeavesAFileThatIsWholeUpToItsLastChunk) {
  EXPECT_THAT(complaint([] { Writer writer("/dev/full", "ros2", ""); }), HasSubstr("free some space"));
  EXPECT_THAT(complaint([] { Writer writer("/no/such/folder/a.mcap", "ros2", ""); }), HasSubstr("cannot be written"));

  const ScratchFolder folder;
  write_small(folder / "whole.mcap", 3);
  Writer writer(folder / "a.mcap", "ros2", "berth test");
  writer.add(Channel{1, 0, "/a", "cdr", {}});
  const std::string data = "something";
  const Message message{1, 0, 10, 10, reinterpret_cast<const u8*>(data.data()), data.size()};
  writer.write(message);
  writer.end_chunk();
  const u64 size = writer.bytes();
  writer.write(message);
  ASSERT_TRUE(writer.cut_back());
  EXPECT_EQ(writer.waiting(), 0u);
  EXPECT_EQ(writer.bytes(), size);
  writer.finish();
  const Recovery found = examine(folder / "a.mcap");
  EXPECT_TRUE(found.whole);
  EXPECT_EQ(found.messages, 1u);
}

}  // namespace
}  // namespace berth::mcap
