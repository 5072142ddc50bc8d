#pragma once

#include <memory>
#include <string>

#include "berth/source.hpp"
#include "camera/live_camera.hpp"
#include "camera/sources.hpp"

namespace berth {

/// A camera as a source, newest frame first: what it took while a frame was being looked at is skipped and counted.
/// Frames whose time cannot be, and pictures that it hands over again (LiveOptions::repeats), are counted and not
/// handed on (frame_check.hpp). A camera that gives no frame that is whole, new and in time for
/// LiveOptions::watchdog_ms, or is gone, is complained of (Error) and opened again by its name on a thread of its own,
/// at most every 0.5 s; frames go on when it is back. The first attempt that fails is complained of, and then what
/// fails every 3 s, which is how long next() waits. Throws Error when it cannot be opened the first time.
std::unique_ptr<CameraSource> open_live(const LiveOptions& options, LiveCameraOpener opener);

/// What every kind of camera's options say of it as a source.
template <class CameraOptions>
LiveOptions live_options(const std::string& name, const CameraOptions& options) {
  LiveOptions live;
  live.name = name;
  live.buffers = options.buffers;
  live.watchdog_ms = options.watchdog_ms;
  live.repeats = options.repeats;
  return live;
}

}  // namespace berth
