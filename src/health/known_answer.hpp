#pragma once

#include <string>
#include <vector>

#include "berth/detector.hpp"

namespace berth {

/// A picture of markers of these families, drawn in integers: upright and sheared, of several sizes, on a noisy
/// background. The same bytes everywhere.
GrayImage known_picture(int width, int height, const std::vector<std::string>& families);

/// A picture and what the reference makes of it, for detectors of one size and configuration: of the whole of it, and
/// where there are windows, of all of each side together, by all searches and by the whole image's alone.
class KnownAnswer {
 public:
  /// Runs the picture on the reference backend, with all its memory for that time. Throws Error as Detector.
  KnownAnswer(int width, int height, const DetectorConfig& config);

  View2D<const u8> image() const { return image_.view(); }
  /// The whole picture is the first part; two of the others are the windows of one side.
  std::size_t parts() const { return parts_.size(); }
  /// Where a part is to be searched; none for the whole.
  const std::vector<SearchWindow>& windows(std::size_t part) const { return parts_[part].windows; }
  /// Whether the result of a part is the reference's: lists' lengths, codes, corners, covariances and poses, bit for
  /// bit.
  bool fits(const FrameResult& result, std::size_t part = 0) const { return digest(result) == parts_[part].expected; }
  u64 expected() const { return parts_.front().expected; }

 private:
  static u64 digest(const FrameResult& result);

  struct Part {
    std::vector<SearchWindow> windows;
    u64 expected = 0;
  };
  GrayImage image_;
  std::vector<Part> parts_;
};

}  // namespace berth
