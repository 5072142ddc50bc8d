// What the live view and the report tell of frames, and the command's options for them.
#include "web_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <thread>

#include "berth/pose_filter.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "stream.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "support/web_client.hpp"
#include "web_messages.hpp"
#include "web_samples.hpp"

namespace berth::cli {
namespace {

using test::ScratchFolder;
using test::text_of;
using test::WebClient;
using testing::HasSubstr;
using testing::Not;

constexpr double kDegree = 0.017453292519943295;
const std::string kScenario = std::string(BERTH_SOURCE_DIR) + "/scenarios/approach.toml";

/// Rz · Ry · Rx of degrees.
std::array<double, 9> turned(double a, double b, double c) {
  const double ca = std::cos(a * kDegree), sa = std::sin(a * kDegree), cb = std::cos(b * kDegree),
               sb = std::sin(b * kDegree), cc = std::cos(c * kDegree), sc = std::sin(c * kDegree);
  return {cc * cb,
          cc * sb * sa - sc * ca,
          cc * sb * ca + sc * sa,
          sc * cb,
          sc * sb * sa + cc * ca,
          sc * sb * ca - cc * sa,
          -sb,
          cb * sa,
          cb * ca};
}

/// rotation(w) · R for a small w, rad, about the camera's axes.
std::array<double, 9> nudged(const std::array<double, 9>& R, const std::array<double, 3>& w) {
  const std::array<double, 9> small = {1, -w[2], w[1], w[2], 1, -w[0], -w[1], w[0], 1};
  std::array<double, 9> product = {};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) product[3 * i + k] += small[3 * i + j] * R[3 * j + k];
    }
  }
  return product;
}

TEST(SixAxes, AreThePoseInDegreesAboutTheCamerasAxes) {
  Pose pose;
  pose.t = {0.1, -0.2, 1.5};
  pose.R = turned(10, -20, 130);
  const SixAxes axes = six_axes(pose, nullptr);
  const std::array<double, 6> expected = {0.1, -0.2, 1.5, 10, -20, 130};
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(axes.value[i], expected[i], 1e-9);
    EXPECT_TRUE(std::isnan(axes.deviation[i]));
  }
}

TEST(SixAxes, DeviationsAreWhatSmallTurnsMakeOfTheAngles) {
  Pose pose;
  pose.t = {0.1, -0.2, 1.5};
  pose.R = turned(35, -50, 70);
  // Of one turn w: the angles' deviations are how far w moves them.
  const std::array<double, 3> w = {3e-5, -2e-5, 5e-5};
  std::array<double, 36> covariance = {};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) covariance[6 * (3 + i) + 3 + k] = w[i] * w[k];
    covariance[7 * i] = (i + 1) * (i + 1) * 1e-6;
  }
  const SixAxes axes = six_axes(pose, &covariance);
  Pose other = pose;
  other.R = nudged(pose.R, w);
  const SixAxes moved = six_axes(other, nullptr);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(axes.deviation[i], (i + 1) * 1e-3, 1e-12);
    EXPECT_NEAR(axes.deviation[3 + i], std::abs(moved.value[3 + i] - axes.value[3 + i]), 2e-6);
    EXPECT_GT(axes.deviation[3 + i], 1e-4);
  }
  // Where two of the axes are one, nothing can be said.
  pose.R = turned(35, 90, 0);
  EXPECT_TRUE(std::isnan(six_axes(pose, &covariance).deviation[3]));
}

/// A frame of the docking corpus, or of a marker at a range, as the stream hands it on.
struct Frame {
  FrameResult result;
  GrayImage image;
  std::string label = "picture";
  std::optional<CameraModel> camera = paper_camera(320, 240);
  std::vector<TruthMarker> truth;
  std::vector<TruthTarget> truth_targets;

  explicit Frame(double range_m = 1, double time_s = 0) : image(320, 240) {
    Detection d;
    d.family = &family("tag36h11");
    d.id = 7;
    d.corners = {{{100, 80}, {100, 160}, {180, 160}, {180, 80}}};
    d.center = {140, 120};
    d.has_pose = true;
    d.pose.t = {0, 0, range_m};
    d.pose_uncertainty.emplace();
    for (int i = 0; i < 6; ++i) d.pose_uncertainty->covariance[7 * i] = 1e-6;
    result.detections.push_back(d);
    result.status = FrameStatus::ok;
    result.stamp.clock = "camera";
    result.stamp.mid_exposure_ns = static_cast<std::int64_t>(time_s * 1e9);
  }
  ObservedFrame observed() const {
    return {label, image.view(), result, 0,       Mode::docking, camera, nullptr, nullptr, truth, truth_targets, "simd",
            0,     {},           {},     nullptr, nullptr};
  }
};

DetectorConfig config() {
  DetectorConfig config;
  config.camera = paper_camera(320, 240);
  config.marker_size_m = 0.1;
  return config;
}

TEST(WebStatus, SaysWhatTheNewestResultIsWorth) {
  WebStatus status;
  status.frames = 1;
  status.finished_s = 10;
  status.status = FrameStatus::ok;
  EXPECT_EQ(to_json(status, 10.5, false)["valid"], true);
  EXPECT_EQ(to_json(status, 10.5, false)["health"]["mode"], "nominal");
  EXPECT_EQ(to_json(status, 11.5, false)["valid"], false);
  EXPECT_EQ(to_json(status, 11.5, false)["health"]["mode"], "stale");
  EXPECT_EQ(to_json(status, 11.5, true)["valid"], true);  // the run is over, not stuck
  status.engine.mode = HealthMode::fallback;
  EXPECT_EQ(to_json(status, 10.5, false)["health"]["mode"], "fallback");
  status.status = FrameStatus::device_lost;
  EXPECT_EQ(to_json(status, 10.5, false)["valid"], false);
}

TEST(WebSampler, FindsTheClosingSpeedByTheCamerasClock) {
  WebSampler sampler;
  const DetectorConfig detector = config();
  const std::string backend = "simd";
  sampler.begin({320, 240, detector, backend});
  std::vector<WebSample> samples;
  for (int i = 0; i < 30; ++i) {
    samples = sampler.take(Frame(2 - 0.3 * i / 30.0, i / 30.0).observed(), i * 10.0);
    ASSERT_EQ(samples.size(), 1u);
    EXPECT_EQ(std::isnan(samples[0].closing_m_s), i < 4) << i;
  }
  EXPECT_NEAR(samples[0].closing_m_s, 0.3, 1e-9);
  EXPECT_NEAR(samples[0].closing_deviation_m_s, 0, 1e-7);
  EXPECT_NEAR(samples[0].range_deviation_m, 1e-3, 1e-12);
  // After a gap the old slope says nothing.
  samples = sampler.take(Frame(1, 5).observed(), 0);
  EXPECT_TRUE(std::isnan(samples[0].closing_m_s));
  ASSERT_EQ(sampler.objects().size(), 1u);
  EXPECT_EQ(sampler.objects()[0].name, "tag36h11 7");
}

TEST(WebSampler, CountsObjectsBeyondThoseItShows) {
  WebSampler sampler;
  const DetectorConfig detector = config();
  const std::string backend = "simd";
  sampler.begin({320, 240, detector, backend});
  for (int id = 0; id < static_cast<int>(WebSampler::kMost) + 3; ++id) {
    Frame frame;
    frame.result.detections[0].id = id;
    sampler.take(frame.observed(), 0);
  }
  EXPECT_EQ(sampler.objects().size(), WebSampler::kMost);
  EXPECT_EQ(sampler.beyond(), 3u);
}

int port_of(const std::string& said) {
  const std::string before = "http://127.0.0.1:";
  const std::size_t at = said.find(before);
  return at == std::string::npos ? 0 : std::atoi(said.c_str() + at + before.size());
}

TEST(WebView, ShowsThePictureWithWhatBelongsToIt) {
  WebOptions options;
  options.address = "127.0.0.1:0";
  options.source = "a test";
  std::ostringstream said;
  const std::shared_ptr<FrameObserver> view = make_web_view(options, said, [] {});
  const DetectorConfig detector = config();
  const std::string backend = "simd on X";
  view->begin({320, 240, detector, backend});
  WebClient client(port_of(said.str())), events(port_of(said.str()));
  events.get("/events");
  client.get("/video.mjpg");
  client.take_through("\r\n\r\n");
  Frame frame;
  std::fill_n(frame.image.view().data, 320 * 240, u8{90});
  // Only watched pictures are encoded, and the server may not know yet that it is.
  std::thread pipeline([&] {
    for (int i = 0; i < 20; ++i) {
      frame.result.stamp.sequence = static_cast<u64>(i);
      view->observe(frame.observed());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  const std::string head = client.take_through("\r\n\r\n");
  const std::string jpeg = client.take(std::stoul(head.substr(head.find("Content-Length: ") + 16)));
  pipeline.join();
  const std::size_t about_at = head.find("X-Berth-Picture: ") + 17;
  const Json about = Json::parse(head.substr(about_at));
  EXPECT_EQ(about["objects"][0]["name"], "tag36h11 7");
  EXPECT_EQ(about["objects"][0]["corners"][2], Json({180, 160}));
  // Half a side of 80 px to the right of where the pose puts the origin.
  const Json& axes = about["objects"][0]["axes"];
  EXPECT_NEAR(axes[1][0].get<double>() - axes[0][0].get<double>(), 40, 0.5);
  EXPECT_TRUE(axes[0][0].is_number());
  const cv::Mat picture = cv::imdecode(std::vector<char>(jpeg.begin(), jpeg.end()), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(picture.size(), cv::Size(320, 240));
  EXPECT_NEAR(cv::mean(picture)[0], 90, 2);
  view->finish(said);
  EXPECT_THAT(events.read_until("\"ended\":true"), HasSubstr("\"frames\":20"));
}

TEST(WebView, RefusesATokenThatIsNone) {
  const ScratchFolder folder;
  const auto with = [](const std::string& path) {
    WebOptions options;
    options.address = "127.0.0.1:0";
    options.token_file = path;
    std::ostringstream said;
    return test::complaint([&] { make_web_view(options, said, [] {}); });
  };
  EXPECT_THAT(with(folder / "none"), HasSubstr("cannot be read"));
  EXPECT_THAT(with(folder.write("short", std::string("secret\n"))), HasSubstr("has 6 characters; write 16 to 256"));
  EXPECT_THAT(with(folder.write("spaced", std::string("0123456789 abcdef\n"))), HasSubstr("without spaces"));
  EXPECT_EQ(with(folder.write("good", std::string("0123456789abcdef\r\n"))), "");
}

Json data_of(const std::string& page) {
  const std::string mark = "id=\"data\">";
  const std::size_t from = page.find(mark) + mark.size();
  return Json::parse(page.substr(from, page.find("</script>", from) - from));
}

TEST(WebReport, TellsTheRunAsOnePage) {
  const ScratchFolder folder;
  const std::string path = folder / "run.html", log = folder / "log.jsonl";
  const test::CommandRun run = test::run_berth({"run", "--source", "sim:" + kScenario, "--max-frames", "6", "--backend",
                                                "simd", "--json", log, "--report", path});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("report      " + path));
  const std::string page = text_of(path);
  const Json data = data_of(page);
  EXPECT_EQ(data["frames"], 6);
  EXPECT_EQ(data["with_pose"], 6);
  std::size_t poses = 0;
  for (const auto& line : test::CommandRun::json_lines(text_of(log))) {
    for (const auto& detection : line["detections"]) {
      const std::string name =
          detection["family"].get<std::string>() + " " + std::to_string(detection["id"].get<int>());
      const double time_s = (line["mid_exposure_ns"].get<double>() - 1e6) / 1e9;
      int found = 0;
      for (const Json& sample : data["samples"]) {
        if (data["objects"][sample[1].get<std::size_t>()]["name"] != name) continue;
        if (std::abs(sample[4].get<double>() - detection["pose"]["t"][2].get<double>()) < 1e-6) ++found;
      }
      EXPECT_GE(found, 1) << name << " at " << time_s;
      ++poses;
    }
  }
  EXPECT_EQ(data["samples"].size(), poses);
  EXPECT_EQ(data["truth"].size(), poses);
  // All of it is in the page.
  const std::string head = page.substr(0, page.find("id=\"data\""));
  for (const std::string& attribute : {std::string("src=\""), std::string("href=\"")}) {
    for (std::size_t at = head.find(attribute); at != std::string::npos; at = head.find(attribute, at + 1)) {
      EXPECT_EQ(head.substr(at + attribute.size(), 5), "data:") << head.substr(at, 80);
    }
  }
  EXPECT_THAT(page, Not(HasSubstr("<!--scripts-->")));
}

TEST(WebReport, KeepsHalfOfWhatIsTooMuch) {
  const ScratchFolder folder;
  WebOptions options;
  options.report = folder / "run.html";
  options.source = "</script><script>alert(1)";
  const std::shared_ptr<FrameObserver> report = make_web_report(options);
  const DetectorConfig detector = config();
  const std::string backend = "simd";
  report->begin({320, 240, detector, backend});
  Frame frame;
  for (int i = 0; i < 26'000; ++i) {
    frame.result.stamp.mid_exposure_ns = i * 3'333'333LL;
    report->observe(frame.observed());
  }
  std::ostringstream said;
  report->finish(said);
  const Json data = data_of(text_of(options.report));
  EXPECT_EQ(data["frames"], 26'000);
  EXPECT_EQ(data["every"], 2);
  EXPECT_EQ(data["samples"].size(), 13'000u);
  EXPECT_EQ(data["samples"][1][0], 0.0067);
  EXPECT_EQ(data["about"]["source"], options.source);
}

TEST(WebReport, FailsBeforeTheRunWhereItCannotBeWritten) {
  const test::CommandRun run =
      test::run_berth({"run", "--source", "sim:" + kScenario, "--max-frames", "1", "--report", "/nowhere/run.html"});
  EXPECT_EQ(run.exit_code, kBadInput);
  EXPECT_THAT(run.err, HasSubstr("/nowhere/run.html: the report cannot be written"));
  EXPECT_THAT(run.out, Not(HasSubstr("frame ")));
}

TEST(WebOptions, AreRefusedWithTheRemedy) {
  const auto complaint_of = [](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"run", "--source", "sim:" + kScenario, "--max-frames", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const test::CommandRun run = test::run_berth(arguments);
    EXPECT_EQ(run.exit_code, kBadInput);
    return run.err;
  };
  EXPECT_THAT(complaint_of({"--view", "127.0.0.1:99999"}), HasSubstr("--view 127.0.0.1:99999: give ADDRESS:PORT"));
  EXPECT_THAT(complaint_of({"--view", "192.0.2.1:8040"}), HasSubstr("--view 192.0.2.1:8040: cannot be listened on"));
  EXPECT_THAT(complaint_of({"--view-token", "x"}), HasSubstr("--view"));
}

TEST(WebOptions, ServeTheRunTheyAreGivenTo) {
  const test::CommandRun run = test::run_berth(
      {"run", "--source", "sim:" + kScenario, "--max-frames", "2", "--backend", "simd", "--view", "127.0.0.1:0"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_GT(port_of(run.out), 0) << run.out;
}

/// The document's commands, word by word.
std::vector<std::vector<std::string>> commands_of(const std::string& document) {
  std::vector<std::vector<std::string>> commands;
  std::istringstream lines(text_of(std::string(BERTH_SOURCE_DIR) + "/docs/" + document));
  bool is_command = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("```", 0) == 0) {
      is_command = line == "```sh";
    } else if (is_command) {
      std::istringstream words(line);
      commands.emplace_back(std::istream_iterator<std::string>(words), std::istream_iterator<std::string>());
    }
  }
  return commands;
}

TEST(LiveViewDocument, HasCommandsThatRun) {
  const ScratchFolder folder;
  int runs = 0;
  for (const std::vector<std::string>& words : commands_of("live-view.md")) {
    ASSERT_FALSE(words.empty());
    if (words[0] == "openssl") {
      std::string line;
      for (const std::string& word : words) line += word + " ";
      EXPECT_EQ(std::system(("cd " + folder.path() + " && " + line).c_str()), 0) << line;
      continue;
    }
    ASSERT_EQ(words[0], "berth");
    // As it stands, but short, at a port that is free, and in folders of the test's own.
    std::vector<std::string> arguments;
    for (std::size_t i = 1; i < words.size(); ++i) {
      std::string word = words[i];
      const std::string& before = words[i - 1];
      if (word.rfind("sim:", 0) == 0) word = "sim:" + std::string(BERTH_SOURCE_DIR) + "/" + word.substr(4);
      if (before == "--minutes") word = "0.002";
      if (before == "--report" || before == "--view-token" || before == "--record" || before == "view")
        word = folder / word;
      if (before == "--view" && word.rfind("--", 0) != 0) word = word.substr(0, word.find(':')) + ":0";
      arguments.push_back(word);
      const bool is_bare = word == "--view" && (i + 1 == words.size() || words[i + 1].rfind("--", 0) == 0);
      if (is_bare) arguments.emplace_back("127.0.0.1:0");
    }
    const bool is_view = words[1] == "view";
    arguments.insert(arguments.end(), {is_view ? "--address" : "--max-frames", is_view ? "127.0.0.1:0" : "3"});
    const test::CommandRun run = is_view ? test::run_berth_until_interrupted(arguments) : test::run_berth(arguments);
    EXPECT_EQ(run.exit_code, 0) << words.back() << ": " << run.err;
    ++runs;
  }
  EXPECT_GE(runs, 6);
}

}  // namespace
}  // namespace berth::cli
