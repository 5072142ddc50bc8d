#pragma once

// What the handles of include/berth.h are, and how its structs and the C++ interface's go over into each other.

#include <memory>
#include <optional>
#include <string>

#include "berth.h"
#include "berth/detector.hpp"
#include "berth/pose_filter.hpp"
#include "berth/tracker.hpp"

struct berth_backend {
  /// Shared with detectors, so that handles can be closed in any order.
  std::shared_ptr<berth::Backend> backend;
  std::string description;
};

struct berth_settings {
  berth::DetectorConfig config;
  bool names_families = false;
  /// 0: markers are not followed in windows.
  int full_every = 0;
};

struct berth_detector {
  berth_detector(const berth_backend& opened, const berth_settings& settings, int width, int height);

  std::shared_ptr<berth::Backend> backend;
  berth::DetectorConfig config;
  int width, height;
  std::optional<berth::Tracker> tracker;
  berth::Detector detector;
  /// Of the last frame; null before the first.
  const berth::FrameResult* result = nullptr;
  bool whole = true;
};

struct berth_filter {
  berth::PoseFilter filter;
};

namespace berth::c_api {

/// Throws BadArgument on a lens that there is not.
CameraModel camera_of(const berth_camera* camera);
/// These throw BadArgument on a number that means nothing.
CornerMethod corner_method_of(int32_t method);
PoseMethod pose_method_of(int32_t method);
int full_every_of(int32_t full_every);
void write_camera(const CameraModel& model, berth_camera* camera);

berth_pose pose_of(const Pose& pose);
Pose pose_of(const berth_pose& pose);
/// Without uncertainty the pose alone.
berth_pose_estimate estimate_of(const Pose& pose, const std::optional<PoseUncertainty>& uncertainty);

berth_marker marker_of(const Detection& detection);
/// As much of it as a pose filter looks at.
Detection detection_of(const berth_marker& marker);

}  // namespace berth::c_api
