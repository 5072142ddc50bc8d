#pragma once

#include <functional>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "berth/image.hpp"

namespace berth {

/// A picture that whole frames are run on.
struct VerifyImage {
  std::string name;
  GrayImage image;
};

struct VerifyOptions {
  /// Run on top of the built-in frames.
  std::vector<VerifyImage> images;
  /// Told after every step: how many of how many are done.
  std::function<void(int done, int all)> progress;
};

struct VerifyReport {
  bool ok = true;
  /// The first operation or stage that differs, with both values; empty when none does.
  std::string first_difference;
  int cases = 0;
  int frames = 0;
  double seconds = 0;
};

/// Runs every case of every operation, then whole frames stage by stage, on both backends, and compares every word.
VerifyReport verify_backend(Backend& candidate, Backend& reference, const VerifyOptions& options = {});

/// When a comparison of mixed frames ends: after so many frames, and not before so many minutes.
struct MixedOptions {
  int frames = 0;
  double minutes = 0;
  /// Told after every frame: how many are done, and how many minutes that took.
  std::function<void(int done, double minutes)> progress;
};

/// Runs mixed frames (verify/mixed_frames.hpp) through the whole docking plan, stage by stage: once on the reference,
/// then on every candidate. A report for each candidate, of the first frame that differs.
std::vector<VerifyReport> verify_mixed(const std::vector<Backend*>& candidates, Backend& reference,
                                       const MixedOptions& options);

}  // namespace berth
