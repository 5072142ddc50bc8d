#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "berth/pilot.hpp"
#include "berth/pipeline.hpp"

namespace berth {

struct PilotStreamConfig {
  /// `marker_every` is not used: every frame that is not dropped is searched for the marker.
  PilotConfig pilot;
  /// Its detector is the pilot's.
  PipelineConfig pipeline;
  /// Frames from the one that the network is given to the one at which it has its say. So many frames must last longer
  /// than the network's slowest look, or its word comes later than it should.
  int network_frames = 4;
};

/// What one frame came to. Valid until the callback returns.
struct PilotStreamFrame {
  /// The frame's markers, with its times.
  const PipelineFrame* frame = nullptr;
  /// Mode, reason, marker and position, as a Pilot gives them. `looked_for_target` is true where the network had its
  /// say: `sighting` is then of the frame that its stamp names, as is a position that is not from the marker.
  const PilotFrame* pilot = nullptr;
  /// The network was given this frame.
  bool is_looked_at = false;
  /// The network's word came so many times network_frames later than it should; 0 in time.
  int late_by = 0;
};

/// Counted since start.
struct PilotStreamCounts {
  /// The network's, of these those whose word came late, and those in which its device was lost: it is not asked again.
  u64 looks = 0, late_looks = 0, lost_looks = 0;
  /// Frames on whose way the network was at work for a while, and the others; of these those later than each deadline
  /// of the pipeline.
  struct Beside {
    u64 frames = 0;
    std::array<u64, 2> late = {};
  };
  Beside beside_network, alone;
};

/// Search, navigation and docking on a camera's frames (docs/hand-over.md, At a camera's pace): the marker's part in a
/// Pipeline, which never waits for the network; the network's on a thread of its own and, where wanted, on another
/// backend. Its word on a frame counts at a later one, network_frames on. As long as none comes late, modes and
/// positions depend on the frames that were not dropped alone.
class PilotStream {
 public:
  /// On the pipeline's host thread; as Pipeline::Deliver.
  using Deliver = std::function<void(const PilotStreamFrame&)>;

  /// `docking` as for Pipeline; all outlive this object. Throws Error as Pipeline, Pilot and Navigator do.
  PilotStream(const std::vector<Backend*>& docking, Backend& navigation, int width, int height,
              const PilotStreamConfig& config, Deliver deliver);
  /// Stops; swallows what stop would throw. Never from a callback.
  ~PilotStream();
  PilotStream(const PilotStream&) = delete;
  PilotStream& operator=(const PilotStream&) = delete;

  /// These as a Pipeline's. With Overrun::wait a frame waits for the network's word that is due at it: none is late.
  void start();
  void stop();
  void close();
  bool push(View2D<const u8> image, const FrameStamp& stamp);
  FrameSlot begin();
  bool commit(const FrameStamp& stamp);
  const Pipeline& pipeline() const;

  /// At any time, from any thread.
  PilotStreamCounts counts() const;
  /// Of the network, where NavigatorConfig::health is given: once failed, it is not asked again.
  HealthReport network_health() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
