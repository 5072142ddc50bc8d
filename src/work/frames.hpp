#pragma once

#include <memory>
#include <string>
#include <vector>

#include "berth/image.hpp"
#include "frame/marker_plan.hpp"
#include "navigation/network_plan.hpp"
#include "work/projection.hpp"

namespace berth::work {

/// A mode's plan on a backend with a frame to run it on: to be counted, timed and projected.
class ModeFrame {
 public:
  virtual ~ModeFrame() = default;
  /// Brings the frame to the device.
  virtual void upload(Stream& stream) = 0;
  /// Brings back what the host reads of a frame.
  virtual void download(Stream& stream) = 0;
  virtual Plan& plan() = 0;
  virtual const std::vector<Step>& steps() const = 0;
  /// Of the frame that ran last.
  virtual std::vector<StepTraffic> traffic(Stream& stream) = 0;
  virtual std::vector<ArgumentTraffic> uploads() = 0;
  virtual std::vector<ArgumentTraffic> downloads() = 0;
};

/// A docking frame with the configuration's defaults.
std::unique_ptr<ModeFrame> docking_frame(Backend& backend, View2D<const u8> image);
/// A network over one window of `width` x `height` px in the middle of a frame, frame pixels and window pixels alike.
/// The network must outlive it.
std::unique_ptr<ModeFrame> network_frame(Backend& backend, View2D<const u8> image, const Network& network, int width,
                                         int height);

/// What the network's search of a whole frame of 480 rows takes for its window (src/navigation/navigator.cpp).
int search_side(int frame_side, int network_side);

/// Counts a frame; its backend must be the cpu backend, or another in host memory. `every` as in count_step.
FrameLoad count_frame(ModeFrame& frame, Backend& backend, int every = 1);

/// A network of the paper's sizes (training/model.py): AlexNet's for one gray window of 256 x 256. Its weights are
/// drawn by a fixed rule and know nothing: for counting and timing.
Network paper_sized_network();

}  // namespace berth::work
