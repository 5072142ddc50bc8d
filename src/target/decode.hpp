#pragma once

#include <array>
#include <memory>
#include <vector>

#include "berth/constant_memory.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"
#include "target/side_covariance.hpp"

namespace berth {

/// A quadrilateral the device found, before anyone looked inside. Corners clockwise on the screen from any corner,
/// px, pixel centres at integer coordinates.
struct QuadCandidate {
  /// From the lines through the contour.
  std::array<std::array<double, 2>, 4> coarse = {};
  /// From the lines refitted to the gray-level edges; equal to coarse where has_fine is false.
  std::array<std::array<double, 2>, 4> fine = {};
  bool has_fine = false;
  /// Of the fine lines: side k is from corner k to the next.
  std::array<SideFit, 4> sides = {};
  /// Light inside, dark outside.
  bool reversed_border = false;
};

/// Reads the code inside quadrilaterals.
class Decoder {
 public:
  /// `max_hamming`: see DetectorConfig. Throws Error on a negative one. The families outlive the decoder.
  Decoder(const std::vector<const MarkerFamily*>& families, int max_hamming);
  ~Decoder();
  Decoder(Decoder&&) noexcept;
  Decoder& operator=(Decoder&&) noexcept;

  /// Tries the fine corners, then the coarse ones. Returns whether a code of a family was read into `detection`,
  /// whose corners are then the fine ones in the paper's order. Allocates nothing.
  bool decode(View2D<const u8> image, const QuadCandidate& quad, Detection& detection) const;
  /// Adds its tables.
  void list_constants(std::vector<ConstantMemory>& to) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

/// Of detections that cover the same place keeps the best (Hamming distance, margin, area, then position: a total
/// order) and sorts what remains by family, id and position, so that the list never depends on the order of arrival.
void resolve_duplicates(std::vector<Detection>& detections);

}  // namespace berth
