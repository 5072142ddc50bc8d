#pragma once

#include <string>
#include <vector>

#include "berth/detector.hpp"
#include "berth/image.hpp"

namespace berth::pictures {

/// A frame and the configuration it is to be run with.
struct Frame {
  std::string name;
  GrayImage image;
  DetectorConfig config;
};

/// Frames that every operation meets: 1×1, one past a word and a tile, flat, full contrast, values at the decision
/// points, quadrilaterals of both polarities, mazes, and capacities that do not suffice.
std::vector<Frame> frame_set();

}  // namespace berth::pictures
