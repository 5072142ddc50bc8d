#include "stream_log.hpp"

#include <vector>

#include "berth/error.hpp"

namespace berth::cli {
namespace {

/// A camera's frame has a latency in place of its own share of the processor's time.
void add_times(const PipelineFrame& frame, Json& line) {
  line.erase("ms");
  line["latency_ms"] = ms_of(frame.laps_ns[static_cast<std::size_t>(Lap::latency)]);
  for (const Lap lap : {Lap::wait, Lap::queue}) {
    line["stages_us"][name_of(lap)] = static_cast<double>(frame.laps_ns[static_cast<std::size_t>(lap)]) / 1e3;
  }
}

}  // namespace

StreamLog::StreamLog(const std::string& path, Console& console) : path_(path), console_(console) {
  if (!is_file()) return;
  file_.open(path, std::ios::binary);
  if (!file_) throw Error(path + ": the log cannot be written; check the folder and its permissions");
}

void StreamLog::write(const LoggedFrame& frame, const DetectorConfig& config) {
  const StreamFrame& source = frame.source;
  const FrameResult& result = frame.result;
  Json line = to_json(result, source.label, frame.cpu_ns, source.truth);
  for (std::size_t i = 0; i < frame.systematic.size(); ++i) {
    add_systematic(frame.systematic[i], line["detections"][i]);
  }
  if (frame.paced != nullptr) add_times(*frame.paced, line);
  if (frame.health != HealthMode::nominal) line["health"] = name_of(frame.health);
  if (!config.bundles.empty()) line["bundles"] = to_json(result.bundles, config.bundles);
  if (!result.disc_targets.empty()) line["targets"] = to_json(result.disc_targets, config.disc_targets);
  for (const TruthTarget& target : source.truth_targets) line["truth_targets"].push_back(to_json(target));
  if (frame.filters != nullptr) line["filtered"] = frame.filters->to_json();
  if (frame.tracked != nullptr) line["search"] = to_json(*frame.tracked);
  write(line);
}

void StreamLog::write(const Json& line) { (is_file() ? file_ : console_.out()) << to_line(line) << '\n'; }

void StreamLog::close(std::ostream& people) {
  if (!is_file()) return;
  file_.close();
  if (file_) {
    people << "log         " << path_ << '\n';
  } else {
    console_.complain(path_ + ": writing the log failed; check the disk's space");
  }
}

}  // namespace berth::cli
