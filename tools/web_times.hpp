#pragma once

#include <array>

#include "frame_json.hpp"
#include "frame_observer.hpp"

namespace berth::cli {

/// How long frames took, part by part: of a pipeline its laps, else the whole call and the parts in the result.
class WebTimes {
 public:
  /// By the stream's thread; allocates nothing.
  void add(const ObservedFrame& frame);
  /// Rows of name, p50, p99 and maximum in ms, of what there is any of; from any thread.
  Json json() const;

 private:
  static constexpr std::array<const char*, 9> kNames = {"frame",   "wait",  "device", "queue",  "decode",
                                                        "corners", "discs", "pose",   "latency"};
  void add(const char* name, std::int64_t ns);

  std::array<LatencyHistogram, kNames.size()> times_;
};

}  // namespace berth::cli
