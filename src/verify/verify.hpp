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

}  // namespace berth
