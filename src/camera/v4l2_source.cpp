#include "camera/live_source.hpp"
#include "camera/sources.hpp"

namespace berth {

std::unique_ptr<CameraSource> open_v4l2(const V4l2Options& options, V4l2Opener opener) {
  return open_live(live_options(options.path, options), [options, opener = std::move(opener)] {
    return std::make_unique<V4l2Camera>(opener(options.path), options);
  });
}

}  // namespace berth
