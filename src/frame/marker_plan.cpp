#include "frame/marker_plan.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "berth/error.hpp"
#include "berth/marker.hpp"
#include "divide_up.hpp"

namespace berth {
namespace {

constexpr int kMaxSide = 16384;

// What a contour and a quadrilateral must have to be worth a look; px. A 12 px marker tilted by 60° is 6 px wide.
constexpr int kMinContourSide = 5;
constexpr int kMinContourArea = 24;
constexpr int kMinQuadSide = 4;
// Extents that keep the cross products of quad_fit in 32 bits.
constexpr int kMaxContourSide = 16000;

// Where black ends between a neighbourhood's extremes, q8.
constexpr int kMiddle = 128;
constexpr int kDark = 80;

int clamp(long long value, int low, int high) {
  return static_cast<int>(std::max<long long>(low, std::min<long long>(high, value)));
}

int capacity(const char* what, int wanted, long long by_area, int low, int high) {
  if (wanted == 0) return clamp(by_area, low, high);
  if (wanted < 1 || wanted > high) {
    throw Error(std::string("capacity '") + what + "' is " + std::to_string(wanted) + "; give 1 to " +
                std::to_string(high) + ", or 0 for the default");
  }
  return wanted;
}

/// A window's lists: no contour has more points than there are run ends.
DetectorConfig window_config(int side, DetectorConfig config) {
  if (config.capacities.points == 0) {
    config.capacities.points = clamp(static_cast<long long>(side) * side / 4, 4096, 1 << 22);
  }
  if (config.capacities.contours == 0) config.capacities.contours = clamp(side * side / 256, 64, 4096);
  return config;
}

}  // namespace

std::vector<u32> pack_gains(const std::vector<float>& gains, const MarkerGeometry& g) {
  const std::size_t width = static_cast<std::size_t>(g.width);
  const std::size_t stride = static_cast<std::size_t>(g.padded_width);
  if (gains.size() != width * static_cast<std::size_t>(g.height)) {
    throw Error("flat field has " + std::to_string(gains.size()) + " gains; the image has " + std::to_string(g.width) +
                "x" + std::to_string(g.height) + " pixels");
  }
  std::vector<u32> packed(g.frame_bytes() / 2);
  for (int y = 0; y < g.padded_height; ++y) {
    for (int x = 0; x < g.padded_width; ++x) {
      const float gain = gains[static_cast<std::size_t>(std::min(y, g.height - 1)) * width +
                               static_cast<std::size_t>(std::min(x, g.width - 1))];
      if (!(gain >= 0.0F && gain < 16.0F)) {
        throw Error("flat field gain " + std::to_string(gain) + " at (" + std::to_string(x) + ", " + std::to_string(y) +
                    ") is outside 0 to 16");
      }
      const std::size_t to = static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x);
      packed[to / 2] |= std::min(65535u, static_cast<u32>(gain * 4096.0F + 0.5F)) << (16 * (to % 2));
    }
  }
  return packed;
}

MarkerGeometry::MarkerGeometry(int image_width, int image_height, const Capacities& wanted)
    : width(image_width), height(image_height) {
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide) {
    throw Error("image size " + std::to_string(width) + "x" + std::to_string(height) + " is outside 1x1 to " +
                std::to_string(kMaxSide) + "x" + std::to_string(kMaxSide) + "; scale the image");
  }
  padded_width = round_up(width, 32);
  padded_height = round_up(height, 4);
  tile_rows = padded_height / 4;
  tile_row_words = padded_width / 16;
  bit_row_words = padded_width / 32;
  bit_words = height * bit_row_words;
  word_groups = bit_words / kGroupSize + 1;
  const long long area = static_cast<long long>(width) * height;
  max_run_ends = round_up(capacity("run_ends", wanted.run_ends, area / 4, 4096, 1 << 25), 2 * kGroupSize);
  max_contours = capacity("contours", wanted.contours, area / 512, 256, 16384);
  max_points = capacity("points", wanted.points, area / 4, 65536, 1 << 22);
  run_groups = max_run_ends / 2 / kGroupSize;
  totals_at = run_groups * kGroupSize;
}

MarkerPlan::MarkerPlan(Backend& backend, int width, int height, const DetectorConfig& config)
    : MarkerPlan(backend, width, height, config, false, nullptr) {}

MarkerPlan MarkerPlan::of_window(Backend& backend, int side, const DetectorConfig& config, ScratchBuffers* scratch) {
  return MarkerPlan(backend, side, side, window_config(side, config), true, scratch);
}

MarkerPlan::MarkerPlan(Backend& backend, int width, int height, const DetectorConfig& config, bool is_window,
                       ScratchBuffers* scratch)
    : backend_(backend), is_window_(is_window), buffers_(backend), scratch_(scratch) {
  if (scratch_ != nullptr) scratch_->begin();
  const MarkerGeometry whole(width, height, config.capacities);
  const MarkerGeometry half((width + 1) / 2, (height + 1) / 2, config.capacities);
  searches_ = {
      {"", {{"run_ends", "contours", "points"}}, whole, 1, nullptr, nullptr, nullptr, nullptr},
      {"half_", {{"half_run_ends", "half_contours", "half_points"}}, half, 2, nullptr, nullptr, nullptr, nullptr},
      {"dark_", {{"dark_run_ends", "dark_contours", "dark_points"}}, half, 2, nullptr, nullptr, nullptr, nullptr},
  };
  frame_ = buffers_.make(whole.frame_bytes() / 4);
  Buffer* pixels = config.flat_field.empty() ? frame_ : add_flat_field(config.flat_field);
  add_search(0, kMiddle, pixels, add_tiles(0, pixels, kNormalizeWhole), pixels, config);
  if (is_window_) full_resolution_plan_ = backend_.record(steps_);
  Buffer* half_pixels = add_halve(pixels);
  const Tiles half_tiles = add_tiles(1, half_pixels, kNormalizeHalf);
  add_search(1, kMiddle, half_pixels, half_tiles, pixels, config);
  add_search(2, kDark, half_pixels, half_tiles, pixels, config);
  plan_ = backend_.record(steps_);
}

Buffer* MarkerPlan::add_flat_field(const std::vector<float>& gains) {
  const MarkerGeometry& g = geometry();
  Buffer* buffer = buffers_.make(g.frame_bytes() / 2);
  if (is_window_) {
    gains_ = buffer;
  } else {
    flat_field_ = buffer;
    const std::vector<u32> packed = pack_gains(gains, g);
    upload_at_start(backend_, *backend_.make_stream(), *buffer, packed.data(), packed.size() * 4);
  }
  const int words = static_cast<int>(g.frame_bytes() / 4);
  Buffer* pixels = make_scratch(g.frame_bytes() / 4);
  steps_.push_back(make_step(flat_field_params{words}, {frame_, buffer, pixels}, words));
  stages_.push_back({"flat_field", 0, pixels, Stage::Length::whole});
  return pixels;
}

void MarkerPlan::list_constants(std::vector<ConstantMemory>& to) const {
  plan_->list_constants(to);
  if (full_resolution_plan_) full_resolution_plan_->list_constants(to);
  if (flat_field_ != nullptr && flat_field_->host() != nullptr) {
    to.push_back({"flat field", flat_field_->host(), flat_field_->bytes()});
  }
}

Buffer* MarkerPlan::add_halve(Buffer* pixels) {
  const MarkerGeometry& whole = searches_[0].geometry;
  const MarkerGeometry& half = searches_[1].geometry;
  Buffer* half_pixels = make_scratch(half.frame_bytes() / 4);
  const halve_params params{whole.padded_width / 4, whole.padded_height, half.padded_width / 4, half.padded_height};
  steps_.push_back(make_step(params, {pixels, half_pixels}, params.half_row_words * params.half_rows));
  stages_.push_back({"halve", 1, half_pixels, Stage::Length::whole});
  return half_pixels;
}

void MarkerPlan::add_stage(std::size_t index, const char* name, Buffer* buffer, Stage::Length length) {
  stages_.push_back({std::string(searches_[index].prefix) + name, index, buffer, length});
}

MarkerPlan::Tiles MarkerPlan::add_tiles(std::size_t index, Buffer* pixels, const normalize_params& normalize) {
  const MarkerGeometry& g = searches_[index].geometry;
  const int words = g.tile_rows * g.tile_row_words;
  const Tiles tiles{make_scratch(static_cast<std::size_t>(words)), make_scratch(static_cast<std::size_t>(words)),
                    buffers_.make(4)};
  levels_[index] = tiles.levels;
  add_step(make_step(tile_extrema_params{g.tile_row_words, g.tile_rows}, {pixels, tiles.minima, tiles.maxima}, words));
  add_stage(index, "tile_minima", tiles.minima);
  add_stage(index, "tile_maxima", tiles.maxima);
  if (is_window_) return tiles;  // the frame's levels are not to be had from a part of it
  Buffer* histograms = buffers_.make(kHistogramGroups * 768);
  add_step(make_step(tile_histogram_params{words, kHistogramStep, kHistogramGroups},
                     {tiles.minima, tiles.maxima, histograms}, kHistogramGroups * kGroupSize));
  add_stage(index, "tile_histogram", histograms);
  add_step(make_step(normalize, {histograms, tiles.levels}, kGroupSize));
  add_stage(index, "normalize", tiles.levels);
  return tiles;
}

void MarkerPlan::add_search(std::size_t index, int cut, Buffer* search_pixels, const Tiles& tiles, Buffer* pixels,
                            const DetectorConfig& config) {
  MarkerSearch& search = searches_[index];
  const MarkerGeometry& g = search.geometry;
  const MarkerGeometry& whole = geometry();
  const std::size_t contours = static_cast<std::size_t>(g.max_contours);
  const int base_at = g.word_groups * kGroupSize;
  const int height = g.height;
  const int row_words = g.bit_row_words;
  Buffer* raw_bits = make_scratch(static_cast<std::size_t>(g.bit_words));
  Buffer* bits = make_scratch(static_cast<std::size_t>(g.bit_words));
  Buffer* offsets = make_scratch(static_cast<std::size_t>(base_at + g.word_groups + 1));
  Buffer* cracks = make_scratch(static_cast<std::size_t>(g.max_run_ends));
  Buffer* nodes = make_scratch(static_cast<std::size_t>(g.max_run_ends));
  Buffer* spans = make_scratch(static_cast<std::size_t>(g.totals_at + 2 * (g.run_groups + 1)));
  search.points = make_scratch(static_cast<std::size_t>(g.max_points));
  search.contours = buffers_.make(CONTOUR_HEADER + contours * CONTOUR_WORDS);
  search.quads = buffers_.make(contours * QUAD_WORDS);
  search.edges = buffers_.make(contours * EDGE_WORDS);

  const auto run = [&](const auto& params, std::initializer_list<Buffer*> buffers, int items) {
    add_step(make_step(params, buffers, items));
  };
  const auto stage = [&](const char* name, Buffer* buffer, Stage::Length length = Stage::Length::whole) {
    add_stage(index, name, buffer, length);
  };
  run(threshold_params{g.width, height, row_words, g.tile_rows, cut},
      {search_pixels, tiles.minima, tiles.maxima, tiles.levels, raw_bits}, g.tile_rows * row_words);
  stage("threshold", raw_bits);
  run(despeckle_params{height, row_words}, {raw_bits, bits}, g.bit_words);
  stage("despeckle", bits);
  run(run_count_params{height, row_words, base_at}, {bits, offsets}, g.word_groups * kGroupSize);
  run(scan_params{base_at, g.word_groups}, {offsets}, kGroupSize);
  stage("run_count", offsets);
  run(run_emit_params{height, row_words, base_at, g.max_run_ends}, {bits, offsets, cracks}, g.bit_words);
  stage("run_emit", cracks, Stage::Length::run_ends);
  run(run_link_params{height, row_words, base_at, g.max_run_ends}, {bits, offsets, cracks, nodes}, g.bit_words);
  stage("run_link", nodes, Stage::Length::run_ends);
  contour_measure_params measure{};
  measure.height = height;
  measure.row_words = row_words;
  measure.base_at = base_at;
  measure.capacity = g.max_run_ends;
  measure.totals_at = g.totals_at;
  measure.groups = g.run_groups;
  measure.min_side = kMinContourSide;
  measure.min_area = kMinContourArea;
  measure.max_side = std::min(kMaxContourSide, std::max(g.width, height));
  for (const std::string& name : config.families) {
    (family(name).reversed_border ? measure.want_holes : measure.want_outer) = 1;
  }
  if (!config.disc_targets.empty()) measure.want_outer = 1;
  run(measure, {nodes, offsets, spans}, g.run_groups * kGroupSize);
  run(scan_params{g.totals_at, g.run_groups}, {spans}, kGroupSize);
  run(scan_params{g.totals_at + g.run_groups + 1, g.run_groups}, {spans}, kGroupSize);
  stage("contour_measure", spans);
  run(contour_collect_params{height, row_words, base_at, g.totals_at, g.run_groups, g.max_contours, g.max_points},
      {spans, offsets, search.contours}, std::max(g.run_groups * kGroupSize, g.max_contours));
  stage("contour_collect", search.contours);
  run(contour_trace_params{g.max_contours}, {nodes, search.contours, search.points}, g.max_contours);
  stage("contour_trace", search.points, Stage::Length::points);
  run(quad_fit_params{g.max_contours, kMinQuadSide, g.width, height, is_window_ ? kWindowMargin : 0},
      {search.contours, search.points, search.quads}, g.max_contours * kGroupSize);
  stage("quad_fit", search.quads, Stage::Length::quads);
  run(edge_refine_params{search.scale, whole.width, whole.height, whole.padded_width / 4, g.max_contours},
      {pixels, tiles.levels, search.quads, search.edges}, g.max_contours * kGroupSize);
  stage("edge_refine", search.edges, Stage::Length::edges);
}

void pad_frame(View2D<const u8> image, const MarkerGeometry& geometry, u8* frame) {
  const std::size_t stride = static_cast<std::size_t>(geometry.padded_width);
  for (int y = 0; y < geometry.height; ++y) {
    std::memcpy(frame + static_cast<std::size_t>(y) * stride, image.row(y), static_cast<std::size_t>(geometry.width));
  }
  pad_in_place(geometry, frame);
}

void pad_in_place(const MarkerGeometry& geometry, u8* frame) {
  const std::size_t stride = static_cast<std::size_t>(geometry.padded_width);
  const std::size_t width = static_cast<std::size_t>(geometry.width);
  u8* row = frame;
  for (int y = 0; y < geometry.height; ++y, row += stride) std::memset(row + width, row[width - 1], stride - width);
  for (int y = geometry.height; y < geometry.padded_height; ++y, row += stride) std::memcpy(row, row - stride, stride);
}

}  // namespace berth
