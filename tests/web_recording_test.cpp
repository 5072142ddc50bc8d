// A recording in the live view's page: what is handed out of it is what stands in the file, whole, cut off or damaged.
#include "web_recording.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "camera/sources.hpp"
#include "recording/mcap_index.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "support/web_client.hpp"
#include "web_server.hpp"

namespace berth::cli {
namespace {

using test::answer_to_get;
using test::complaint;
using test::run_berth;
using test::ScratchFolder;
using test::text_of;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

constexpr int kFrames = 40;

/// A marker closed in on, small and quick: recorded with its search and a digest of every stage, in several chunks.
class WebRecordingTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder();
    const std::string scenario = folder_->write(
        "s.toml",
        "seed = 5\n[camera]\nwidth = 320\nheight = 240\nframe_rate_hz = 10\n[trajectory]\nkind = \"approach\"\n"
        "frames = " +
            std::to_string(kFrames) +
            "\nfrom_range_m = 0.8\nto_range_m = 0.4\nto_offset_m = [0.0, 0.0]\n"
            "[[marker]]\nfamily = \"tag36h11\"\nid = 3\nsize_m = 0.1\nposition_m = [0, 0, 0]\n");
    const test::CommandRun run = run_berth({"run", "--source", "sim:" + scenario, "--backend", "simd", "--track",
                                            "--json", *folder_ / "log.jsonl", "--record", whole()});
    ASSERT_EQ(run.exit_code, 0) << run.err;
    log_ = new std::vector<nlohmann::json>(test::CommandRun::json_lines(text_of(*folder_ / "log.jsonl")));
    ASSERT_EQ(log_->size(), std::size_t{kFrames});
  }
  static void TearDownTestSuite() {
    delete log_;
    delete folder_;
  }

  static std::string whole() { return *folder_ / "whole.mcap"; }
  static const nlohmann::json& logged(std::size_t frame) { return (*log_)[frame]; }
  /// A copy with its end gone.
  static std::string cut(std::size_t bytes) { return folder_->write("cut.mcap", text_of(whole()).substr(0, bytes)); }

  /// All that is told of the whole, once it has been read.
  static Json track_of(RecordedRun& run) {
    for (int i = 0; i < 6000; ++i) {
      Json track = run.track(0);
      if (track["read"] == track["frames"]) return track;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ADD_FAILURE() << "it is never read to its end";
    return {};
  }

  static ScratchFolder* folder_;
  static std::vector<nlohmann::json>* log_;
};
ScratchFolder* WebRecordingTest::folder_ = nullptr;
std::vector<nlohmann::json>* WebRecordingTest::log_ = nullptr;

TEST_F(WebRecordingTest, TellsEveryFrameInAnyOrder) {
  const std::unique_ptr<RecordedRun> run = RecordedRun::open(whole());
  EXPECT_EQ(run->lack(), "");
  ASSERT_EQ(run->frames(), std::size_t{kFrames});
  for (const std::size_t number : {39u, 0u, 17u, 16u, 38u}) {
    const Json frame = run->frame(number);
    EXPECT_EQ(frame["sequence"], number);
    EXPECT_NEAR(frame["time"].get<double>(), 0.1 * static_cast<double>(number), 1e-3);
    EXPECT_EQ(frame["mode"], "docking");
    EXPECT_EQ(frame["why"].get<std::string>(), logged(number)["search"]["why"]);
    EXPECT_EQ(frame["status"].get<std::string>(), logged(number)["status"]);
    ASSERT_EQ(frame["samples"].size(), 1u);
    EXPECT_EQ(frame["samples"][0]["name"], "tag36h11 3");
    const Json& sample = frame["samples"][0]["sample"];
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(sample[2 + i].get<double>(), logged(number)["detections"][0]["pose"]["t"][i].get<double>(), 1e-6);
    }
    EXPECT_NEAR(sample[19].get<double>(), logged(number)["detections"][0]["pose"]["ambiguity"].get<double>(), 1e-4);
    EXPECT_GT(frame["times"]["device"].get<double>(), 0);
  }
}

TEST_F(WebRecordingTest, ShowsThePictureWithWhatBelongsToIt) {
  const std::unique_ptr<RecordedRun> run = RecordedRun::open(whole());
  const std::unique_ptr<Source> source = open_mcap(whole());
  for (std::size_t number = 0; number < kFrames; ++number) {
    const std::optional<SourceFrame> frame = source->next();
    ASSERT_TRUE(frame);
    if (number % 13 != 0) continue;
    const std::shared_ptr<const WebPicture> picture = run->picture(number);
    ASSERT_NE(picture, nullptr);
    const cv::Mat shown =
        cv::imdecode(std::vector<char>(picture->jpeg.begin(), picture->jpeg.end()), cv::IMREAD_GRAYSCALE);
    ASSERT_EQ(shown.size(), cv::Size(320, 240));
    double difference = 0;
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) difference += std::abs(shown.at<u8>(y, x) - frame->image.view().at(x, y));
    }
    EXPECT_LT(difference / (320 * 240), 4) << number;
    const Json about = Json::parse(picture->about);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(about["objects"][0]["corners"][i][0].get<double>(),
                  logged(number)["detections"][0]["corners"][i][0].get<double>(), 0.006);
    }
    EXPECT_EQ(about["objects"][0]["axes"].size(), 4u);
  }
}

TEST_F(WebRecordingTest, TellsTheWhole) {
  const std::unique_ptr<RecordedRun> run = RecordedRun::open(whole());
  const Json track = track_of(*run);
  EXPECT_EQ(track["problem_count"], 0);
  EXPECT_EQ(track["every"], 1);
  ASSERT_EQ(track["times"].size(), std::size_t{kFrames});
  ASSERT_EQ(track["samples"].size(), std::size_t{kFrames});
  EXPECT_EQ(track["objects"][0]["size"], 0.1);
  for (std::size_t i = 0; i < kFrames; ++i) {
    EXPECT_NEAR(track["times"][i].get<double>(), 0.1 * static_cast<double>(i), 1e-3);
    EXPECT_NEAR(track["samples"][i][4].get<double>(), logged(i)["detections"][0]["pose"]["t"][2].get<double>(), 1e-6);
  }
  // 0.4 m in 3.9 s, eased in and out: in the middle it closes in.
  EXPECT_GT(track["samples"][20][16].get<double>(), 0.05);
  EXPECT_EQ(track["stages"][0][0], "device");
  EXPECT_EQ(run->track(35)["times"].size(), 5u);
  EXPECT_EQ(run->track(35)["samples"].size(), 5u);
}

TEST_F(WebRecordingTest, ReadsWhatIsWholeOfAFileThatIsCutOff) {
  const std::size_t size = text_of(whole()).size();
  const std::unique_ptr<RecordedRun> run = RecordedRun::open(cut(size / 2));
  EXPECT_THAT(run->lack(), AllOf(HasSubstr("it is cut off: "), HasSubstr("berth recover")));
  EXPECT_THAT(run->about()["recording"]["lack"].get<std::string>(), HasSubstr("cut off"));
  EXPECT_GT(run->frames(), 5u);
  EXPECT_LT(run->frames(), std::size_t{kFrames});
  const Json track = track_of(*run);
  EXPECT_EQ(track["problem_count"], 0);
  const std::size_t last = run->frames() - 1;
  EXPECT_EQ(run->frame(last)["sequence"], last);
  EXPECT_NE(run->picture(last), nullptr);
}

TEST_F(WebRecordingTest, GoesOnBehindAChunkThatIsDamaged) {
  std::string bytes = text_of(whole());
  const mcap::IndexedFile file(whole(), [](const std::string&) { return true; });
  ASSERT_TRUE(file.by_index());
  ASSERT_GE(file.chunks().size(), 3u);
  // The index is whole and points to what is not.
  bytes[file.chunks()[1].offset + file.chunks()[1].size / 2] ^= 1;
  const std::unique_ptr<RecordedRun> run = RecordedRun::open(folder_->write("damaged.mcap", bytes));
  EXPECT_EQ(run->frames(), std::size_t{kFrames});
  const Json track = track_of(*run);
  EXPECT_GT(track["problem_count"].get<int>(), 0);
  EXPECT_THAT(track["problems"][0].get<std::string>(), HasSubstr("the chunk at byte"));
  EXPECT_EQ(track["samples"].size() + track["problem_count"].get<std::size_t>(), std::size_t{kFrames});
  EXPECT_EQ(run->frame(kFrames - 1)["sequence"], kFrames - 1);
  int refused = 0;
  for (std::size_t i = 0; i < kFrames; ++i) refused += complaint([&] { run->frame(i); }).empty() ? 0 : 1;
  EXPECT_EQ(refused, track["problem_count"].get<int>());
}

TEST_F(WebRecordingTest, IsTheSameByItsIndexAndWithoutIt) {
  const auto all = [](const std::string&) { return true; };
  const mcap::IndexedFile by_index(whole(), all), scanned(cut(text_of(whole()).size() - 1), all);
  EXPECT_TRUE(by_index.by_index());
  EXPECT_FALSE(scanned.by_index());
  EXPECT_FALSE(scanned.complete());
  ASSERT_EQ(by_index.chunks().size(), scanned.chunks().size());
  for (std::size_t i = 0; i < scanned.chunks().size(); ++i) {
    EXPECT_EQ(by_index.chunks()[i].offset, scanned.chunks()[i].offset);
    EXPECT_EQ(by_index.chunks()[i].size, scanned.chunks()[i].size);
    EXPECT_EQ(by_index.chunks()[i].messages, scanned.chunks()[i].messages);
  }
}

TEST_F(WebRecordingTest, SaysWhatIsNoRecordingOfARun) {
  const auto error_of = [](const std::string& path) {
    const test::CommandRun run = run_berth({"view", path, "--address", "127.0.0.1:0"});
    EXPECT_EQ(run.exit_code, kBadInput);
    return run.err;
  };
  EXPECT_THAT(error_of(*folder_ / "none.mcap"), HasSubstr("the recording cannot be read"));
  EXPECT_THAT(error_of(folder_->write("text.mcap", std::string(100, 'x'))),
              HasSubstr("does not begin as MCAP files do"));
  EXPECT_THAT(error_of(folder_->path()), HasSubstr("no regular file"));
  // Before the first chunk, after the magic.
  EXPECT_THAT(error_of(cut(8)), HasSubstr("no recording of berth run"));
  EXPECT_THAT(error_of(cut(4000)), AllOf(HasSubstr("cut.mcap"), HasSubstr("berth")));
  EXPECT_THAT(run_berth({"view", whole(), "--address", "127.0.0.1:99999"}).err,
              HasSubstr("--address 127.0.0.1:99999: give ADDRESS:PORT"));
}

TEST_F(WebRecordingTest, IsServedWithinBounds) {
  const std::unique_ptr<RecordedRun> run = RecordedRun::open(whole());
  WebFeed feed;
  WebContent content;
  content.feed = &feed;
  content.about_version = [] { return u64{1}; };
  content.about = [&] { return run->about(); };
  content.times = [] { return Json::array(); };
  content.recording = run.get();
  const WebServer server({"127.0.0.1", 0}, content);
  const auto get = [&](const std::string& path) { return answer_to_get(server.port(), path); };
  EXPECT_THAT(get("/frame.json?frame=3"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("\"sequence\":3,")));
  EXPECT_THAT(get("/track.json?from=0"), AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("tag36h11 3")));
  const std::string picture = get("/picture.jpg?frame=39");
  EXPECT_THAT(picture, AllOf(StartsWith("HTTP/1.1 200"), HasSubstr("X-Berth-Picture: {\"sequence\":39,")));
  for (const char* path : {"/frame.json", "/frame.json?frame=", "/frame.json?frame=40", "/frame.json?frame=-1",
                           "/frame.json?frame=1e3", "/picture.jpg?frame=99999999999999999999", "/track.json?from=x"}) {
    EXPECT_THAT(get(path), AllOf(StartsWith("HTTP/1.1 400"), HasSubstr("a number below 40"))) << path;
  }
  test::WebClient events(server.port());
  events.get("/events");
  EXPECT_THAT(events.read_until("\n\n"), HasSubstr("\"recording\":{\"frames\":40,\"lack\":null}"));
  EXPECT_THAT(test::answer_to(server.port(), "POST /control HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n\r\n"),
              StartsWith("HTTP/1.1 403"));
}

TEST_F(WebRecordingTest, IsServedUntilItIsInterrupted) {
  const std::string path = cut(text_of(whole()).size() - 1);
  const test::CommandRun run = test::run_berth_until_interrupted({"view", path, "--address", "127.0.0.1:0"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, StartsWith("view        http://127.0.0.1:"));
  EXPECT_THAT(run.err, HasSubstr("berth: " + path + ": it is cut off"));
}

}  // namespace
}  // namespace berth::cli
