#include "web_overlay.hpp"

#include <algorithm>
#include <cmath>

namespace berth::cli {
namespace {

void add_axes(const std::optional<CameraModel>& camera, const Pose& pose, double length_m, Overlay::Object& object) {
  if (!camera) return;
  const auto project = [&](double x, double y, double z) -> std::optional<Overlay::Point> {
    const auto row = [&](int i) {
      return pose.R[3 * i] * x + pose.R[3 * i + 1] * y + pose.R[3 * i + 2] * z + pose.t[i];
    };
    if (!(row(2) > 1e-6)) return std::nullopt;
    return camera->project(row(0) / row(2), row(1) / row(2));
  };
  object.has_axes = true;
  object.axes = {project(0, 0, 0), project(length_m, 0, 0), project(0, length_m, 0), project(0, 0, length_m)};
}

/// The longest side of the quadrilateral, px.
double side_of(const std::array<Overlay::Point, 4>& corners) {
  double longest = 0;
  for (int i = 0; i < 4; ++i) {
    const Overlay::Point &a = corners[i], &b = corners[(i + 1) % 4];
    longest = std::max(longest, std::hypot(a[0] - b[0], a[1] - b[1]));
  }
  return longest;
}

Json rounded(const Overlay::Point& point) {
  const auto hundredth = [](double v) { return std::isfinite(v) ? Json(std::round(v * 100) / 100) : Json(); };
  return {hundredth(point[0]), hundredth(point[1])};
}

}  // namespace

void OverlayMaker::begin(const ObservedStream& stream) {
  bundles_ = stream.config.bundles;
  targets_ = stream.config.disc_targets;
}

Overlay OverlayMaker::of(const ObservedFrame& frame) const {
  Overlay overlay;
  const FrameResult& result = frame.result;
  overlay.sequence = result.stamp.sequence;
  overlay.width = frame.image.width;
  overlay.height = frame.image.height;
  for (const Detection& detection : result.detections) {
    if (overlay.objects.size() == kMost) break;
    Overlay::Object object;
    object.name = detection.family->name + " " + std::to_string(detection.id);
    object.corners = detection.corners;
    // Half a side, from its size in the image.
    if (detection.has_pose && frame.camera) {
      const double length_m = side_of(detection.corners) / 2 * detection.pose.t[2] / frame.camera->fx;
      add_axes(frame.camera, detection.pose, length_m, object);
    }
    overlay.objects.push_back(std::move(object));
  }
  for (std::size_t i = 0; i < result.bundles.size() && overlay.objects.size() < kMost; ++i) {
    if (!result.bundles[i].has_pose) continue;
    Overlay::Object object;
    object.name = bundles_[i].name;
    add_axes(frame.camera, result.bundles[i].pose, bundles_[i].markers.front().size_m / 2, object);
    overlay.objects.push_back(std::move(object));
  }
  for (std::size_t i = 0; i < result.disc_targets.size() && overlay.objects.size() < kMost; ++i) {
    const DiscPose& pose = result.disc_targets[i];
    if (!pose.has_pose) continue;
    Overlay::Object object;
    object.name = targets_[i].name;
    double reach_m = 0;
    for (std::size_t k = 0; k < targets_[i].discs.size(); ++k) {
      reach_m = std::max(reach_m, std::hypot(targets_[i].discs[k].x_m, targets_[i].discs[k].y_m));
      if (pose.discs[k].seen) object.points.push_back(pose.discs[k].center_px);
    }
    add_axes(frame.camera, pose.pose, reach_m / 2, object);
    overlay.objects.push_back(std::move(object));
  }
  if (frame.tracked != nullptr && !frame.tracked->whole) {
    for (const SearchWindow& window : frame.tracked->windows) {
      if (overlay.windows.size() < kMost) overlay.windows.push_back({window.x, window.y, window.side});
    }
  }
  return overlay;
}

Json to_json(const Overlay& overlay) {
  Json json = {{"sequence", overlay.sequence},
               {"captured", std::round(overlay.captured_s * 1e4) / 1e4},
               {"width", overlay.width},
               {"height", overlay.height},
               {"objects", Json::array()}};
  for (const Overlay::Object& object : overlay.objects) {
    Json& row = json["objects"].emplace_back(Json({{"name", object.name}}));
    if (object.corners) {
      for (const Overlay::Point& corner : *object.corners) row["corners"].push_back(rounded(corner));
    }
    if (object.has_axes) {
      for (const auto& end : object.axes) row["axes"].push_back(end ? rounded(*end) : Json());
    }
    for (const Overlay::Point& point : object.points) row["points"].push_back(rounded(point));
  }
  for (const auto& window : overlay.windows) json["windows"].push_back(window);
  return json;
}

}  // namespace berth::cli
