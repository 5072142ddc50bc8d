// include/berth.h: detectors and what they say of a frame.

#include <climits>

#include "c_api/edge.hpp"
#include "c_api/handles.hpp"

using namespace berth;
using namespace berth::c_api;

namespace {

TrackerConfig tracking_of(const berth_settings& settings) {
  TrackerConfig tracking;
  tracking.full_every = settings.full_every;
  return tracking;
}

/// What the detector is made with: the settings, and windows where markers are followed.
DetectorConfig config_of(const berth_settings& settings, int width, int height) {
  const std::optional<CameraModel>& camera = settings.config.camera;
  if (camera && (camera->width != width || camera->height != height)) {
    throw Error("the camera is for images of " + std::to_string(camera->width) + "x" + std::to_string(camera->height) +
                ", the detector for " + std::to_string(width) + "x" + std::to_string(height) +
                "; give the camera's values for that size");
  }
  DetectorConfig config = settings.config;
  if (settings.full_every > 0) config.window_sides = tracking_window_sides(width, height, tracking_of(settings));
  return config;
}

const FrameResult& result_of(const berth_detector* detector) {
  const FrameResult* result = needed(detector, "detector").result;
  if (result == nullptr) throw BadArgument("there is no frame yet; call berth_detector_detect first");
  return *result;
}

template <class T>
const T& item(const std::vector<T>& items, size_t index, const char* what) {
  if (index < items.size()) return items[index];
  throw BadArgument(std::string(what) + " " + std::to_string(index) + " is not there; the frame has " +
                    std::to_string(items.size()));
}

int64_t time_of(const FrameResult& result, const char* stage) {
  for (const StageTime& time : result.times) {
    if (std::string_view(time.stage) == stage) return time.ns;
  }
  return 0;
}

berth_frame frame_of(const FrameResult& result, bool whole) {
  berth_frame frame{};
  frame.sequence = result.stamp.sequence;
  frame.mid_exposure_ns = result.stamp.mid_exposure_ns;
  static_assert(static_cast<int>(FrameStatus::no_target) == BERTH_FRAME_NO_TARGET &&
                static_cast<int>(FrameStatus::overflow) == BERTH_FRAME_OVERFLOW &&
                static_cast<int>(FrameStatus::device_lost) == BERTH_FRAME_DEVICE_LOST);
  frame.status = static_cast<int32_t>(result.status);
  frame.whole = whole ? 1 : 0;
  frame.markers = result.detections.size();
  frame.bundles = result.bundles.size();
  frame.targets = result.disc_targets.size();
  frame.device_ns = time_of(result, "device");
  frame.decode_ns = time_of(result, "decode");
  frame.corners_ns = time_of(result, "corners");
  frame.pose_ns = time_of(result, "pose");
  frame.discs_ns = time_of(result, "discs");
  for (const CapacityUse& use : result.capacities) {
    if (use.needed <= use.capacity) continue;
    frame.overflow = use.what;
    frame.needed = use.needed;
    frame.capacity = use.capacity;
    break;
  }
  return frame;
}

}  // namespace

berth_detector::berth_detector(const berth_backend& opened, const berth_settings& settings, int w, int h)
    : backend(opened.backend),
      config(config_of(settings, w, h)),
      width(w),
      height(h),
      detector(*backend, w, h, config) {
  if (settings.full_every > 0) tracker.emplace(w, h, tracking_of(settings));
}

extern "C" {

berth_detector* berth_detector_open(berth_backend* backend, const berth_settings* settings, int32_t width,
                                    int32_t height, berth_error* error) {
  return opened(error, [&] {
    return new berth_detector(needed(backend, "backend"), needed(settings, "settings"), width, height);
  });
}

berth_code berth_detector_detect(berth_detector* detector, const uint8_t* pixels, size_t stride,
                                 const berth_stamp* stamp, berth_error* error) {
  return guarded(error, [&] {
    berth_detector& d = needed(detector, "detector");
    FrameStamp when;
    if (stamp != nullptr) {
      const berth_stamp given = read_struct(stamp, "stamp");
      when.sequence = given.sequence;
      when.exposure_start_ns = given.exposure_start_ns;
      when.mid_exposure_ns = given.mid_exposure_ns;
      when.arrival_ns = given.arrival_ns;
      when.clock = "caller's";
    }
    if (stride < static_cast<size_t>(d.width) || stride > INT_MAX) {
      throw BadArgument("stride is " + std::to_string(stride) + " bytes; rows have " + std::to_string(d.width));
    }
    const View2D<const u8> image{&needed(pixels, "pixels"), d.width, d.height, static_cast<int>(stride)};
    if (d.tracker) {
      const TrackedFrame& frame = d.tracker->look(d.detector, image, when);
      d.result = frame.result;
      d.whole = frame.whole;
    } else {
      d.result = &d.detector.detect(image, when);
    }
    if (d.result->status == FrameStatus::device_lost) {
      throw DeviceLost(std::string(d.backend->name()) + ": the device is lost; open another backend and detector");
    }
  });
}

berth_code berth_detector_frame(const berth_detector* detector, berth_frame* frame, berth_error* error) {
  return guarded(error, [&] {
    const FrameResult& result = result_of(detector);
    write_struct(frame_of(result, detector->whole), frame, "frame");
  });
}

berth_code berth_detector_marker(const berth_detector* detector, size_t index, berth_marker* marker,
                                 berth_error* error) {
  return guarded(
      error, [&] { write_struct(marker_of(item(result_of(detector).detections, index, "marker")), marker, "marker"); });
}

berth_code berth_detector_bundle(const berth_detector* detector, size_t index, berth_bundle_pose* bundle,
                                 berth_error* error) {
  return guarded(error, [&] {
    const BundlePose& found = item(result_of(detector).bundles, index, "bundle");
    berth_bundle_pose value{};
    value.name = detector->config.bundles[index].name.c_str();
    value.has_pose = found.has_pose ? 1 : 0;
    value.used = found.used;
    value.kept_out = found.kept_out;
    value.corners_kept_out = found.corners_kept_out;
    if (found.has_pose) value.pose = estimate_of(found.pose, found.uncertainty);
    write_struct(value, bundle, "bundle");
  });
}

berth_code berth_detector_target(const berth_detector* detector, size_t index, berth_target_pose* target,
                                 berth_error* error) {
  return guarded(error, [&] {
    const DiscPose& found = item(result_of(detector).disc_targets, index, "target");
    berth_target_pose value{};
    value.name = detector->config.disc_targets[index].name.c_str();
    value.has_pose = found.has_pose ? 1 : 0;
    value.used = found.used;
    if (found.has_pose) value.pose = estimate_of(found.pose, found.uncertainty);
    write_struct(value, target, "target");
  });
}

size_t berth_detector_markers(const berth_detector* detector) {
  return detector == nullptr || detector->result == nullptr ? 0 : detector->result->detections.size();
}

size_t berth_detector_device_bytes(const berth_detector* detector) {
  return detector == nullptr ? 0 : detector->detector.device_bytes();
}

void berth_detector_close(berth_detector* detector) { delete detector; }

}  // extern "C"
