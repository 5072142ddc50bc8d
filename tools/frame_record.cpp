#include "frame_record.hpp"

#include <fmt/format.h>

#include <set>

namespace berth::cli {
namespace {

/// What differs from run to run: times, and what the recording itself lacks.
const std::set<std::string> kNotCompared = {"stages_us", "laps_us", "missed"};

std::string name_in(const std::string& where, const std::string& key) {
  return where.empty() ? key : fmt::format("{}.{}", where, key);
}

std::string difference(const Json& recorded, const Json& replayed, const std::string& where) {
  if (recorded.is_object() && replayed.is_object()) {
    for (const auto& [key, value] : recorded.items()) {
      const std::string field = name_in(where, key);
      if (where.empty() && kNotCompared.count(key) != 0) continue;
      if (!replayed.contains(key)) return fmt::format("{} is missing, was {}", field, to_line(value));
      std::string inner = difference(value, replayed[key], field);
      if (!inner.empty()) return inner;
    }
    for (const auto& [key, value] : replayed.items()) {
      if (where.empty() && kNotCompared.count(key) != 0) continue;
      if (!recorded.contains(key)) return fmt::format("{} is new: {}", name_in(where, key), to_line(value));
    }
    return "";
  }
  if (recorded.is_array() && replayed.is_array()) {
    for (std::size_t i = 0; i < recorded.size() && i < replayed.size(); ++i) {
      std::string inner = difference(recorded[i], replayed[i], fmt::format("{}[{}]", where, i));
      if (!inner.empty()) return inner;
    }
    if (recorded.size() == replayed.size()) return "";
    return fmt::format("{} has {} entries, had {}", where, replayed.size(), recorded.size());
  }
  // As text: the sign of a zero counts, and a number reads back as the same double.
  const std::string was = to_line(recorded), is = to_line(replayed);
  return was == is ? "" : fmt::format("{} is {}, was {}", where, is, was);
}

}  // namespace

Json frame_record(const ObservedFrame& frame, const DetectorConfig& config, const Json& filtered) {
  const FrameResult& result = frame.result;
  Json record = to_json(result, frame.label, 0, frame.truth);
  record.erase("ms");
  record["exposure_start_ns"] = result.stamp.exposure_start_ns;
  record["arrival_ns"] = result.stamp.arrival_ns;
  record["mode"] = name_of(frame.mode);
  record["digest"] = fmt::format("{:016x}", frame.digest);
  if (frame.paced != nullptr) {
    for (std::size_t i = 0; i < kLaps; ++i) {
      record["laps_us"][name_of(static_cast<Lap>(i))] = static_cast<double>(frame.paced->laps_ns[i]) / 1e3;
    }
  }
  if (!config.bundles.empty()) record["bundles"] = to_json(result.bundles, config.bundles);
  if (!result.disc_targets.empty()) record["targets"] = to_json(result.disc_targets, config.disc_targets);
  for (const TruthTarget& target : frame.truth_targets) record["truth_targets"].push_back(to_json(target));
  if (frame.tracked != nullptr) record["search"] = to_json(*frame.tracked);
  if (!filtered.is_null()) record["filtered"] = filtered;
  return record;
}

std::string first_difference(const Json& recorded, const Json& replayed) { return difference(recorded, replayed, ""); }

}  // namespace berth::cli
