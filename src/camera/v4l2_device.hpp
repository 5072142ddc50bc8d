#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace berth {

/// What a Video4Linux camera is asked of the kernel; a seam, so that cameras can be tried that are not there.
class V4l2Device {
 public:
  virtual ~V4l2Device() = default;
  /// ioctl(2), begun again when a signal interrupts it. Returns 0, or errno.
  virtual int control(unsigned long request, void* argument) = 0;
  /// A driver's buffer in this program's memory, until the device is closed; null where the kernel refuses.
  virtual void* map(std::size_t bytes, std::uint32_t offset) = 0;
  /// Waits until a buffer is filled. Returns 0, ETIMEDOUT, or another errno.
  virtual int wait(int timeout_ms) = 0;
};

/// Opens the device at that path, or throws Error "PATH: why; remedy".
using V4l2Opener = std::function<std::unique_ptr<V4l2Device>(const std::string& path)>;

std::unique_ptr<V4l2Device> open_v4l2_device(const std::string& path);

}  // namespace berth
