// The command as a user meets it: what goes to standard output, which files appear, which code it ends with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <locale>
#include <opencv2/imgcodecs.hpp>

#include "berth/camera.hpp"
#include "support/command_run.hpp"

namespace berth {
namespace {

using nlohmann::json;
using test::CommandRun;
using test::run_berth;
using test::ScratchFolder;
using test::text_of;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

/// 320 × 200 or so with tag36h11 id 7; see tests/data.
const std::string kImage = std::string(BERTH_TEST_DATA) + "/tag36h11_7.png";

cv::Size image_size() { return cv::imread(kImage, cv::IMREAD_UNCHANGED).size(); }

/// A camera file for kImage.
std::string camera_file(const ScratchFolder& folder) {
  write_camera_info(folder / "cam.yaml", paper_camera(image_size().width, image_size().height));
  return folder / "cam.yaml";
}

std::vector<std::string> keys_of(const nlohmann::ordered_json& object) {
  std::vector<std::string> keys;
  for (const auto& item : object.items()) keys.push_back(item.key());
  return keys;
}

TEST(Command, ExplainsItselfWithExamples) {
  const CommandRun help = run_berth({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_EQ(help.err, "");
  for (const char* name : {"demo", "detect", "run", "verify", "doctor"}) {
    EXPECT_THAT(help.out, HasSubstr(name));
    const CommandRun command_help = run_berth({name, "--help"});
    EXPECT_EQ(command_help.exit_code, 0);
    EXPECT_THAT(command_help.out, HasSubstr("Examples:\n  berth " + std::string(name)));
  }
  EXPECT_THAT(run_berth({"--version"}).out, StartsWith("berth "));
  EXPECT_EQ(run_berth({"--version"}).exit_code, 0);
}

TEST(Detect, JsonLineHasTheDocumentedFields) {
  const CommandRun run = run_berth({"detect", "--json", kImage});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const auto line = nlohmann::ordered_json::parse(run.out);
  EXPECT_THAT(keys_of(line), ElementsAre("image", "ms", "detections"));
  EXPECT_EQ(line["image"], kImage);
  EXPECT_GT(line["ms"], 0);
  ASSERT_EQ(line["detections"].size(), 1u);
  const nlohmann::ordered_json& detection = line["detections"][0];
  EXPECT_THAT(keys_of(detection),
              ElementsAre("family", "id", "hamming", "margin", "corners", "center", "corner_covariance_px2"));
  EXPECT_EQ(detection["corner_covariance_px2"].size(), 64u);
  EXPECT_EQ(detection["family"], "tag36h11");
  EXPECT_EQ(detection["id"], 7);
  EXPECT_EQ(detection["hamming"], 0);
  ASSERT_EQ(detection["corners"].size(), 4u);
  // Counter-clockwise on the screen, where y grows downwards: the signed area is negative.
  double twice_area = 0;
  for (int i = 0; i < 4; ++i) {
    const auto& a = detection["corners"][i];
    const auto& b = detection["corners"][(i + 1) % 4];
    twice_area += a[0].get<double>() * b[1].get<double>() - b[0].get<double>() * a[1].get<double>();
  }
  EXPECT_LT(twice_area, 0);
}

TEST(Detect, AnotherSizeGivesAPoseOnlyWhenToldHow) {
  const ScratchFolder folder;
  const auto pose_with = [&](const CameraModel& camera, const std::vector<std::string>& how, int exit_code) {
    write_camera_info(folder / "other.yaml", camera);
    std::vector<std::string> arguments = {"detect", "--json", "--camera", folder / "other.yaml",
                                          "--size", "0.1",    kImage};
    arguments.insert(arguments.end(), how.begin(), how.end());
    const CommandRun run = run_berth(arguments);
    EXPECT_EQ(run.exit_code, exit_code) << run.err;
    const json marker = run.lines().at(0)["detections"][0];
    return marker.contains("pose") ? marker["pose"]["t"].get<std::array<double, 3>>() : std::array<double, 3>{};
  };
  const cv::Size size = image_size();
  const CameraModel fitting = paper_camera(size.width, size.height);
  const CameraModel twice = paper_camera(2 * size.width, 2 * size.height);
  CameraModel around = fitting;
  around.width += 60;
  around.height += 20;
  around.cx += 30;
  around.cy += 10;
  const std::array<double, 3> expected = pose_with(fitting, {}, 0);
  EXPECT_GT(expected[2], 0);
  EXPECT_EQ(pose_with(twice, {}, 2)[2], 0);
  EXPECT_EQ(pose_with(around, {"--camera-fit", "resize"}, 2)[2], 0);
  EXPECT_EQ(pose_with(around, {"--camera-fit", "crop"}, 0), expected);
  const std::array<double, 3> resized = pose_with(twice, {"--camera-fit", "resize"}, 0);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(resized[i], expected[i], 1e-9);
}

TEST(Detect, PoseNeedsCameraAndSize) {
  const ScratchFolder folder;
  const std::string camera = camera_file(folder);
  const CommandRun with = run_berth({"detect", "--json", "--camera", camera, "--size", "0.1", kImage});
  ASSERT_EQ(with.exit_code, 0) << with.err;
  const json pose = with.lines().at(0)["detections"][0]["pose"];
  EXPECT_EQ(pose["R"].size(), 9u);
  ASSERT_EQ(pose["t"].size(), 3u);
  EXPECT_GT(pose["t"][2], 0);
  EXPECT_EQ(pose["covariance"].size(), 36u);
  EXPECT_GT(pose["covariance"][14].get<double>(), 0);  // of the range
  EXPECT_GT(pose["error_px"].get<double>(), 0.5);      // this camera did not take the image, and it shows
  EXPECT_LE(pose["ambiguity"].get<double>(), 1);
  const CommandRun paper =
      run_berth({"detect", "--json", "--camera", camera, "--size", "0.1", "--pose", "paper", kImage});
  const json closed = paper.lines().at(0)["detections"][0]["pose"];
  EXPECT_FALSE(closed.contains("covariance"));
  EXPECT_NEAR(closed["t"][2].get<double>(), pose["t"][2].get<double>(), 0.1 * pose["t"][2].get<double>());
  const CommandRun twice = run_berth({"detect", "--json", "--camera", camera, "--size", "0.2", kImage});
  EXPECT_NEAR(twice.lines().at(0)["detections"][0]["pose"]["t"][2].get<double>(), 2 * pose["t"][2].get<double>(), 1e-9);
  for (const std::vector<std::string>& half : {std::vector<std::string>{"--camera", camera}, {"--size", "0.1"}}) {
    std::vector<std::string> arguments = {"detect", "--json", kImage};
    arguments.insert(arguments.end(), half.begin(), half.end());
    const CommandRun without = run_berth(arguments);
    EXPECT_EQ(without.exit_code, 0);
    EXPECT_FALSE(without.lines().at(0)["detections"][0].contains("pose"));
    EXPECT_THAT(without.err, HasSubstr("no poses: "));
  }
}

TEST(Detect, PhotometricCornersComeWithTheirCovariance) {
  const CommandRun plain = run_berth({"detect", "--json", kImage});
  EXPECT_FALSE(plain.lines().at(0)["detections"][0].contains("corner_fit"));
  const CommandRun fitted = run_berth({"detect", "--json", "--corners", "photometric", kImage});
  ASSERT_EQ(fitted.exit_code, 0) << fitted.err;
  const json marker = fitted.lines().at(0)["detections"][0];
  ASSERT_TRUE(marker.contains("corner_fit"));
  EXPECT_EQ(marker["corner_covariance_px2"].size(), 64u);
  EXPECT_LT(marker["corner_covariance_px2"][0].get<double>(),
            plain.lines().at(0)["detections"][0]["corner_covariance_px2"][0].get<double>());
  EXPECT_GT(marker["corner_fit"]["noise"].get<double>(), 0);
  EXPECT_NE(run_berth({"detect", "--corners", "guessed", kImage}).exit_code, 0);
}

TEST(Detect, BackendsPrintTheSameNumbers) {
  const auto detections = [](const std::string& backend) {
    const CommandRun run = run_berth({"detect", "--json", "--backend", backend, kImage});
    EXPECT_EQ(run.exit_code, 0) << backend << ": " << run.err;
    return run.lines().at(0)["detections"].dump();
  };
  const std::string reference = detections("reference");
  EXPECT_THAT(reference, HasSubstr("\"id\":7"));
  EXPECT_EQ(detections("simd"), reference);
  EXPECT_EQ(detections("cpu"), reference);
}

TEST(Detect, NamesOfEveryKindSurvive) {
  const ScratchFolder folder;
  for (const std::string name :
       {"über.png", "two words.png", "quote\".png", "back\\slash.png", "tab\t.png", "日本.png"}) {
    std::filesystem::copy_file(kImage, folder / name);
    const CommandRun run = run_berth({"detect", "--json", folder / name});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    ASSERT_EQ(run.lines().size(), 1u);
    EXPECT_EQ(run.lines()[0]["image"], folder / name);
    EXPECT_EQ(run.lines()[0]["detections"].size(), 1u);
  }
  std::filesystem::copy_file(kImage, folder / "latin\xe9.png");
  EXPECT_THAT(run_berth({"detect", "--json", folder / "latin\xe9.png"}).lines().at(0)["image"].get<std::string>(),
              HasSubstr("latin\xef\xbf\xbd.png"));
}

TEST(Detect, FolderMeansEveryImageInItByName) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "deeper");
  for (const char* name : {"b.png", "a.png", "deeper/c.png"}) std::filesystem::copy_file(kImage, folder / name);
  folder.write("notes.txt", std::string("not an image"));
  const auto images = [](const CommandRun& run) {
    std::vector<std::string> names;
    for (const json& line : run.lines()) names.push_back(line["image"]);
    return names;
  };
  EXPECT_THAT(images(run_berth({"detect", "--json", folder.path()})), ElementsAre(folder / "a.png", folder / "b.png"));
  EXPECT_THAT(images(run_berth({"detect", "--json", "-r", folder.path()})),
              ElementsAre(folder / "a.png", folder / "b.png", folder / "deeper/c.png"));
}

TEST(Detect, FamilyListsAreAccepted) {
  for (const std::vector<std::string>& families :
       {std::vector<std::string>{"--family", "tag25h9,tag36h11"}, {"--family", "tag25h9", "--family", "tag36h11"}}) {
    std::vector<std::string> arguments = {"detect", "--json"};
    arguments.insert(arguments.end(), families.begin(), families.end());
    arguments.push_back(kImage);
    const CommandRun run = run_berth(arguments);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.lines().at(0)["detections"].size(), 1u);
  }
  EXPECT_TRUE(run_berth({"detect", "--json", "--family", "tag25h9", kImage}).lines().at(0)["detections"].empty());
}

TEST(Detect, DrawsOnTheImage) {
  const ScratchFolder folder;
  const CommandRun run =
      run_berth({"detect", "--camera", camera_file(folder), "--size", "0.1", "--draw", folder / "seen.png", kImage});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("tag36h11"));
  const cv::Mat drawn = cv::imread(folder / "seen.png", cv::IMREAD_COLOR);
  ASSERT_FALSE(drawn.empty());
  const int factor = drawn.cols / image_size().width;
  EXPECT_EQ(drawn.size(), image_size() * factor);
  // Corner 1 has a red dot.
  const json corner = run_berth({"detect", "--json", kImage}).lines().at(0)["detections"][0]["corners"][0];
  const auto at = [&](int i) { return static_cast<int>((corner[i].get<double>() + 0.5) * factor); };
  const cv::Vec3b pixel = drawn.at<cv::Vec3b>(at(1), at(0));
  EXPECT_GT(pixel[2], 200);
  EXPECT_LT(pixel[1], 120);
}

TEST(Detect, DrawsIntoAFolderWithoutOverwriting) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "x");
  std::filesystem::copy_file(kImage, folder / "x/same.png");
  std::filesystem::copy_file(kImage, folder / "same.png");
  const CommandRun run = run_berth({"detect", "--draw", folder / "out", folder / "same.png", folder / "x/same.png"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_FALSE(cv::imread(folder / "out/same.png").empty());
  EXPECT_FALSE(cv::imread(folder / "out/same_2.png").empty());
}

/// A locale that writes 1234.5 as 1'234,5.
class OddNumbers : public std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '\''; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(Detect, NumbersDoNotDependOnTheLocale) {
  const ScratchFolder folder;
  const std::vector<std::string> arguments = {"detect", "--json", "--camera", camera_file(folder),
                                              "--size", "0.1",    kImage};
  const json plain = run_berth(arguments).lines().at(0)["detections"];
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new OddNumbers));
  const CommandRun odd = run_berth(arguments);
  std::locale::global(before);
  EXPECT_EQ(odd.exit_code, 0) << odd.err;
  EXPECT_EQ(odd.lines().at(0)["detections"], plain);
}

TEST(Run, LogsEveryFrameOfAFolder) {
  const ScratchFolder folder;
  for (const char* name : {"1.png", "2.png", "3.png"}) std::filesystem::copy_file(kImage, folder / name);
  folder.write("2b.png", std::string());
  const CommandRun run = run_berth({"run", "--source", folder.path(), "--json", folder / "log", "--digests"});
  EXPECT_EQ(run.exit_code, 2) << "the empty file is bad input";
  EXPECT_THAT(run.err, HasSubstr("2b.png: the file is empty"));
  EXPECT_THAT(run.out, HasSubstr("3 frames, 3 with markers"));
  const std::vector<json> log = CommandRun::json_lines(text_of(folder / "log"));
  ASSERT_EQ(log.size(), 3u);
  EXPECT_EQ(log[2]["label"], folder / "3.png");
  EXPECT_EQ(log[2]["status"], "ok");
  EXPECT_EQ(log[2]["detections"][0]["id"], 7);
  EXPECT_FALSE(log[2]["digests"].empty());
  EXPECT_EQ(log[2]["digests"], log[0]["digests"]);
}

TEST(Run, FollowsMarkersInWindowsAndSaysWhere) {
  const ScratchFolder folder;
  const CommandRun run = run_berth({"run", "--source", "sim:" BERTH_SOURCE_DIR "/scenarios/track.toml", "--max-frames",
                                    "4", "--json", folder / "log", "--track", "--full-every", "2"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::vector<json> log = CommandRun::json_lines(text_of(folder / "log"));
  ASSERT_EQ(log.size(), 4u);
  const char* const why[] = {"none_held", "held", "regular", "held"};
  for (std::size_t i = 0; i < log.size(); ++i) {
    const json& search = log[i]["search"];
    EXPECT_EQ(search["why"], why[i]) << i;
    EXPECT_EQ(search["whole"], i % 2 == 0) << i;
    EXPECT_EQ(search["windows"].size(), i % 2) << i;
    EXPECT_EQ(search["held"], 1) << i;
    EXPECT_EQ(log[i]["detections"].size(), 1u) << i;
  }
  EXPECT_THAT(run.out, HasSubstr("whole: regular"));
}

// Frames of half the size are filtered, and their windows placed, by what --camera-fit makes of the file's camera.
TEST(Run, FiltersAndTracksByTheCameraThatFits) {
  const ScratchFolder folder;
  write_camera_info(folder / "twice.yaml", paper_camera(1280, 960));
  write_camera_info(folder / "fitting.yaml", resized_camera(paper_camera(1280, 960), 640, 480));
  const auto log_with = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", "--source", "sim:" BERTH_SOURCE_DIR "/scenarios/track.toml", "--max-frames",
                                     "6", "--json", folder / "log", "--track", "--filter", "--camera"});
    const CommandRun run = run_berth(options);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return CommandRun::json_lines(text_of(folder / "log"));
  };
  const std::vector<json> expected = log_with({folder / "fitting.yaml"});
  const std::vector<json> log = log_with({folder / "twice.yaml", "--camera-fit", "resize"});
  ASSERT_EQ(log.size(), 6u);
  for (std::size_t i = 0; i < log.size(); ++i) {
    EXPECT_EQ(log[i]["search"], expected[i]["search"]) << i;
    ASSERT_EQ(log[i]["filtered"].size(), expected[i]["filtered"].size()) << i;
    if (expected[i]["filtered"].empty()) continue;
    const double expected_z = expected[i]["filtered"][0]["t"][2].get<double>();
    EXPECT_NEAR(log[i]["filtered"][0]["t"][2].get<double>(), expected_z, 1e-6) << i;
  }
  EXPECT_FALSE(log.back()["filtered"].empty());
}

TEST(Run, RefusesToTrackWhatWindowsDoNotShow) {
  const CommandRun run = run_berth(
      {"run", "--source", "sim:not_there.toml", "--track", "--target", BERTH_SOURCE_DIR "/targets/port.yaml"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("--track"), HasSubstr("--target"), HasSubstr("leave one of the two out")));
  const CommandRun alone = run_berth({"run", "--source", "sim:not_there.toml", "--full-every", "3"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.err, AllOf(HasSubstr("--full-every"), HasSubstr("--track")));
}

TEST(Run, LogOnStandardOutputIsAllThatIsThere) {
  const CommandRun run = run_berth({"run", "--source", "file:" + kImage, "--json", "-"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  ASSERT_EQ(run.lines().size(), 1u);
  EXPECT_EQ(run.lines()[0]["detections"].size(), 1u);
  EXPECT_THAT(run.err, HasSubstr("1 frame, 1 with markers"));
}

TEST(Run, EndsAtMaxFrames) {
  const ScratchFolder folder;
  for (const char* name : {"1.png", "2.png", "3.png"}) std::filesystem::copy_file(kImage, folder / name);
  EXPECT_EQ(run_berth({"run", "--source", "dir:" + folder.path(), "--json", "-", "--max-frames", "2"}).lines().size(),
            2u);
}

TEST(Run, PlaysAFolderAtACamerasPace) {
  const ScratchFolder folder;
  for (const char* name : {"1.png", "2.png", "3.png"}) std::filesystem::copy_file(kImage, folder / name);
  cv::imwrite(folder / "4.png", cv::Mat(64, 64, CV_8U, cv::Scalar(90)));
  const CommandRun run = run_berth({"run", "--source", "dir:" + folder.path(), "--fps", "20", "--minutes", "0.01",
                                    "--slots", "3", "--deadline", "1000", "--json", folder / "log"});
  EXPECT_EQ(run.exit_code, 2) << "the fourth is of another size";
  EXPECT_THAT(run.err, HasSubstr("4.png: 64x64, but a camera's frames have one size"));
  EXPECT_THAT(run.out, HasSubstr("3 slots: "));
  EXPECT_THAT(run.out, HasSubstr("12 frames offered, "));
  std::vector<json> log = CommandRun::json_lines(text_of(folder / "log"));
  ASSERT_FALSE(log.empty());
  const json summary = log.back()["summary"];
  log.pop_back();
  EXPECT_EQ(summary["offered"], 12);
  EXPECT_EQ(summary["delivered"], log.size());
  const json& dropped = summary["dropped"];
  EXPECT_EQ(dropped["device"].get<std::size_t>() + dropped["host"].get<std::size_t>() +
                dropped["reader"].get<std::size_t>() + log.size(),
            12u);
  EXPECT_EQ(summary["results"]["differing"], 0);
  EXPECT_GT(summary["times_ms"]["latency"]["p50"], 0);
  EXPECT_EQ(summary["late"].size(), 1u);
  for (const json& line : log) {
    EXPECT_EQ(line["clock"], "monotonic");
    EXPECT_EQ(line["detections"][0]["id"], 7);
    EXPECT_GT(line["latency_ms"], 0);
    EXPECT_FALSE(line.contains("ms"));
  }
}

TEST(Run, RefusesAPaceThatCannotBe) {
  const auto refused = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", "--source", "file:" + kImage});
    const CommandRun run = run_berth(options);
    EXPECT_EQ(run.exit_code, 2);
    return run.err;
  };
  EXPECT_THAT(refused({"--fps", "-3"}), HasSubstr("field '--fps'"));
  EXPECT_THAT(refused({"--fps", "3", "--deadline", "0"}), HasSubstr("field '--deadline'"));
  EXPECT_THAT(refused({"--fps", "3", "--slots", "1"}), HasSubstr("1 slots"));
  EXPECT_THAT(refused({"--fps", "3", "--cores", "70000"}), HasSubstr("core 70000 does not exist"));
  EXPECT_THAT(refused({"--fps", "3", "--lockstep", "simd,cpu"}), HasSubstr("leave --fps out"));
  EXPECT_THAT(refused({"--slots", "4"}), HasSubstr("--fps"));
  EXPECT_THAT(run_berth({"run", "--source", "v4l2:/dev/video0", "--fps", "30"}).err, HasSubstr("a pace of its own"));
}

TEST(Demo, FliesFromFirstSightToTheMarker) {
  const ScratchFolder folder;
  const CommandRun run = run_berth({"demo", "--frames", "24", "--seed", "3", "--out", folder / "new/demo"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("-> docking: the marker is read and near"));
  EXPECT_THAT(run.out, HasSubstr("\ndocked; longest gap"));
  EXPECT_THAT(text_of(folder / "new/demo/flight.svg"), StartsWith("<svg "));
  EXPECT_FALSE(cv::imread(folder / "new/demo/flight.png").empty());
}

TEST(Demo, LeavesLogDrawingAndPictureOfAScenario) {
  const ScratchFolder folder;
  const std::string scenario = std::string(BERTH_SOURCE_DIR) + "/scenarios/approach.toml";
  const CommandRun run = run_berth({"demo", "--scenario", scenario, "--out", folder / "new/demo", "--max-frames", "3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("errors against the simulator's truth"));
  const std::vector<json> log = CommandRun::json_lines(text_of(folder / "new/demo/log.jsonl"));
  ASSERT_EQ(log.size(), 3u);
  for (const json& frame : log) {
    ASSERT_FALSE(frame["truth"].empty());
    ASSERT_FALSE(frame["detections"].empty());
    // The estimate of the largest marker is near its truth: 2 % of the range.
    const json& truth = frame["truth"][0]["pose"]["t"];
    const json& found = frame["detections"][0]["pose"]["t"];
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found[i].get<double>(), truth[i].get<double>(), 0.02 * truth[2].get<double>());
    }
  }
  EXPECT_THAT(text_of(folder / "new/demo/trajectory.svg"), StartsWith("<svg "));
  EXPECT_THAT(text_of(folder / "new/demo/trajectory.svg"), HasSubstr("</svg>"));
  EXPECT_FALSE(cv::imread(folder / "new/demo/markers.png").empty());
}

/// Sets an environment variable for one test.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) { setenv(name, value, 1); }
  ~Environment() { unsetenv(name_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
};

TEST(Verify, OneLineForTheBackendAskedFor) {
  const CommandRun run = run_berth({"verify", "--backend", "simd", "--image", kImage});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, StartsWith("simd       ok "));
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1);
}

TEST(Verify, FailsWhenAnExpectedBackendIsMissing) {
  const Environment expect("BERTH_EXPECT", "simd,hovercraft");
  const CommandRun run = run_berth({"verify", "--backend", "simd"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.out, HasSubstr("hovercraft MISSING"));
}

TEST(Doctor, DescribesTheMachine) {
  const CommandRun text = run_berth({"doctor"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_THAT(text.out, HasSubstr("kernel cache"));
  const CommandRun run = run_berth({"doctor", "--json"});
  ASSERT_EQ(run.exit_code, 0);
  const json description = json::parse(run.out);
  ASSERT_FALSE(description["backends"].empty());
  for (const json& backend : description["backends"]) {
    // Each backend has a device or a reason, and what is absent is among what is missing.
    EXPECT_EQ(backend["available"].get<bool>(), !backend["devices"].empty()) << backend;
    EXPECT_EQ(backend["available"].get<bool>(), !backend.contains("absent")) << backend;
  }
  EXPECT_TRUE(description["kernel_cache"]["path"].is_string());
}

TEST(Doctor, FollowsTheCacheFolder) {
  const ScratchFolder folder;
  const Environment cache("XDG_CACHE_HOME", folder.path().c_str());
  std::filesystem::create_directories(folder / "berth");
  folder.write("berth/kernel.bin", std::string("12345"));
  const json description = json::parse(run_berth({"doctor", "--json"}).out);
  EXPECT_EQ(description["kernel_cache"]["path"], folder / "berth");
  EXPECT_EQ(description["kernel_cache"]["entries"], 1);
  EXPECT_EQ(description["kernel_cache"]["bytes"], 5);
}

}  // namespace
}  // namespace berth
