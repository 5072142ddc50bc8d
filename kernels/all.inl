// Every operation's text, in the order of ops.h, for languages that compile them together.
// clang-format off
#include "fixed.h"
#include "runs.h"

#include "flat_field.inl"
#include "halve.inl"
#include "tile_extrema.inl"
#include "tile_histogram.inl"
#include "normalize.inl"
#include "threshold.inl"
#include "despeckle.inl"
#include "run_count.inl"
#include "scan.inl"
#include "run_emit.inl"
#include "run_link.inl"
#include "contour_measure.inl"
#include "contour_collect.inl"
#include "contour_trace.inl"
#include "quad_fit.inl"
#include "edge_refine.inl"
// clang-format on
