#pragma once

#include "berth/ops.hpp"
#include "berth/types.hpp"

/// Operations with row code, the reference's signatures. Each file is compiled for every instruction set Highway knows
/// here and picks one at run time.
namespace berth::simd_backend {

void halve(const halve_params& p, const u32* pixels, u32* half_pixels);
void tile_extrema(const tile_extrema_params& p, const u32* pixels, u32* minima, u32* maxima);
void tile_histogram(const tile_histogram_params& p, const u32* minima, const u32* maxima, u32* histograms);
void normalize(const normalize_params& p, const u32* histograms, u32* levels);
void despeckle(const despeckle_params& p, const u32* bits, u32* clean);
void run_count(const run_count_params& p, const u32* bits, u32* offsets);
void scan(const scan_params& p, u32* values);
void run_emit(const run_emit_params& p, const u32* bits, const u32* offsets, u32* cracks);
void contour_collect(const contour_collect_params& p, const u32* spans, const u32* offsets, u32* contours);
void contour_trace(const contour_trace_params& p, const u32* nodes, const u32* contours, u32* points);
void edge_refine(const edge_refine_params& p, const u32* pixels, const u32* levels, const s32* quads, s32* edges);
void normalize_window(const normalize_window_params& p, const u32* pixels, const s32* statistics, u32* tensor);
void max_pool(const max_pool_params& p, const u32* tensor, u32* out_tensor);

struct Workspace;

/// Those that need room to work in.
void threshold(Workspace& workspace, const threshold_params& p, const u32* pixels, const u32* minima, const u32* maxima,
               const u32* levels, u32* bits);
void run_link(Workspace& workspace, const run_link_params& p, const u32* bits, const u32* offsets, const u32* cracks,
              u32* nodes);
void contour_measure(Workspace& workspace, const contour_measure_params& p, const u32* nodes, const u32* offsets,
                     u32* spans);
void quad_fit(Workspace& workspace, const quad_fit_params& p, const u32* contours, const u32* points, s32* quads);

/// Operations that threads share, a part each: parts [first, last). How many parts there are is 0 for parameters that
/// only the kernel text can do.
constexpr int kMaxExtractColumns = 16384;
inline int parts(const extract_window_params& p) {                                 // rows of all windows
  return p.out_words <= kMaxExtractColumns / 40 - 1 ? p.count * p.out_height : 0;  // a pixel covers ten columns at most
}
void extract_window(const extract_window_params& p, const u32* pixels, const s32* windows, u32* out_pixels, int first,
                    int last);

constexpr int kMaxConvolveWords = 16384;
inline int parts(const convolve_params& p) {  // rows of all output tensors
  const bool fits = static_cast<long long>(p.width + 2 * p.pad_x) * p.words * p.kernel_height <= kMaxConvolveWords;
  return fits && p.group_out_words % 2 == 0 ? p.count * p.out_height : 0;
}
void convolve(const convolve_params& p, const u32* tensor, const u32* weights, const s32* channels, u32* out_tensor,
              int first, int last);

constexpr int kMaxResponseChannels = 4096;
inline int parts(const local_response_norm_params& p) { return p.words * 4 <= kMaxResponseChannels ? p.pixels : 0; }
void local_response_norm(const local_response_norm_params& p, const u32* tensor, const s32* table, u32* out_tensor,
                         int first, int last);

inline int parts(const fully_connected_params& p) { return p.out_channels / 4; }  // output words, at every position
void fully_connected(const fully_connected_params& p, const u32* tensor, const u32* weights, const s32* channels,
                     u32* out_tensor, int first, int last);

}  // namespace berth::simd_backend

/// Defines the dispatching function of an operation; its arguments, then their names in parentheses.
#define BERTH_SIMD_DISPATCH(op, parameters, arguments) \
  HWY_EXPORT(op);                                      \
  void op parameters { HWY_DYNAMIC_DISPATCH(op) arguments; }
