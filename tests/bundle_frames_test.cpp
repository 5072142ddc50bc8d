// Bundles in whole frames: rendered ones against their truth, and what the detector and the command make of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "berth/bundle.hpp"
#include "berth/detector.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"
#include "sim/render.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "target/symmetric.hpp"

namespace berth {
namespace {

using test::CommandRun;
using test::complaint;
using test::run_berth;
using test::ScratchFolder;
using testing::HasSubstr;

const std::string kRoot = BERTH_SOURCE_DIR;

/// A bundle as the simulator's markers, in front of the camera.
sim::Scene scene_of(const CameraModel& camera, const Bundle& bundle, const Pose& pose) {
  sim::Scene scene;
  scene.camera = camera;
  scene.void_albedo = 0.3;
  for (const BundleMarker& place : bundle.markers) {
    sim::SceneMarker marker;
    marker.family = place.family->name;
    marker.id = place.id;
    marker.size_m = place.size_m;
    marker.pose = compose(pose, place.pose);
    marker.plate_m = 0.002;
    scene.markers.push_back(marker);
  }
  scene.sensor.blur_sigma_px = 0.6;
  return scene;
}

struct Seen {
  BundlePose bundle;
  Detection middle;
  Pose truth;
};

/// Frames of scenarios/approach.toml's board, tilted by up to half a radian, at 0.4 to 0.9 m.
std::vector<Seen> frames(const Bundle& told, const Bundle& built, int count, CornerMethod corners) {
  const CameraModel camera = paper_camera();
  const auto backend = open_backend("simd");
  DetectorConfig config;
  config.camera = camera;
  config.bundles = {told};
  config.corner_method = corners;
  Detector detector(*backend, camera.width, camera.height, config);
  const sim::Renderer renderer(camera, 2);
  sim::Random random(11);
  std::vector<Seen> all;
  for (int i = 0; i < count; ++i) {
    const double z = random.uniform(0.4, 0.9);
    const double rx = random.uniform(-0.5, 0.5), ry = random.uniform(-0.5, 0.5), rz = random.uniform(-3, 3);
    Seen seen;
    // From the file's frame, which has y up and z out of the board.
    seen.truth.R = product(sim::rotation(rx, ry, rz), Mat3{1, 0, 0, 0, -1, 0, 0, 0, -1});
    seen.truth.t = {random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), z};
    sim::Scene scene = scene_of(camera, built, seen.truth);
    scene.seed = random.bits();
    const FrameResult& result = detector.detect(renderer.render(scene).view());
    EXPECT_EQ(result.bundles.size(), 1u);
    seen.bundle = result.bundles.at(0);
    for (const Detection& d : result.detections) seen.middle = d.id == 0 ? d : seen.middle;
    EXPECT_TRUE(seen.bundle.has_pose && seen.middle.has_pose) << i;
    all.push_back(seen);
  }
  return all;
}

Bundle board() { return read_bundles(kRoot + "/bundles/approach.yaml").at(0); }

double squares(const Pose& a, const Pose& b, std::size_t from) {
  const std::array<double, 6> step = step_between(a, b);
  return step[from] * step[from] + step[from + 1] * step[from + 1] + step[from + 2] * step[from + 2];
}

// 20 frames of six: the mean of such a chi-square is within 6 +- 1.5 (95 %); the bounds leave room for what the
// photometric corners' own covariances are off by.
TEST(BundleFrames, AreBetterKnownThanTheirLargestMarker) {
  double by_bundle = 0, by_marker = 0, turned_bundle = 0, turned_marker = 0, nees = 0;
  const std::vector<Seen> all = frames(board(), board(), 20, CornerMethod::photometric);
  for (const Seen& seen : all) {
    EXPECT_EQ(seen.bundle.used, 5);
    EXPECT_EQ(seen.bundle.kept_out, 0);
    // The bundle's origin is that marker's middle; its axes are the marker's, turned about x.
    const Pose marker = compose(seen.middle.pose, inverse(board().markers.at(0).pose));
    by_bundle += squares(seen.bundle.pose, seen.truth, 0);
    by_marker += squares(marker, seen.truth, 0);
    turned_bundle += squares(seen.bundle.pose, seen.truth, 3);
    turned_marker += squares(marker, seen.truth, 3);
    SquareMatrix<6> information{};
    ASSERT_TRUE(invert<6>(seen.bundle.uncertainty.covariance, information));
    nees += quadratic<6>(information, step_between(seen.bundle.pose, seen.truth)) / static_cast<double>(all.size());
  }
  EXPECT_LT(std::sqrt(by_bundle), 0.8 * std::sqrt(by_marker));
  EXPECT_LT(std::sqrt(turned_bundle), 0.5 * std::sqrt(turned_marker));
  EXPECT_GT(nees, 3);
  EXPECT_LT(nees, 8);
}

TEST(BundleFrames, LeaveOutAMarkerThatWasMoved) {
  Bundle moved = board();
  moved.markers.at(3).pose.t[0] += 0.004;
  for (const Seen& seen : frames(board(), moved, 6, CornerMethod::edges)) {
    EXPECT_EQ(seen.bundle.used, 4);
    EXPECT_EQ(seen.bundle.kept_out, 1);
    EXPECT_LT(std::sqrt(squares(seen.bundle.pose, seen.truth, 0)), 0.002);
  }
}

// As in scenarios/nested.toml: from 0.2 m on the large marker is not wholly in the image.
TEST(BundleFrames, NestedMarkersLastToTheEnd) {
  DetectorConfig config;
  config.families = {"tagCustom48h12"};
  config.camera = paper_camera();
  config.bundles = read_bundles(kRoot + "/bundles/nested.yaml");
  const auto backend = open_backend("simd");
  Detector detector(*backend, config.camera->width, config.camera->height, config);
  const sim::Renderer renderer(*config.camera);
  for (const double range_m : {1.0, 0.6, 0.3, 0.15, 0.1, 0.06}) {
    Pose truth;
    truth.R = product(sim::rotation(0.2 * range_m, -0.3 * range_m, 0.2), Mat3{1, 0, 0, 0, -1, 0, 0, 0, -1});
    truth.t = {0.03 * range_m, -0.02 * range_m, range_m};
    sim::Scene scene = scene_of(*config.camera, config.bundles[0], truth);
    scene.markers.at(1).margin_modules = scene.markers.at(1).plate_m = 0;
    const BundlePose pose = detector.detect(renderer.render(scene).view()).bundles.at(0);
    ASSERT_TRUE(pose.has_pose) << range_m;
    EXPECT_EQ(pose.used, range_m > 0.2 ? 2 : 1) << range_m;
    EXPECT_LT(length(add(pose.pose.t, scaled(truth.t, -1))), 0.005 * range_m) << range_m;
  }
}

TEST(BundleFrames, AreRefusedWhereTheyDoNotHold) {
  const auto backend = open_backend("simd");
  DetectorConfig config;
  config.camera = paper_camera();
  const auto made = [&] { Detector detector(*backend, 640, 480, config); };
  EXPECT_THAT(complaint(made), HasSubstr("marker size is 0"));
  config.bundles = {board()};
  EXPECT_EQ(complaint(made), "");
  config.families = {"tag25h9"};
  EXPECT_THAT(complaint(made), HasSubstr("bundle \"approach\" has tag36h11 0, whose family is not looked for; add"));
  config.families = {"tag36h11"};
  config.bundles.push_back(board());
  config.bundles[1].name = "again";
  EXPECT_THAT(complaint(made), HasSubstr("tag36h11 0 is in the bundles \"approach\" and \"again\""));
  config.bundles = {Bundle()};
  EXPECT_THAT(complaint(made), HasSubstr("no markers"));
}

constexpr const char* kSeven = R"(tag_bundles:
  - name: one
    layout: [{id: 7, size: 0.1}, {id: 8, size: 0.2, x: 0.5}]
)";

TEST(CliBundle, DetectListsTheBundles) {
  const ScratchFolder folder;
  const std::string image = std::string(BERTH_TEST_DATA) + "/tag36h11_7.png";
  const std::string bundle = folder.write("one.yaml", std::string(kSeven));
  write_camera_info(folder / "cam.yaml", paper_camera(320, 240));
  const auto run = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "detect");
    arguments.push_back(image);
    return run_berth(arguments);
  };
  const auto with_camera = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--camera", folder / "cam.yaml"});
    return run(arguments);
  };
  const CommandRun sized = with_camera({"--json", "--size", "0.1"});
  ASSERT_TRUE(sized.lines().at(0)["detections"][0].contains("pose")) << sized.err;
  const CommandRun bundled = with_camera({"--json", "--bundle", bundle});
  EXPECT_EQ(bundled.exit_code, 0) << bundled.err;
  const auto line = bundled.lines().at(0);
  EXPECT_EQ(line["detections"][0]["pose"], sized.lines().at(0)["detections"][0]["pose"]);
  ASSERT_EQ(line["bundles"].size(), 1u);
  EXPECT_EQ(line["bundles"][0]["name"], "one");
  EXPECT_EQ(line["bundles"][0]["used"], 1);
  EXPECT_EQ(line["bundles"][0]["kept_out"], 0);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(line["bundles"][0]["pose"]["t"][k], line["detections"][0]["pose"]["t"][k], 1e-6);
  }
  // The file's frame has y and z the other way round.
  EXPECT_NEAR(line["bundles"][0]["pose"]["R"][4], -line["detections"][0]["pose"]["R"][4].get<double>(), 1e-6);
  EXPECT_FALSE(sized.lines().at(0).contains("bundles"));
  EXPECT_THAT(with_camera({"--bundle", bundle}).out, HasSubstr("bundle one: xyz "));
  EXPECT_THAT(with_camera({"--bundle", bundle}).out, HasSubstr("from 1 marker\n"));
  EXPECT_THAT(run({"--bundle", bundle}).err, HasSubstr("no poses: --camera is missing"));
  const CommandRun bad = with_camera({"--bundle", folder / "none.yaml"});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.err, HasSubstr("none.yaml"));
}

TEST(CliBundle, RunScoresThemAgainstTheTruth) {
  const CommandRun run = run_berth({"run", "--source", "sim:" + kRoot + "/scenarios/approach.toml", "--bundle",
                                    kRoot + "/bundles/approach.yaml", "--max-frames", "3", "--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("bundle approach"));
  EXPECT_THAT(run.err, HasSubstr("3/3"));
  ASSERT_EQ(run.lines().size(), 3u);
  for (const nlohmann::json& line : run.lines()) {
    EXPECT_EQ(line["bundles"][0]["used"], 5);
    for (std::size_t i = 0; i < line["detections"].size(); ++i) {  // their own sizes, not scaled again
      const double z = line["detections"][i]["pose"]["t"][2];
      EXPECT_NEAR(z, 1.55, 0.15);
    }
  }
}

TEST(CliBundle, FieldLayoutsTakeTheSizeThatIsGiven) {
  const ScratchFolder folder;
  const std::string image = std::string(BERTH_TEST_DATA) + "/tag36h11_7.png";
  const std::string field =
      folder.write("field.json", std::string(R"({"tags": [{"ID": 7, "pose": {"translation": {"x": 1, "y": 2, "z": 3},
  "rotation": {"quaternion": {"W": 1, "X": 0, "Y": 0, "Z": 0}}}}], "field": {"length": 16.5, "width": 8.2}})"));
  const CommandRun unsized = run_berth({"detect", "--bundle", field, image});
  EXPECT_EQ(unsized.exit_code, 2);
  EXPECT_THAT(unsized.err, HasSubstr("0.1651"));
  write_camera_info(folder / "cam.yaml", paper_camera(320, 240));
  const CommandRun run =
      run_berth({"detect", "--json", "--bundle", field, "--size", "0.1651", "--camera", folder / "cam.yaml", image});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const nlohmann::json line = run.lines().at(0);
  const nlohmann::json &marker = line["detections"][0]["pose"], &pose = line["bundles"][0]["pose"];
  // The marker's middle, 1 2 3 in the field, is where the marker is.
  for (std::size_t i = 0; i < 3; ++i) {
    double at = pose["t"][i];
    for (std::size_t k = 0; k < 3; ++k) at += pose["R"][3 * i + k].get<double>() * static_cast<double>(k + 1);
    EXPECT_NEAR(at, marker["t"][i], 1e-6);
  }
  // The field's z is up: the marker's down, reversed.
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(pose["R"][3 * i + 2], -marker["R"][3 * i + 1].get<double>(), 1e-6);
  }
}

}  // namespace
}  // namespace berth
