#include "golden/scenes.hpp"

#include "berth/bundle.hpp"
#include "berth/detector.hpp"
#include "berth/navigator.hpp"
#include "berth/pose_filter.hpp"
#include "berth/stations.hpp"
#include "berth/systematic_covariance.hpp"
#include "golden/numbers.hpp"
#include "navigation/window_scorer.hpp"
#include "navset/flight.hpp"
#include "sim/corpus.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"
#include "sim/render.hpp"
#include "sim/scenario.hpp"
#include "support/image_digest.hpp"
#include "support/noisy_corners.hpp"
#include "target/marker_pose.hpp"

namespace berth::golden {
namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kBoardMarker_m = 0.1;  // the large one of golden.toml

const char* name_of(CornerMethod method) { return method == CornerMethod::edges ? "edges" : "photometric"; }

void write_frame(Lines& lines, const std::string& name, const FrameResult& frame) {
  for (const StageDigest& stage : frame.digests) lines.digest(name + " stage " + stage.stage, stage.digest);
  for (const Detection& marker : frame.detections) write(lines, name, marker);
}

void write_pictures(Lines& lines, const Scenes& scenes, Backend& backend) {
  for (const Picture& picture : scenes.pictures) {
    lines.digest(picture.name + " pixels", test::image_digest(picture.image));
    for (const CornerMethod method : {CornerMethod::edges, CornerMethod::photometric}) {
      DetectorConfig config;
      config.families = {"tag36h11", "tagStandard41h12"};
      config.camera = picture.camera;
      config.marker_size_m = picture.marker_size_m;
      config.corner_method = method;
      // The stages do not depend on what the host does with their corners.
      config.digests = method == CornerMethod::edges;
      Detector detector(backend, picture.image.width(), picture.image.height(), config);
      write_frame(lines, picture.name + " " + name_of(method), detector.detect(picture.image.view()));
    }
  }
}

const Detection* find(const FrameResult& frame, int id) {
  for (const Detection& marker : frame.detections) {
    if (marker.id == id && marker.has_pose) return &marker;
  }
  return nullptr;
}

void write_approach(Lines& lines, const Scenes& scenes, Backend& backend, CornerMethod method, const Bundle& board) {
  DetectorConfig config;
  config.camera = scenes.camera;
  config.marker_size_m = kBoardMarker_m;
  config.bundles = {board};
  config.corner_method = method;
  Detector detector(backend, scenes.camera.width, scenes.camera.height, config);
  PoseFilterConfig filtered;
  filtered.camera = scenes.camera;
  filtered.marker_size_m = kBoardMarker_m;
  PoseFilter filter(filtered);
  for (std::size_t i = 0; i < scenes.approach.size(); ++i) {
    const SourceFrame& frame = scenes.approach[i];
    const std::string name = "approach " + std::to_string(i) + " " + name_of(method);
    const FrameResult& result = detector.detect(frame.image.view(), frame.stamp);
    write(lines, name, result.bundles.at(0));
    const Detection* marker = find(result, 0);
    write(lines, name, filter.update(frame.stamp.mid_exposure_ns, marker));
    if (marker == nullptr) continue;
    write(lines, name, *marker);
    CalibrationDeviation deviation;
    deviation.fx = deviation.fy = deviation.cx = deviation.cy = 0.5;
    deviation.distortion[0] = 0.002;
    deviation.marker_size_m = 0.0001;
    std::array<double, 36> covariance{};
    if (systematic_covariance(scenes.camera, kBoardMarker_m, *marker, deviation, covariance)) {
      lines.digest(name + " systematic covariance", covariance.data(), covariance.size());
    }
  }
}

/// Two stations without images: corners with noise, of lenses of both kinds.
void write_stations(Lines& lines) {
  constexpr double kSide_m = 0.08, kNoise_px = 0.1;
  CameraModel fisheye;
  fisheye.width = 640;
  fisheye.height = 480;
  fisheye.fx = fisheye.fy = 300;
  fisheye.cx = 319.5;
  fisheye.cy = 239.5;
  fisheye.distortion = {0.0034, 0.0007, -0.002, 0.0002};
  fisheye.lens = LensModel::equidistant;
  StationPair pair;
  pair.robot.lens = paper_camera();
  pair.dock.lens = fisheye;
  pair.robot.camera = {sim::rotation(0.1, -0.2, 0.3), {0.4, 0.02, -0.03}};
  pair.robot.marker = {sim::rotation(-0.05, 0.1, 1.5), {0.0, 0.1, 0.02}};
  // The other station's camera lies beside the marker and looks back along -z of its frame.
  const Pose back = {sim::rotation(0, kPi, 0), {0.12, 0, 0}};
  pair.dock.camera = compose(pair.robot.marker, back);
  pair.dock.marker = compose(pair.robot.camera, inverse(back));
  for (Station* station : {&pair.robot, &pair.dock}) {
    station->marker_size_m = kSide_m;
    station->corner_deviation_px = kNoise_px;
  }
  sim::Random random(20190417);
  for (int i = 0; i < 4; ++i) {
    // One number after the other: the order of a call's arguments is the compiler's choice.
    const double tilt = random.uniform(-0.4, 0.4), turn = random.uniform(-0.4, 0.4);
    const double x = random.uniform(-0.1, 0.1), z = random.uniform(0.4, 0.9);
    const Pose to_robot = {sim::rotation(tilt, turn, 0.2), {x, 0.03, z}};
    const Pose robot = compose(pair.robot.marker, compose(inverse(to_robot), inverse(pair.robot.camera)));
    const Pose to_dock = compose(inverse(pair.dock.camera), compose(robot, pair.dock.marker));
    const std::string name = "stations " + std::to_string(i);
    const auto view = [&](const Station& station, const Pose& pose, const char* of) {
      Detection marker;
      marker.corners = with_noise(seen_corners(station.lens, pose, kSide_m), kNoise_px, random);
      marker.has_pose =
          marker_pose(station.lens, kSide_m, kNoise_px, marker.corners, marker.pose, marker.pose_uncertainty.emplace());
      write_pose(lines, name + " " + of, marker);
      return marker;
    };
    const Detection seen_by_robot = view(pair.robot, to_robot, "robot");
    const Detection seen_by_dock = view(pair.dock, to_dock, "dock");
    RelativePose relative;
    if (relative_pose(pair, &seen_by_robot, &seen_by_dock, relative)) write(lines, name, relative);
  }
}

/// A window of the network's own size about the frame's middle.
std::vector<u8> middle_of(const GrayImage& image, int side) {
  std::vector<u8> window;
  const int left = (image.width() - side) / 2, top = (image.height() - side) / 2;
  for (int y = 0; y < side; ++y) {
    const u8* row = image.view().row(top + y) + left;
    window.insert(window.end(), row, row + side);
  }
  return window;
}

}  // namespace

Scenes render_scenes(const std::string& root) {
  Scenes scenes;
  for (const std::string& corpus : sim::corpus_names()) {
    const sim::Scene scene = sim::corpus_scene(corpus, 2, kWidth, kHeight);
    scenes.pictures.push_back({corpus, sim::render(scene), scene.camera, sim::truth(scene).at(0).size_m});
  }
  const std::unique_ptr<Source> source = open_scenario(root + "/tests/data/golden.toml");
  scenes.camera = source->camera().value();
  while (std::optional<SourceFrame> frame = source->next()) scenes.approach.push_back(std::move(*frame));
  return scenes;
}

std::vector<std::string> frame_lines(const Scenes& scenes, Backend& backend, const std::string& root) {
  Lines lines;
  write_pictures(lines, scenes, backend);
  const Bundle board = read_bundles(root + "/bundles/approach.yaml").at(0);
  for (std::size_t i = 0; i < scenes.approach.size(); ++i) {
    lines.digest("approach " + std::to_string(i) + " pixels", test::image_digest(scenes.approach[i].image));
  }
  for (const CornerMethod method : {CornerMethod::edges, CornerMethod::photometric}) {
    write_approach(lines, scenes, backend, method, board);
  }
  write_stations(lines);
  return lines.all();
}

std::vector<std::string> network_lines(const Scenes& scenes, Backend& backend, const std::string& root) {
  Lines lines;
  const std::string file = root + "/models/lite.berthnet";
  const Network network = read_network(file);
  WindowScorer scorer(backend, network, 1);
  for (std::size_t i = 0; i < scenes.approach.size(); i += 3) {
    const WindowScore score = scorer.score(middle_of(scenes.approach[i].image, network.side).data(), 1).at(0);
    write(lines, "window " + std::to_string(i), score);
  }
  NavigatorConfig config;
  config.network = file;
  config.camera = navset::Flight::camera();
  Navigator navigator(backend, config.camera->width, config.camera->height, config);
  // Told where the target is, it follows: a few windows a frame, where a search takes hundreds.
  const navset::Flight flight(3, 240);
  for (int i = 0; i < 2; ++i) {
    const navset::FlightFrame frame = flight.frame(i);
    if (i == 0) navigator.expect(frame.x, frame.y, frame.d_px);
    write(lines, "navigator " + std::to_string(i), navigator.look(frame.image.view()));
  }
  return lines.all();
}

}  // namespace berth::golden
