// include/berth.h: a marker's pose over time.

#include <algorithm>

#include "c_api/edge.hpp"
#include "c_api/handles.hpp"

using namespace berth;
using namespace berth::c_api;

namespace {

PoseFilterConfig config_of(const berth_filter_settings& given) {
  PoseFilterConfig config;
  config.camera = camera_of(given.camera);
  config.marker_size_m = given.marker_size_m;
  const auto set = [](double value, double& member) {
    if (value != 0) member = value;
  };
  set(given.acceleration, config.acceleration);
  set(given.angular_acceleration, config.angular_acceleration);
  set(given.first_velocity, config.first_velocity);
  set(given.first_angular_velocity, config.first_angular_velocity);
  set(given.gate, config.gate);
  set(given.lost_s, config.lost_s);
  return config;
}

berth_filtered_pose filtered_of(const FilteredPose& pose) {
  berth_filtered_pose value{};
  value.time_ns = pose.time_ns;
  value.has_pose = pose.has_pose ? 1 : 0;
  value.measured = pose.measured ? 1 : 0;
  value.outlier = pose.outlier ? 1 : 0;
  value.sure = pose.sure ? 1 : 0;
  value.jumped = pose.jumped ? 1 : 0;
  value.pose = pose_of(pose.pose);
  std::copy(pose.covariance.begin(), pose.covariance.end(), value.covariance);
  std::copy(pose.velocity.begin(), pose.velocity.end(), value.velocity);
  std::copy(pose.velocity_covariance.begin(), pose.velocity_covariance.end(), value.velocity_covariance);
  value.age_s = pose.age_s;
  return value;
}

}  // namespace

extern "C" {

berth_filter* berth_filter_open(const berth_filter_settings* settings, berth_error* error) {
  return opened(error, [&] { return new berth_filter{PoseFilter(config_of(read_struct(settings, "settings")))}; });
}

berth_code berth_filter_update(berth_filter* filter, int64_t mid_exposure_ns, const berth_marker* marker,
                               berth_filtered_pose* pose, berth_error* error) {
  return guarded(error, [&] {
    PoseFilter& track = needed(filter, "filter").filter;
    std::optional<Detection> seen;
    if (marker != nullptr) seen = detection_of(read_struct(marker, "marker"));
    needed(pose, "pose");
    write_struct(filtered_of(track.update(mid_exposure_ns, seen ? &*seen : nullptr)), pose, "pose");
  });
}

berth_code berth_filter_foretell(const berth_filter* filter, int64_t time_ns, berth_filtered_pose* pose,
                                 berth_error* error) {
  return guarded(error,
                 [&] { write_struct(filtered_of(needed(filter, "filter").filter.foretell(time_ns)), pose, "pose"); });
}

berth_code berth_filter_reset(berth_filter* filter, berth_error* error) {
  return guarded(error, [&] { needed(filter, "filter").filter.reset(); });
}

void berth_filter_close(berth_filter* filter) { delete filter; }

}  // extern "C"
