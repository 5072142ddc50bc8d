#include "camera/live_source.hpp"
#include "camera/sources.hpp"

namespace berth {

std::unique_ptr<CameraSource> open_v4l2(const V4l2Options& options, V4l2Opener opener) {
  LiveOptions live;
  live.name = options.path;
  live.buffers = options.buffers;
  live.watchdog_ms = options.watchdog_ms;
  live.repeats = options.repeats;
  return open_live(live, [options, opener = std::move(opener)] {
    return std::make_unique<V4l2Camera>(opener(options.path), options);
  });
}

}  // namespace berth
