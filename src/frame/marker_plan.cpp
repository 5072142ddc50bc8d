#include "frame/marker_plan.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "berth/error.hpp"
#include "berth/marker.hpp"

namespace berth {
namespace {

constexpr int kMaxSide = 16384;
constexpr int kHistogramGroups = 2;
constexpr int kHistogramStep = 8;

// What a contour and a quadrilateral must have to be worth a look; px. A 12 px marker tilted by 60° is 6 px wide.
constexpr int kMinContourSide = 5;
constexpr int kMinContourArea = 24;
constexpr int kMinQuadSide = 4;
// Extents that keep the cross products of quad_fit in 32 bits.
constexpr int kMaxContourSide = 16000;

int round_up(int value, int multiple) { return (value + multiple - 1) / multiple * multiple; }
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

}  // namespace

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
  max_contours = capacity("contours", wanted.contours, area / 512, 1024, 16384);
  max_points = capacity("points", wanted.points, area / 4, 65536, 1 << 22);
  run_groups = max_run_ends / 2 / kGroupSize;
  totals_at = run_groups * kGroupSize;
}

MarkerPlan::MarkerPlan(Backend& backend, const MarkerGeometry& geometry, const DetectorConfig& config)
    : backend_(backend), geometry_(geometry) {
  bool want_outer = false;
  bool want_holes = false;
  for (const std::string& name : config.families) (family(name).reversed_border ? want_holes : want_outer) = true;
  build(want_outer, want_holes, !config.flat_field.empty());
  if (!config.flat_field.empty()) {
    const MarkerGeometry& g = geometry_;
    if (config.flat_field.size() != static_cast<std::size_t>(g.width) * static_cast<std::size_t>(g.height)) {
      throw Error("flat field has " + std::to_string(config.flat_field.size()) + " gains; the image has " +
                  std::to_string(g.width) + "x" + std::to_string(g.height) + " pixels");
    }
    std::vector<u32> gains(g.frame_bytes() / 2);
    for (int y = 0; y < g.padded_height; ++y) {
      for (int x = 0; x < g.padded_width; ++x) {
        const std::size_t from = static_cast<std::size_t>(std::min(y, g.height - 1)) * static_cast<std::size_t>(g.width) +
                                 static_cast<std::size_t>(std::min(x, g.width - 1));
        const float gain = config.flat_field[from];
        if (!(gain >= 0.0F && gain < 16.0F)) {
          throw Error("flat field gain " + std::to_string(gain) + " at (" + std::to_string(x) + ", " +
                      std::to_string(y) + ") is outside 0 to 16");
        }
        const u32 q12 = std::min(65535u, static_cast<u32>(gain * 4096.0F + 0.5F));
        const std::size_t to = static_cast<std::size_t>(y) * static_cast<std::size_t>(g.padded_width) +
                               static_cast<std::size_t>(x);
        gains[to / 2] |= q12 << (16 * (to % 2));
      }
    }
    const std::unique_ptr<Stream> stream = backend_.make_stream();
    stream->upload(*gains_, gains.data(), gains.size() * 4);
    stream->finish();
  }
  plan_ = backend_.record(steps_);
}

Buffer* MarkerPlan::make(std::size_t words) {
  buffers_.push_back(backend_.make_buffer(words * 4));
  return buffers_.back().get();
}

void MarkerPlan::build(bool want_outer, bool want_holes, bool flat_field) {
  const MarkerGeometry& g = geometry_;
  const std::size_t contours = static_cast<std::size_t>(g.max_contours);
  const int tile_words = g.tile_rows * g.tile_row_words;
  const int base_at = g.word_groups * kGroupSize;
  frame_ = make(g.frame_bytes() / 4);
  Buffer* pixels = frame_;
  Buffer* minima = make(static_cast<std::size_t>(tile_words));
  Buffer* maxima = make(static_cast<std::size_t>(tile_words));
  Buffer* histograms = make(kHistogramGroups * 768);
  Buffer* levels = make(4);
  Buffer* raw_bits = make(static_cast<std::size_t>(g.bit_words));
  Buffer* bits = make(static_cast<std::size_t>(g.bit_words));
  Buffer* offsets = make(static_cast<std::size_t>(base_at + g.word_groups + 1));
  Buffer* cracks = make(static_cast<std::size_t>(g.max_run_ends));
  Buffer* nodes = make(static_cast<std::size_t>(g.max_run_ends));
  Buffer* spans = make(static_cast<std::size_t>(g.totals_at + 2 * (g.run_groups + 1)));
  contours_ = make(CONTOUR_HEADER + contours * CONTOUR_WORDS);
  Buffer* points = make(static_cast<std::size_t>(g.max_points));
  quads_ = make(contours * QUAD_WORDS);
  edges_ = make(contours * EDGE_WORDS);

  const auto run = [&](const auto& params, std::initializer_list<Buffer*> buffers, int items) {
    steps_.push_back(make_step(params, buffers, items));
  };
  const auto stage = [&](const char* name, Buffer* buffer, Stage::Length length = Stage::Length::whole) {
    stages_.push_back({name, buffer, length});
  };
  const auto height = g.height;
  const auto row_words = g.bit_row_words;

  if (flat_field) {
    gains_ = make(g.frame_bytes() / 2);
    pixels = make(g.frame_bytes() / 4);
    const int words = static_cast<int>(g.frame_bytes() / 4);
    run(flat_field_params{words}, {frame_, gains_, pixels}, words);
    stage("flat_field", pixels);
  }
  run(tile_extrema_params{g.tile_row_words, g.tile_rows}, {pixels, minima, maxima}, tile_words);
  stage("tile_minima", minima);
  stage("tile_maxima", maxima);
  run(tile_histogram_params{tile_words, kHistogramStep, kHistogramGroups}, {minima, maxima, histograms},
      kHistogramGroups * kGroupSize);
  stage("tile_histogram", histograms);
  run(normalize_params{kHistogramGroups, 10, 990, 250, 40, 30, 5, 40}, {histograms, levels}, kGroupSize);
  stage("normalize", levels);
  run(threshold_params{g.width, height, row_words, g.tile_rows}, {pixels, minima, maxima, levels, raw_bits},
      g.tile_rows * row_words);
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
  measure.want_outer = want_outer ? 1 : 0;
  measure.want_holes = want_holes ? 1 : 0;
  run(measure, {nodes, offsets, spans}, g.run_groups * kGroupSize);
  run(scan_params{g.totals_at, g.run_groups}, {spans}, kGroupSize);
  run(scan_params{g.totals_at + g.run_groups + 1, g.run_groups}, {spans}, kGroupSize);
  stage("contour_measure", spans);
  run(contour_collect_params{height, row_words, base_at, g.totals_at, g.run_groups, g.max_contours, g.max_points},
      {spans, offsets, contours_}, std::max(g.run_groups * kGroupSize, g.max_contours));
  stage("contour_collect", contours_);
  run(contour_trace_params{g.max_contours}, {nodes, contours_, points}, g.max_contours);
  stage("contour_trace", points, Stage::Length::points);
  run(quad_fit_params{g.max_contours, kMinQuadSide}, {contours_, points, quads_}, g.max_contours * kGroupSize);
  stage("quad_fit", quads_, Stage::Length::quads);
  run(edge_refine_params{g.width, height, g.padded_width / 4, g.max_contours}, {pixels, levels, quads_, edges_},
      g.max_contours * kGroupSize);
  stage("edge_refine", edges_, Stage::Length::edges);
}

std::size_t MarkerPlan::device_bytes() const {
  std::size_t bytes = 0;
  for (const auto& buffer : buffers_) bytes += buffer->bytes();
  return bytes;
}

void pad_frame(View2D<const u8> image, const MarkerGeometry& geometry, u8* frame) {
  const std::size_t stride = static_cast<std::size_t>(geometry.padded_width);
  const std::size_t width = static_cast<std::size_t>(geometry.width);
  for (int y = 0; y < geometry.padded_height; ++y) {
    u8* to = frame + static_cast<std::size_t>(y) * stride;
    const u8* from = image.row(std::min(y, geometry.height - 1));
    std::memcpy(to, from, width);
    std::memset(to + width, from[geometry.width - 1], stride - width);
  }
}

}  // namespace berth
