#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "berth/image.hpp"
#include "buffer_list.hpp"
#include "scratch_buffers.hpp"

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

/// One search for quadrilaterals: in the whole or the halved image, thresholded at one cut. The host reads its contour
/// header and records, its quads and its edges, and where targets of discs are looked for the contours' points
/// (kernels/ops.h).
struct MarkerSearch {
  /// Before the names of its stages and capacities: "", "half_" or "dark_".
  const char* prefix;
  /// Of run ends, contours and points.
  std::array<const char*, 3> capacity_names;
  MarkerGeometry geometry;
  /// Pixels of the whole image a pixel searched: 1 or 2.
  int scale;
  Buffer* contours;
  Buffer* points;
  Buffer* quads;
  Buffer* edges;
};

/// How the levels of a frame are had (docs/marker-pipeline.md): every kHistogramStep-th word of tiles is counted.
inline constexpr int kHistogramStep = 8;
inline constexpr int kHistogramGroups = 2;
/// Black and white at the 1st and 99th percentile, noise at the 25th of the ranges. A tile must have 4 % of the frame's
/// contrast and 2.5 times its noise; 18 grey levels at least in the whole image, 5 in the halved one, which sees the
/// rest with half the noise.
inline constexpr normalize_params kNormalizeWhole = {kHistogramGroups, 10, 990, 250, 40, 40, 18, 40};
inline constexpr normalize_params kNormalizeHalf = {kHistogramGroups, 10, 990, 250, 40, 40, 5, 40};

/// How far from a window's border contours must stay, pixels of the image searched: as far they are the frame's
/// (docs/tracking.md).
inline constexpr int kWindowMargin = 8;

/// One stage's output, for digests and comparison: the buffer and how many of its words the frame has written.
struct Stage {
  std::string name;
  std::size_t search;
  Buffer* buffer;
  enum class Length { whole, run_ends, points, quads, edges } length;
};

/// The docking plan: the list of operations from pixels to refined sides, with all its buffers on one backend. Markers
/// are searched three times: in the whole image, which finds the small ones; in the halved one, where noise and blur
/// are half as strong; and there again with only the darkest as black, which parts a marker from its dark surroundings
/// (docs/marker-pipeline.md).
class MarkerPlan {
 public:
  /// Throws Error on an image size or a capacity out of bounds, an unknown family or a bad flat field.
  MarkerPlan(Backend& backend, int width, int height, const DetectorConfig& config);

  /// The plan of a square window: levels() and, where there is a flat field, gains() come with each frame, and contours
  /// within kWindowMargin of its border are left out (docs/tracking.md).
  /// `scratch`: what other windows' plans on the same stream may overwrite, for all between the frame and what the host
  /// reads; its stages are then no longer there. Null: all buffers are its own.
  static MarkerPlan of_window(Backend& backend, int side, const DetectorConfig& config,
                              ScratchBuffers* scratch = nullptr);

  /// Of the whole image.
  const MarkerGeometry& geometry() const { return searches_.front().geometry; }
  const std::vector<MarkerSearch>& searches() const { return searches_; }
  Plan& plan() { return *plan_; }
  /// A window's plan up to the whole image's search: its stages are those of search 0.
  Plan& full_resolution_plan() { return *full_resolution_plan_; }
  const std::vector<Step>& steps() const { return steps_; }

  /// Where the padded frame goes: u8[padded_height, padded_width].
  Buffer& frame() { return *frame_; }
  /// What normalize says of the whole (0) and of the halved image (1): u32[4].
  Buffer& levels(std::size_t scale) { return *levels_[scale]; }
  /// Where a window's gains go, or null: u16 q12[padded_height, padded_width].
  Buffer* gains() { return gains_; }

  /// Adds what no frame writes, as far as the host reaches it.
  void list_constants(std::vector<ConstantMemory>& to) const;

  /// Outputs in order of computation.
  const std::vector<Stage>& stages() const { return stages_; }
  /// Without what it shares.
  std::size_t device_bytes() const { return buffers_.device_bytes(); }

 private:
  MarkerPlan(Backend& backend, int width, int height, const DetectorConfig& config, bool is_window,
             ScratchBuffers* scratch);
  /// What only the plan's own steps read.
  Buffer* make_scratch(std::size_t words) { return scratch_ != nullptr ? scratch_->take(words) : buffers_.make(words); }
  Buffer* add_flat_field(const std::vector<float>& gains);
  Buffer* add_halve(Buffer* pixels);
  /// The tiles' extrema and the levels they give, for the search `index` and those after it on the same pixels.
  struct Tiles {
    Buffer* minima;
    Buffer* maxima;
    Buffer* levels;
  };
  Tiles add_tiles(std::size_t index, Buffer* pixels, const normalize_params& normalize);
  /// From pixels and their tiles to quads, and on the whole image's pixels to edges.
  void add_search(std::size_t index, int cut, Buffer* search_pixels, const Tiles& tiles, Buffer* pixels,
                  const DetectorConfig& config);
  void add_step(const Step& step) { steps_.push_back(step); }
  void add_stage(std::size_t index, const char* name, Buffer* buffer, Stage::Length length = Stage::Length::whole);

  Backend& backend_;
  bool is_window_;
  std::vector<MarkerSearch> searches_;
  BufferList buffers_;
  ScratchBuffers* scratch_;  // while it is made
  Buffer* frame_ = nullptr;
  Buffer* gains_ = nullptr;
  Buffer* flat_field_ = nullptr;  // gains that stay
  std::array<Buffer*, 2> levels_ = {};
  std::vector<Step> steps_;
  std::vector<Stage> stages_;
  std::unique_ptr<Plan> plan_;
  std::unique_ptr<Plan> full_resolution_plan_;  // of a window
};

/// Gains as flat_field reads them: two u16 q12 a word, padded like the frame. Throws Error on a wrong number of them or
/// one outside 0 to 16.
std::vector<u32> pack_gains(const std::vector<float>& gains, const MarkerGeometry& geometry);

/// Copies an image into a padded frame, repeating its last column and row into the padding.
void pad_frame(View2D<const u8> image, const MarkerGeometry& geometry, u8* frame);
/// The padding alone, of a frame whose pixels are written.
void pad_in_place(const MarkerGeometry& geometry, u8* frame);

}  // namespace berth
