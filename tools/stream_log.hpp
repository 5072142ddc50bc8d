#pragma once

#include <cstdint>
#include <fstream>
#include <ostream>
#include <string>

#include "berth/detector.hpp"
#include "berth/health.hpp"
#include "berth/pipeline.hpp"
#include "berth/tracker.hpp"
#include "console.hpp"
#include "frame_json.hpp"
#include "marker_filters.hpp"
#include "stream_frame.hpp"
#include "systematic_show.hpp"

namespace berth::cli {

/// What a stream's log says of a frame.
struct LoggedFrame {
  const StreamFrame& source;
  /// Poses in metres.
  const FrameResult& result;
  const SystematicCovariances& systematic;
  /// Processor time, ns; not of what came through a pipeline.
  std::int64_t cpu_ns;
  /// Null where there is none: its times in a pipeline, how it was searched, the markers' tracks.
  const PipelineFrame* paced;
  const TrackedFrame* tracked;
  const MarkerFilters* filters;
  HealthMode health;
};

/// The log of a stream: JSON lines (docs/command.md), to a file or to standard output.
class StreamLog {
 public:
  /// `path`: "-" is standard output, empty is no log. Throws Error where the file cannot be written.
  StreamLog(const std::string& path, Console& console);

  bool is_on() const { return !path_.empty(); }
  /// `config`: what names bundles and targets.
  void write(const LoggedFrame& frame, const DetectorConfig& config);
  void write(const Json& line);
  /// Ends the file and says where it is. Complains of one that was not written and does not throw: recordings and views
  /// are yet to be ended.
  void close(std::ostream& people);

 private:
  bool is_file() const { return is_on() && path_ != "-"; }

  const std::string path_;
  Console& console_;
  std::ofstream file_;
};

}  // namespace berth::cli
