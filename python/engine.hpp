#pragma once

// What Python's objects hold, where it is more than one of the C++ interface's. Each has a lock: they are used without
// the GIL.

#include <nanobind/nanobind.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "berth/pose_filter.hpp"
#include "berth/source.hpp"
#include "berth/tracker.hpp"
#include "camera/sources.hpp"

namespace berth::python {

using Lock = std::lock_guard<std::mutex>;

struct BundleResult {
  std::string name;
  BundlePose found;
};

struct TargetResult {
  std::string name;
  DiscPose found;
};

/// A FrameResult that outlives the detector's next frame.
struct Frame {
  FrameResult result;
  bool whole = true;
  std::vector<BundleResult> bundles;
  std::vector<TargetResult> targets;
  /// What detect was given: a SourceFrame, or an array.
  nanobind::object given;
};

/// A detector with its backend, and a tracker where markers are followed.
class PythonDetector {
 public:
  PythonDetector(int width, int height, const std::string& backend, const BackendOptions& options,
                 DetectorConfig config, int full_every)
      : backend_(open_backend(backend, options)), config_(std::move(config)) {
    const std::optional<CameraModel>& camera = config_.camera;
    if (camera && (camera->width != width || camera->height != height)) {
      throw Error("camera is for images of " + std::to_string(camera->width) + "x" + std::to_string(camera->height) +
                  ", the detector for " + std::to_string(width) + "x" + std::to_string(height) +
                  "; use camera.resized or camera.cropped");
    }
    TrackerConfig tracking;
    tracking.full_every = full_every;
    if (full_every != 0) {
      config_.window_sides = tracking_window_sides(width, height, tracking);
      tracker_.emplace(width, height, tracking);
    }
    detector_.emplace(*backend_, width, height, config_);
  }

  Frame detect(View2D<const u8> image, const FrameStamp& stamp) {
    const Lock lock(mutex_);
    Frame frame;
    if (tracker_) {
      const TrackedFrame& tracked = tracker_->look(*detector_, image, stamp);
      frame.result = *tracked.result;
      frame.whole = tracked.whole;
    } else {
      frame.result = detector_->detect(image, stamp);
    }
    for (std::size_t i = 0; i < config_.bundles.size(); ++i) {
      frame.bundles.push_back({config_.bundles[i].name, frame.result.bundles[i]});
    }
    for (std::size_t i = 0; i < config_.disc_targets.size(); ++i) {
      frame.targets.push_back({config_.disc_targets[i].name, frame.result.disc_targets[i]});
    }
    return frame;
  }

  std::string backend() const { return std::string(backend_->name()) + " on " + backend_->device().name; }

 private:
  std::unique_ptr<Backend> backend_;
  DetectorConfig config_;
  std::optional<Detector> detector_;
  std::optional<Tracker> tracker_;
  std::mutex mutex_;
};

class PythonSource {
 public:
  explicit PythonSource(const std::string& spec) : source_(open_source(spec)) {}

  std::optional<SourceFrame> next() {
    const Lock lock(mutex_);
    return source_->next();
  }
  std::optional<CameraModel> camera() const { return source_->camera(); }
  std::optional<std::size_t> size() const { return source_->size(); }

 private:
  std::unique_ptr<Source> source_;
  std::mutex mutex_;
};

class PythonFilter {
 public:
  explicit PythonFilter(const PoseFilterConfig& config) : filter_(config) {}

  FilteredPose update(std::int64_t time_ns, const Detection* marker) {
    if (marker != nullptr && !marker->has_pose) {
      throw Error("the marker has no pose; give the detector a camera and marker_size_m");
    }
    const Lock lock(mutex_);
    return filter_.update(time_ns, marker);
  }
  FilteredPose foretell(std::int64_t time_ns) {
    const Lock lock(mutex_);
    return filter_.foretell(time_ns);
  }
  void reset() {
    const Lock lock(mutex_);
    filter_.reset();
  }

 private:
  PoseFilter filter_;
  std::mutex mutex_;
};

}  // namespace berth::python
