#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "berth/bundle.hpp"
#include "berth/disc_target.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"
#include "berth/types.hpp"

namespace berth {

enum class FrameStatus {
  ok,           ///< markers, and room for all that was looked at
  no_target,    ///< nothing was found
  overflow,     ///< a list ran full: what is given holds, more may have been there (FrameResult::capacities)
  device_lost,  ///< no backend was left that could run it: nothing is given
};
const char* name_of(FrameStatus status);

/// Where and when a frame came from. Times are nanoseconds on the named clock: "monotonic" (the host's), "camera",
/// "ptp", "ros", "video" (from its beginning), "simulation", "caller's", or "none".
struct FrameStamp {
  u64 sequence = 0;
  std::int64_t exposure_start_ns = 0;
  std::int64_t mid_exposure_ns = 0;
  std::int64_t arrival_ns = 0;
  const char* clock = "none";
};

/// How many of each item the frame needed and how many there was room for (see docs/capacities.md).
struct CapacityUse {
  const char* what = "";
  u32 needed = 0;
  u32 capacity = 0;
};

struct StageTime {
  const char* stage = "";
  std::int64_t ns = 0;
};

/// Hash of one stage's output; equal on every backend for equal input.
struct StageDigest {
  std::string stage;
  u64 digest = 0;
};

/// Everything one frame produced: what is logged, published and replayed.
struct FrameResult {
  FrameStamp stamp;
  FrameStatus status = FrameStatus::no_target;
  std::vector<Detection> detections;
  /// One for each of DetectorConfig::bundles, in their order.
  std::vector<BundlePose> bundles;
  /// One for each of DetectorConfig::disc_targets, in their order.
  std::vector<DiscPose> disc_targets;
  /// Quadrilaterals that were examined for a code.
  int quads = 0;
  /// Run ends, contours and points of each search in turn (docs/marker-pipeline.md).
  std::array<CapacityUse, 9> capacities = {};
  /// device: upload to download; decode; pose; corners, where the photometric fit was asked for; discs, where targets
  /// of discs were
  std::array<StageTime, 5> times = {};
  /// Filled only when the detector is asked for digests.
  std::vector<StageDigest> digests;
};

}  // namespace berth
