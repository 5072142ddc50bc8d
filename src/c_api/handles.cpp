#include "c_api/handles.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "c_api/edge.hpp"

namespace berth::c_api {
namespace {

template <std::size_t N>
void copy(const std::array<double, N>& from, double (&to)[N]) {
  std::copy(from.begin(), from.end(), to);
}

template <std::size_t N>
std::array<double, N> array_of(const double (&from)[N]) {
  std::array<double, N> to;
  std::copy(from, from + N, to.begin());
  return to;
}

}  // namespace

void note(berth_error* error, berth_code code, const char* message) noexcept {
  if (error == nullptr || error->code != BERTH_OK) return;
  error->code = code;
  const std::size_t length = std::min(std::strlen(message), sizeof(error->message) - 1);
  std::memcpy(error->message, message, length);
  error->message[length] = 0;
}

CameraModel camera_of(const berth_camera* camera) {
  const berth_camera given = read_struct(camera, "camera");
  if (given.lens != BERTH_LENS_RADIAL_TANGENTIAL && given.lens != BERTH_LENS_EQUIDISTANT) {
    throw BadArgument("camera->lens is " + std::to_string(given.lens) + "; use a berth_lens");
  }
  CameraModel model;
  model.width = given.width;
  model.height = given.height;
  model.fx = given.fx;
  model.fy = given.fy;
  model.cx = given.cx;
  model.cy = given.cy;
  model.distortion = array_of(given.distortion);
  model.lens = given.lens == BERTH_LENS_EQUIDISTANT ? LensModel::equidistant : LensModel::radial_tangential;
  const bool is_finite = std::isfinite(given.cx) && std::isfinite(given.cy) &&
                         std::all_of(model.distortion.begin(), model.distortion.end(),
                                     [](double coefficient) { return std::isfinite(coefficient); });
  if (given.width < 1 || given.height < 1 || !is_finite || !(given.fx > 0 && given.fx < 1e9) ||
      !(given.fy > 0 && given.fy < 1e9)) {
    throw BadArgument("camera: width and height must be 1 or more, fx and fy above 0, and all numbers finite");
  }
  return model;
}

CornerMethod corner_method_of(int32_t method) {
  if (method != BERTH_CORNERS_EDGES && method != BERTH_CORNERS_PHOTOMETRIC) {
    throw BadArgument("method is " + std::to_string(method) + "; use a berth_corner_method");
  }
  return method == BERTH_CORNERS_EDGES ? CornerMethod::edges : CornerMethod::photometric;
}

PoseMethod pose_method_of(int32_t method) {
  if (method != BERTH_POSE_LEAST_SQUARES && method != BERTH_POSE_PAPER) {
    throw BadArgument("method is " + std::to_string(method) + "; use a berth_pose_method");
  }
  return method == BERTH_POSE_LEAST_SQUARES ? PoseMethod::least_squares : PoseMethod::paper;
}

int full_every_of(int32_t full_every) {
  if (full_every < 0) throw BadArgument("full_every is " + std::to_string(full_every) + "; give 0 or more frames");
  return full_every;
}

void write_camera(const CameraModel& model, berth_camera* camera) {
  berth_camera value{};
  value.width = model.width;
  value.height = model.height;
  value.fx = model.fx;
  value.fy = model.fy;
  value.cx = model.cx;
  value.cy = model.cy;
  copy(model.distortion, value.distortion);
  value.lens = model.lens == LensModel::equidistant ? BERTH_LENS_EQUIDISTANT : BERTH_LENS_RADIAL_TANGENTIAL;
  write_struct(value, camera, "camera");
}

berth_pose pose_of(const Pose& pose) {
  berth_pose value;
  copy(pose.R, value.R);
  copy(pose.t, value.t);
  return value;
}

Pose pose_of(const berth_pose& pose) { return {array_of(pose.R), array_of(pose.t)}; }

berth_pose_estimate estimate_of(const Pose& pose, const std::optional<PoseUncertainty>& uncertainty) {
  berth_pose_estimate value{};
  value.pose = pose_of(pose);
  if (!uncertainty) return value;
  value.has_covariance = 1;
  copy(uncertainty->covariance, value.covariance);
  value.error_px = uncertainty->error_px;
  value.ambiguity = uncertainty->ambiguity();
  if (!uncertainty->has_other) return value;
  value.has_other = 1;
  value.other = pose_of(uncertainty->other);
  value.other_error_px = uncertainty->other_error_px;
  value.other_excess = uncertainty->other_excess;
  copy(uncertainty->other_covariance, value.other_covariance);
  return value;
}

berth_marker marker_of(const Detection& detection) {
  berth_marker marker{};
  marker.family = detection.family->name.c_str();
  marker.id = detection.id;
  marker.hamming = detection.hamming;
  marker.margin = detection.margin;
  for (std::size_t i = 0; i < 4; ++i) copy(detection.corners[i], marker.corners[i]);
  copy(detection.center, marker.center);
  if (detection.corner_covariance_px2) copy(*detection.corner_covariance_px2, marker.corner_covariance);
  marker.corners_fitted = detection.corner_fit ? 1 : 0;
  marker.has_pose = detection.has_pose ? 1 : 0;
  if (detection.has_pose) marker.pose = estimate_of(detection.pose, detection.pose_uncertainty);
  return marker;
}

Detection detection_of(const berth_marker& marker) {
  if (marker.has_pose == 0) throw BadArgument("marker has no pose; set the camera and the marker's size");
  Detection detection;
  for (std::size_t i = 0; i < 4; ++i) detection.corners[i] = array_of(marker.corners[i]);
  detection.center = array_of(marker.center);
  detection.corner_covariance_px2 = array_of(marker.corner_covariance);
  detection.has_pose = true;
  detection.pose = pose_of(marker.pose.pose);
  if (marker.pose.has_covariance == 0) return detection;
  PoseUncertainty& uncertainty = detection.pose_uncertainty.emplace();
  uncertainty.covariance = array_of(marker.pose.covariance);
  uncertainty.error_px = marker.pose.error_px;
  uncertainty.has_other = marker.pose.has_other != 0;
  uncertainty.other = pose_of(marker.pose.other);
  uncertainty.other_error_px = marker.pose.other_error_px;
  uncertainty.other_covariance = array_of(marker.pose.other_covariance);
  uncertainty.other_excess = marker.pose.other_excess;
  return detection;
}

}  // namespace berth::c_api
