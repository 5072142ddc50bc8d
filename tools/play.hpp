#pragma once

#include <ostream>

#include "berth/pipeline.hpp"
#include "berth/source.hpp"
#include "frame_json.hpp"

namespace berth::cli {

/// A stream of frames at their own pace, summed up at its end.
class Play {
 public:
  virtual ~Play() = default;
  /// So far.
  virtual PipelineCounts counts() const = 0;
  /// How the engine is.
  virtual HealthReport engine() const = 0;
  /// What a camera has been through so far; all 0 where there is none.
  virtual SourceHealth health() const { return {}; }
  /// For people.
  virtual void sum_up(std::ostream& out) const = 0;
  /// For the log.
  virtual Json summary() const = 0;
};

}  // namespace berth::cli
