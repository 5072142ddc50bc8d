#pragma once

#include "berth/ops.hpp"
#include "berth/types.hpp"

/// The operations' definitions: scalar, obvious, sharing no code with kernels/. Buffers and their layouts are described
/// in kernels/ops.h; what an operation computes, at the top of its file here and of kernels/<op>.inl.
namespace berth::reference {

void flat_field(const flat_field_params& p, const u32* pixels, const u32* gains, u32* flat);
void halve(const halve_params& p, const u32* pixels, u32* half_pixels);
void tile_extrema(const tile_extrema_params& p, const u32* pixels, u32* minima, u32* maxima);
void tile_histogram(const tile_histogram_params& p, const u32* minima, const u32* maxima, u32* histograms);
void normalize(const normalize_params& p, const u32* histograms, u32* levels);
void threshold(const threshold_params& p, const u32* pixels, const u32* minima, const u32* maxima, const u32* levels,
               u32* bits);
void despeckle(const despeckle_params& p, const u32* bits, u32* clean);
void run_count(const run_count_params& p, const u32* bits, u32* offsets);
void scan(const scan_params& p, u32* values);
void run_emit(const run_emit_params& p, const u32* bits, const u32* offsets, u32* cracks);
void run_link(const run_link_params& p, const u32* bits, const u32* offsets, const u32* cracks, u32* nodes);
void contour_measure(const contour_measure_params& p, const u32* nodes, const u32* offsets, u32* spans);
void contour_collect(const contour_collect_params& p, const u32* spans, const u32* offsets, u32* contours);
void contour_trace(const contour_trace_params& p, const u32* nodes, const u32* contours, u32* points);
void quad_fit(const quad_fit_params& p, const u32* contours, const u32* points, s32* quads);
void edge_refine(const edge_refine_params& p, const u32* pixels, const u32* levels, const s32* quads, s32* edges);
void extract_window(const extract_window_params& p, const u32* pixels, const s32* windows, u32* out_pixels);
void window_statistics(const window_statistics_params& p, const u32* pixels, s32* statistics);
void normalize_window(const normalize_window_params& p, const u32* pixels, const s32* statistics, u32* tensor);
void convolve(const convolve_params& p, const u32* tensor, const u32* weights, const s32* channels, u32* out_tensor);
void local_response_norm(const local_response_norm_params& p, const u32* tensor, const s32* table, u32* out_tensor);
void max_pool(const max_pool_params& p, const u32* tensor, u32* out_tensor);
void fully_connected(const fully_connected_params& p, const u32* tensor, const u32* weights, const s32* channels,
                     u32* out_tensor);

}  // namespace berth::reference
