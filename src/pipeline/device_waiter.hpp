#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

#include "frame/detector_parts.hpp"

namespace berth {

/// Waits for one backend's device on a thread of its own: one that hangs in its driver holds up that thread, not
/// frames.
class DeviceWaiter {
 public:
  enum class End { done, lost, hangs };

  DeviceWaiter();
  ~DeviceWaiter() { end(); }
  DeviceWaiter(const DeviceWaiter&) = delete;
  DeviceWaiter& operator=(const DeviceWaiter&) = delete;

  /// Waits for the frame, for so long at most; what was once found to hang is not waited for again. One thread at a
  /// time.
  End finish(DeviceFrame& frame, std::int64_t most_ns);
  /// Waits until the driver has come back, and for nothing any more. Before the frame goes that it was given.
  void end();

 private:
  void work();

  std::mutex mutex_;
  std::condition_variable given_, ended_;
  DeviceFrame* frame_ = nullptr;  // as long as it is waited for
  bool is_alive_ = false, hangs_ = false, ending_ = false;
  std::thread thread_;
};

}  // namespace berth
