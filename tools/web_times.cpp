#include "web_times.hpp"

#include <cmath>
#include <cstring>

namespace berth::cli {

void WebTimes::add(const char* name, std::int64_t ns) {
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (std::strcmp(kNames[i], name) == 0) times_[i].add(ns);
  }
}

void WebTimes::add(const ObservedFrame& frame) {
  if (frame.paced != nullptr) {
    for (std::size_t i = 0; i < kLaps; ++i) add(name_of(static_cast<Lap>(i)), frame.paced->laps_ns[i]);
    return;
  }
  add("frame", frame.wall_ns);
  for (const StageTime& time : frame.result.times) {
    if (time.stage[0] != '\0') add(time.stage, time.ns);
  }
}

Json WebTimes::json() const {
  const auto ms = [](std::int64_t ns) { return std::round(ms_of(ns) * 1000) / 1000; };
  Json json = Json::array();
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const LatencyHistogram& times = times_[i];
    if (times.max() > 0)
      json.push_back({kNames[i], ms(times.quantile(0.5)), ms(times.quantile(0.99)), ms(times.max())});
  }
  return json;
}

}  // namespace berth::cli
