#include "table_readers.hpp"

#include <opencv2/calib3d.hpp>

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

}  // namespace

TableReaders::TableReaders(const EngineOptions& options, const CameraModel& camera)
    : camera_(camera),
      names_({"Berth", "Berth's corners, the paper's P4P", "Berth's corners, OpenCV IPPE"}),
      engine_(open_chosen_backends(options), config_for(options, camera)) {
  if (!AprilTagReader::built_in()) return;
  apriltag_ = std::make_unique<AprilTagReader>();
  names_.insert(names_.end(), {"AprilTag 3", "AprilTag's corners, OpenCV IPPE"});
}

std::vector<std::optional<Reading>> TableReaders::read(View2D<const u8> image, double size_m) {
  std::vector<std::optional<Reading>> readings(names_.size());
  for (Detection detection : engine_.detect(image, {}).frame.detections) {
    if (detection.id != table::kMarker) continue;
    if (detection.has_pose) {
      scale_pose(size_m, detection);
      readings[0] = Reading{detection.pose, detection.corners};
    }
    readings[1] = by_paper(camera_, size_m, detection.corners);
    readings[2] = by_ippe(camera_, size_m, detection.corners);
  }
  if (!apriltag_) return readings;
  if (const auto found = apriltag_->read(image, table::kMarker, camera_, size_m)) {
    readings[3] = Reading{found->pose, found->corners};
    readings[4] = by_ippe(camera_, size_m, found->corners);
  }
  return readings;
}

}  // namespace berth::cli
