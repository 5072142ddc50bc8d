// Runs recorded: a replay comes to the same bits or says where it does not, and what is left of a file is recovered.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "berth/bundle.hpp"
#include "camera/sources.hpp"
#include "frame_record.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_reader.hpp"
#include "recording/mcap_writer.hpp"
#include "recording/recover.hpp"
#include "ros2/messages.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "support/recorded_run.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using cli::Json;
using test::CommandRun;
using test::complaint;
using test::records_of;
using test::run_berth;
using test::ScratchFolder;
using test::small_scenario;
using test::text_of;
using testing::HasSubstr;
using testing::Not;

const std::string kTrack = "sim:" BERTH_SOURCE_DIR "/scenarios/track.toml";

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

TEST(Record, ReplaysToTheSameBitsOnEveryBackend) {
  const ScratchFolder folder;
  const std::string file = folder / "a.mcap";
  const CommandRun run =
      run_berth({"run", "--source", "sim:" + small_scenario(folder, 12), "--record", file, "--digests"});
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
  const CommandRun run =
      run_berth({"run", "--source", "sim:" + small_scenario(folder, 12), "--record", file, "--fps", "50"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const CommandRun replay = run_berth({"replay", file});
  EXPECT_EQ(replay.exit_code, 0) << replay.err << replay.out;
  EXPECT_THAT(replay.out, HasSubstr(", each equal to the recording bit for bit"));
  const std::vector<Json> records = records_of(file);
  ASSERT_FALSE(records.empty());
  EXPECT_EQ(records[0]["clock"], "monotonic");
  EXPECT_GT(records[0]["laps_us"]["latency"], 0);

  // Windows that went by results of frames before the last one.
  const CommandRun tracked = run_berth({"run", "--source", kTrack, "--max-frames", "20", "--record", folder / "b.mcap",
                                        "--fps", "50", "--track", "--filter"});
  ASSERT_EQ(tracked.exit_code, 0) << tracked.err;
  EXPECT_THAT(tracked.out, HasSubstr("in windows"));
  const CommandRun again = run_berth({"replay", folder / "b.mcap"});
  EXPECT_EQ(again.exit_code, 0) << again.err << again.out;
}

TEST(Record, KeepsEverythingThatAReplayNeeds) {
  const ScratchFolder folder;
  const std::string file = folder / "a.mcap", source = small_scenario(folder, 4);
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
  ASSERT_EQ(run_berth({"run", "--source", "sim:" + small_scenario(folder, 5), "--record", folder / "a.mcap"}).exit_code,
            0);
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
    std::vector<std::string> run = {"run", "--source", "sim:" + small_scenario(folder, 6), "--record",
                                    folder / "a.mcap"};
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
  const std::string source = small_scenario(folder, 2);
  const std::vector<std::string> record = {
      "run", "--source", "sim:" + source, "--record", folder / "a.mcap", "--record-images", "none"};
  ASSERT_EQ(run_berth(record).exit_code, 0);
  EXPECT_THAT(run_berth({"replay", folder / "a.mcap"}).err, HasSubstr("record with pictures"));
}

TEST(Recover, SaysHowMuchWasSaved) {
  const ScratchFolder folder;
  const std::string file = folder / "a.mcap";
  ASSERT_EQ(run_berth({"run", "--source", "sim:" + small_scenario(folder, 5), "--record", file}).exit_code, 0);
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

}  // namespace
}  // namespace berth
