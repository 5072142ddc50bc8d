#include "pipeline/pipeline_config.hpp"

#include <string>

#include "berth/error.hpp"

namespace berth {
namespace {

constexpr int kMostSlots = 1024;

}  // namespace

PipelineConfig checked_pipeline(PipelineConfig config, int width, int height) {
  if (config.slots < 2 || config.slots > kMostSlots) {
    throw Error("a pipeline of " + std::to_string(config.slots) + " slots; give 2 to " + std::to_string(kMostSlots) +
                ", usually 4");
  }
  if (config.realtime_priority < 0 || config.realtime_priority > 99) {
    throw Error("real-time priority " + std::to_string(config.realtime_priority) + "; give 1 to 99, or 0 for none");
  }
  if (config.cores.size() > 2) {
    throw Error(std::to_string(config.cores.size()) +
                " cores for a pipeline's threads; give two, the device's and the host's, or one for both");
  }
  if (config.hang_ns < 0) {
    throw Error("a device that hangs after " + std::to_string(config.hang_ns) +
                " ns; give more than 0, or 0 for never");
  }
  for (const std::int64_t deadline : config.deadlines_ns) {
    if (deadline <= 0) throw Error("a deadline of " + std::to_string(deadline) + " ns; give more than 0");
  }
  if (!config.tracking) return config;
  if (config.tracking->behind >= config.slots) {
    throw Error("windows by the result " + std::to_string(config.tracking->behind) +
                " frames before, in a pipeline of " + std::to_string(config.slots) +
                " slots; give fewer frames or more slots");
  }
  config.detector.window_sides = tracking_window_sides(width, height, *config.tracking);
  return config;
}

}  // namespace berth
