#pragma once

#include <string>
#include <vector>

#include "berth/detector.hpp"
#include "berth/source.hpp"

namespace berth {

/// Frames in which a single wrong bit is looked for: from the simulator's corpora, with the truth.
struct ChaosScene {
  std::string name;
  GrayImage image;
  std::vector<TruthMarker> truth;
};

constexpr int kChaosWidth = 320;
constexpr int kChaosHeight = 240;

/// How detectors of a campaign are set up: poses for one metre, which the truth's sizes scale.
DetectorConfig chaos_config();

/// A pose is wrong that is of a marker the scene does not have, or off by more than kWrongShare of the true range or
/// kWrongDegrees. `share` of these bounds is asked for.
constexpr double kWrongShare = 0.03;
constexpr int kWrongDegrees = 10;
bool has_wrong_pose(const ChaosScene& scene, const FrameResult& result, double share = 1);

/// So many scenes whose markers come out, without any fault, within half the bounds.
std::vector<ChaosScene> chaos_scenes(std::size_t count);

}  // namespace berth
