#include "table_readers.hpp"

#include <opencv2/calib3d.hpp>

#include "pose_algebra.hpp"
#include "table/second_station.hpp"
#include "table/stage.hpp"
#include "target/paper_p4p.hpp"
#include "trajectory_svg.hpp"

namespace berth::cli {
namespace {

using Corners = std::array<std::array<double, 2>, 4>;

/// OpenCV's infinitesimal plane-based pose, the better of the two by reprojection.
std::optional<Reading> by_ippe(const CameraModel& camera, double size_m, const Corners& corners) {
  std::vector<cv::Point3d> places;
  std::vector<cv::Point2d> seen;
  for (int i = 0; i < 4; ++i) {
    const std::array<double, 3> place = marker_corner(i, size_m);
    places.emplace_back(place[0], place[1], place[2]);
    const auto& corner = corners[static_cast<std::size_t>(i)];
    seen.emplace_back(corner[0], corner[1]);
  }
  const cv::Matx33d matrix(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const std::vector<double> lens(camera.distortion.begin(), camera.distortion.end());
  cv::Vec3d turn;
  cv::Vec3d shift;
  if (!cv::solvePnP(places, seen, matrix, lens, turn, shift, false, cv::SOLVEPNP_IPPE)) return std::nullopt;
  cv::Matx33d rotation;
  cv::Rodrigues(turn, rotation);
  Reading reading;
  reading.corners = corners;
  for (int i = 0; i < 9; ++i) reading.pose.R[static_cast<std::size_t>(i)] = rotation.val[i];
  reading.pose.t = {shift[0], shift[1], shift[2]};
  return reading;
}

std::optional<Reading> by_paper(const CameraModel& camera, double size_m, const Corners& corners) {
  Reading reading;
  reading.corners = corners;
  if (!paper_p4p(camera, size_m, corners, reading.pose)) return std::nullopt;
  return reading;
}

DetectorConfig config_for(const EngineOptions& options, const CameraModel& camera) {
  DetectorConfig config;
  config.corner_method = corner_method(options);
  config.families = {table::kFamily};
  config.camera = camera;
  config.marker_size_m = 1;  // scaled to the marker of each frame
  return config;
}

// What the stations say, as the marker's pose in the robot's camera.
std::optional<Reading> by_stations(const StationPair& stations, const Detection* robot, const Detection* dock) {
  RelativePose relative;
  if (!relative_pose(stations, robot, dock, relative)) return std::nullopt;
  return Reading{inverse(relative.pose), std::nullopt};
}

}  // namespace

TableReaders::TableReaders(const EngineOptions& options, const CameraModel& camera, int stations)
    : camera_(camera),
      stations_(stations),
      names_({"Berth", "Berth's corners, the paper's P4P", "Berth's corners, OpenCV IPPE"}),
      engine_(open_chosen_backends(options), config_for(options, camera)) {
  if (AprilTagReader::built_in()) {
    apriltag_ = std::make_unique<AprilTagReader>();
    names_.insert(names_.end(), {"AprilTag 3", "AprilTag's corners, OpenCV IPPE"});
  }
  if (stations_ > 1) names_.insert(names_.end(), {"Berth, the plate's camera", "Berth, both cameras"});
}

std::optional<Detection> TableReaders::find(View2D<const u8> image, double size_m) {
  for (Detection detection : engine_.detect(image, {}).frame.detections) {
    if (detection.id != table::kMarker) continue;
    scale_pose(size_m, detection);
    return detection;
  }
  return std::nullopt;
}

std::vector<std::optional<Reading>> TableReaders::read(View2D<const u8> image, double size_m, View2D<const u8> back) {
  std::vector<std::optional<Reading>> readings;
  readings.reserve(names_.size());
  const std::optional<Detection> seen = find(image, size_m);
  if (seen) {
    readings.push_back(seen->has_pose ? std::optional(Reading{seen->pose, seen->corners}) : std::nullopt);
    readings.push_back(by_paper(camera_, size_m, seen->corners));
    readings.push_back(by_ippe(camera_, size_m, seen->corners));
  }
  readings.resize(3);
  if (apriltag_) {
    if (const auto found = apriltag_->read(image, table::kMarker, camera_, size_m)) {
      readings.push_back(Reading{found->pose, found->corners});
      readings.push_back(by_ippe(camera_, size_m, found->corners));
    }
    readings.resize(5);
  }
  if (stations_ > 1) {
    const std::optional<Detection> seen_back = find(back, size_m);
    const StationPair stations = table::stations(camera_, size_m);
    const Detection* dock = seen_back ? &*seen_back : nullptr;
    readings.push_back(by_stations(stations, nullptr, dock));
    readings.push_back(by_stations(stations, seen ? &*seen : nullptr, dock));
  }
  return readings;
}

}  // namespace berth::cli
