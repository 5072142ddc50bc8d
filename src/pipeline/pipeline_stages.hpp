#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <future>
#include <optional>
#include <thread>
#include <vector>

#include "berth/pipeline.hpp"
#include "pipeline/pipeline_backends.hpp"
#include "pipeline/pipeline_slot.hpp"
#include "pipeline/pipeline_statistics.hpp"
#include "pipeline/slot_ring.hpp"

namespace berth {

/// The two stages of a pipeline between camera and reader, a thread each: the device's enqueues the frames that wait,
/// the host's makes their results, in order, and delivers them. The ring says whose a slot is, and its lock is the only
/// one; between start and stop neither thread allocates (digests do).
class PipelineStages {
 public:
  /// All that is given outlives this object. Without `deliver` results are for the ring's reader.
  PipelineStages(const PipelineConfig& config, const Pipeline::Deliver& deliver, std::vector<PipelineSlot>& slots,
                 PipelineBackends& backends, SlotRing& ring, PipelineStatistics& statistics);
  /// Stops, and swallows what stop would throw.
  ~PipelineStages() { end(); }
  PipelineStages(const PipelineStages&) = delete;
  PipelineStages& operator=(const PipelineStages&) = delete;

  /// As Pipeline's.
  void start();
  void stop();
  /// Whether it is this object's host's thread that asks, as in a callback.
  bool is_on_host_thread() const;

 private:
  void join();
  void end();
  void set_up(std::size_t index) const;
  void run_device(std::promise<void>& ready);
  void submit(PipelineSlot& slot, bool again);
  void run_host(std::promise<void>& ready);
  void finish(int i);
  std::int64_t make_result(int i);
  bool wait_for_device(int i);
  void fail();
  PipelineSlot& at(int slot) { return slots_[static_cast<std::size_t>(slot)]; }

  const PipelineConfig& config_;
  const Pipeline::Deliver& deliver_;
  std::vector<PipelineSlot>& slots_;
  PipelineBackends& backends_;
  SlotRing& ring_;
  PipelineStatistics& statistics_;
  /// The device's thread asks it for windows, the host's thread gives it results; the ring keeps them apart.
  std::optional<Tracker> tracker_;
  /// Whether something was thrown, and what: whoever sets the one writes the other, which is read once both are joined.
  std::atomic<bool> failed_ = false;
  std::exception_ptr error_;
  std::thread device_thread_, host_thread_;
};

}  // namespace berth
