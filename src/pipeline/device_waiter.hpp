#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

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

/// The waiters of a pipeline's backends, where one whose device hangs is to be left.
class DeviceWaiters {
 public:
  /// `most_ns`: how long a frame is waited for at most; 0 for as long as it takes, without waiters. The list never
  /// grows while frames fly: there is room for so many backends that are opened anew.
  DeviceWaiters(std::size_t backends, std::int64_t most_ns, std::size_t most_returns);
  /// Waits until every driver has come back. Before the frames go that they were given.
  ~DeviceWaiters();
  DeviceWaiters(const DeviceWaiters&) = delete;
  DeviceWaiters& operator=(const DeviceWaiters&) = delete;

  /// Waits for a frame on a backend as it is now. The host's thread.
  DeviceWaiter::End finish(std::size_t backend, DeviceFrame& frame);
  /// One more, for a backend that was opened anew; null without waiters. Any thread.
  std::shared_ptr<DeviceWaiter> make() const;
  /// Puts it in a backend's place, and there what was in that. The host's thread.
  void exchange(std::size_t backend, std::shared_ptr<DeviceWaiter>& waiter);

 private:
  const std::int64_t most_ns_;
  /// By backend; and all there ever were.
  std::vector<std::shared_ptr<DeviceWaiter>> waiters_, all_;
};

}  // namespace berth
