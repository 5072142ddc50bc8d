#pragma once

#include <string>
#include <vector>

#include "berth/detector.hpp"

namespace berth {

/// A picture of markers of these families, drawn in integers: upright and sheared, of several sizes, on a noisy
/// background. The same bytes everywhere.
GrayImage known_picture(int width, int height, const std::vector<std::string>& families);

/// A picture and what the reference makes of it, for detectors of one size and configuration.
class KnownAnswer {
 public:
  /// Runs the picture on the reference backend, with all its memory for that time. Throws Error as Detector.
  KnownAnswer(int width, int height, const DetectorConfig& config);

  View2D<const u8> image() const { return image_.view(); }
  /// Whether the result of the picture is the reference's: lists' lengths, codes, corners, covariances and poses, bit
  /// for bit.
  bool fits(const FrameResult& result) const { return digest(result) == expected_; }
  u64 expected() const { return expected_; }

 private:
  static u64 digest(const FrameResult& result);

  GrayImage image_;
  u64 expected_;
};

}  // namespace berth
