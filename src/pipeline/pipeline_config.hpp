#pragma once

#include "berth/pipeline.hpp"

namespace berth {

/// The configuration for frames of this size; with tracking, the detector's windows are the tracker's. Throws Error
/// where something is out of bounds.
PipelineConfig checked_pipeline(PipelineConfig config, int width, int height);

}  // namespace berth
