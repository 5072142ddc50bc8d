#pragma once

#include <memory>
#include <string>

#include "berth/image.hpp"

namespace berth::sim {
class Renderer;
}

namespace berth {

/// Frames without end for long comparisons: the simulator's corpora in turn, noise at decision points, mazes and
/// quadrilaterals between them; mostly 320 × 240, each eighth 640 × 480. The same index is the same frame everywhere.
class MixedFrames {
 public:
  MixedFrames();
  ~MixedFrames();

  struct Frame {
    std::string name;
    GrayImage image;
  };
  Frame make(int index);

 private:
  // One for each size: the lens is worked out once.
  std::unique_ptr<sim::Renderer> small_, large_;
};

}  // namespace berth
