#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <string>

#include "berth/image.hpp"

namespace berth {

/// A camera that is set up and streaming, whatever it is reached by.
class LiveCamera {
 public:
  virtual ~LiveCamera() = default;

  /// A buffer that the camera's driver has filled, until it is given back.
  struct Filled {
    std::size_t index = 0;
    /// Counts the camera's frames modulo 2^32; a gap is frames that it took and that did not come.
    std::uint32_t sequence = 0;
    std::size_t bytes = 0;
    /// On `clock` (FrameStamp::clock), at the start of exposure where `from_start`, else when the frame was there.
    std::int64_t time_ns = 0;
    const char* clock = "";
    bool from_start = false;
    /// Data are missing, or are not what the camera was set to.
    bool damaged = false;
  };
  /// Takes a filled buffer, waiting so long. Returns 0, ETIMEDOUT, or another errno: the camera is then of no more use.
  virtual int take(int timeout_ms, Filled& filled) = 0;
  /// Back to the driver. Returns 0, or an errno as take() does.
  virtual int give_back(const Filled& filled) = 0;
  /// Writes the image in that buffer as 8-bit gray, width() x height(). False where it is incomplete.
  virtual bool read(const Filled& filled, View2D<u8> image) const = 0;

  /// What an errno of take() or give_back() means.
  virtual std::string explain(int error) const { return std::strerror(error); }

  virtual int width() const = 0;
  virtual int height() const = 0;
  /// 0 where it is not known.
  virtual std::int64_t exposure_ns() const = 0;
};

/// Opens the camera and sets it up, or throws Error "CAMERA: why; remedy". Called on a thread of its own after a loss.
using LiveCameraOpener = std::function<std::unique_ptr<LiveCamera>()>;

struct LiveOptions {
  /// What the camera is called in messages and labels.
  std::string name;
  int buffers = 4;
  /// Without a whole frame for this long, ms, the camera is closed and opened again.
  int watchdog_ms = 1000;
  /// The same picture over and over, to the last bit, is handed on all the same: where a decoder or a test picture
  /// rightly repeats one. Otherwise it is taken for a camera that hangs.
  bool repeats = false;
  /// Closing a camera that is gone takes seconds: it is done beside opening it again, not before.
  bool closes_aside = false;
};

}  // namespace berth
