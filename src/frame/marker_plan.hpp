#pragma once

#include <memory>
#include <string>
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

  std::size_t frame_bytes() const {
    return static_cast<std::size_t>(padded_width) * static_cast<std::size_t>(padded_height);
  }
};

/// What the host reads of one level of the image: the contour header and records, quads and edges (kernels/ops.h).
struct MarkerLevel {
  MarkerGeometry geometry;
  /// Pixels of the whole image a pixel of the level: 1, then 2.
  int scale;
  Buffer* contours;
  Buffer* quads;
  Buffer* edges;
};

/// One stage's output, for digests and comparison: the buffer and how many of its words the frame has written.
struct Stage {
  std::string name;
  std::size_t level;
  Buffer* buffer;
  enum class Length { whole, run_ends, points, quads, edges } length;
};

/// The docking plan: the list of operations from pixels to refined sides, with all its buffers on one backend. Markers
/// are searched in the whole image and in the halved one, where noise and blur are half as strong: the whole image
/// finds the small ones, the halved one the dark and noisy ones (docs/marker-pipeline.md).
class MarkerPlan {
 public:
  /// Throws Error on an image size or a capacity out of bounds, an unknown family or a bad flat field.
  MarkerPlan(Backend& backend, int width, int height, const DetectorConfig& config);

  /// Of the whole image.
  const MarkerGeometry& geometry() const { return levels_.front().geometry; }
  const std::vector<MarkerLevel>& levels() const { return levels_; }
  Plan& plan() { return *plan_; }
  const std::vector<Step>& steps() const { return steps_; }

  /// Where the padded frame goes: u8[padded_height, padded_width].
  Buffer& frame() { return *frame_; }

  /// Outputs in order of computation.
  const std::vector<Stage>& stages() const { return stages_; }
  std::size_t device_bytes() const;

 private:
  Buffer* make(std::size_t words);
  Buffer* add_flat_field(const std::vector<float>& gains);
  Buffer* add_halve(Buffer* pixels);
  /// From the level's pixels to its quads, and on the whole image's pixels to its edges.
  void add_level(std::size_t index, Buffer* level_pixels, Buffer* pixels, const DetectorConfig& config);

  Backend& backend_;
  std::vector<MarkerLevel> levels_;
  std::vector<std::unique_ptr<Buffer>> buffers_;
  Buffer* frame_ = nullptr;
  std::vector<Step> steps_;
  std::vector<Stage> stages_;
  std::unique_ptr<Plan> plan_;
};

/// Copies an image into a padded frame, repeating its last column and row into the padding.
void pad_frame(View2D<const u8> image, const MarkerGeometry& geometry, u8* frame);

}  // namespace berth
