#pragma once

#include <memory>
#include <vector>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "berth/image.hpp"

namespace berth {

/// Sizes of everything in one marker frame, fixed by the image size and the capacities.
struct MarkerGeometry {
  MarkerGeometry(int image_width, int image_height, const Capacities& wanted);

  int width, height;
  int padded_width, padded_height;
  int tile_rows, tile_row_words;
  int bit_row_words, bit_words;
  int word_groups;  // work-groups of run_count
  int run_groups;   // work-groups of contour_measure
  int totals_at;    // in spans
  int max_run_ends, max_contours, max_points;

  std::size_t frame_bytes() const { return static_cast<std::size_t>(padded_width) * static_cast<std::size_t>(padded_height); }
};

/// One stage's output, for digests and comparison: the buffer and how many of its words the frame has written.
struct Stage {
  const char* name;
  Buffer* buffer;
  enum class Length { whole, run_ends, points, quads, edges } length;
};

/// The docking plan: the list of operations from pixels to refined sides, with all its buffers on one backend.
class MarkerPlan {
 public:
  MarkerPlan(Backend& backend, const MarkerGeometry& geometry, const DetectorConfig& config);

  const MarkerGeometry& geometry() const { return geometry_; }
  Plan& plan() { return *plan_; }
  const std::vector<Step>& steps() const { return steps_; }

  /// Where the padded frame goes: u8[padded_height, padded_width].
  Buffer& frame() { return *frame_; }
  /// What the host reads: the contour header and records, quads and edges (see kernels/ops.h).
  Buffer& contours() { return *contours_; }
  Buffer& quads() { return *quads_; }
  Buffer& edges() { return *edges_; }

  /// Outputs in order of computation.
  const std::vector<Stage>& stages() const { return stages_; }
  std::size_t device_bytes() const;

 private:
  Buffer* make(std::size_t words);
  void build(bool want_outer, bool want_holes, bool flat_field);

  Backend& backend_;
  MarkerGeometry geometry_;
  std::vector<std::unique_ptr<Buffer>> buffers_;
  Buffer* frame_ = nullptr;
  Buffer* gains_ = nullptr;
  Buffer* contours_ = nullptr;
  Buffer* quads_ = nullptr;
  Buffer* edges_ = nullptr;
  std::vector<Step> steps_;
  std::vector<Stage> stages_;
  std::unique_ptr<Plan> plan_;
};

/// Copies an image into a padded frame, repeating its last column and row into the padding.
void pad_frame(View2D<const u8> image, const MarkerGeometry& geometry, u8* frame);

}  // namespace berth
