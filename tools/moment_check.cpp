#include "moment_check.hpp"

#include <fmt/format.h>

#include "berth/error.hpp"
#include "frame_record.hpp"
#include "moment_record.hpp"
#include "recording/cdr_reader.hpp"

namespace berth::cli {
namespace {

std::int64_t time_of(const Json& record) { return record["time_ns"].get<std::int64_t>(); }

/// The stations' frames that a moment is of, for people too: "robot 17, dock 17".
std::string frames_of(const Json& record) {
  std::string frames;
  for (const StationSide side : {StationSide::robot, StationSide::dock}) {
    if (!record.contains(name_of(side))) continue;
    frames += fmt::format("{}{} {}", frames.empty() ? "" : ", ", name_of(side),
                          to_line(record[name_of(side)].value("sequence", Json())));
  }
  return frames;
}

bool is_moment(const Json& record) {
  if (!record.is_object() || !record.contains("time_ns") || !record["time_ns"].is_number_integer()) return false;
  for (const char* side : {"robot", "dock"}) {
    if (record.contains(side) && !record[side].is_object()) return false;
  }
  return true;
}

}  // namespace

MomentCheck::MomentCheck(const std::string& path) : reader_(path) {
  if (reader_.find_metadata(kStationsMetadata) == nullptr) {
    throw Error(path + ": it is no recording of both stations; name what `record` at the top of the file has written");
  }
  recorded_ = next_record();
}

/// That can be read at all.
std::optional<Json> MomentCheck::next_record() {
  while (const mcap::Message* message = reader_.next()) {
    const auto channel = reader_.channels().find(message->channel);
    if (channel == reader_.channels().end() || channel->second.topic != kMomentTopic) continue;
    CdrReader fields(message->data, message->size);
    Json record = Json::parse(fields.string(), nullptr, false);
    if (is_moment(record)) return record;
  }
  return std::nullopt;
}

void MomentCheck::observe(const ObservedMoment& observed) {
  // As it was written: what JSON cannot say is gone from both.
  const Json replayed = Json::parse(to_line(moment_record(observed.moment, observed.fused)));
  const std::string frames = frames_of(replayed);
  while (recorded_ && frames_of(*recorded_) != frames && time_of(*recorded_) <= time_of(replayed)) {
    ++unpaired_;
    recorded_ = next_record();
  }
  if (!recorded_ || frames_of(*recorded_) != frames) {
    ++unpaired_;
    return;
  }
  ++compared_;
  const std::string difference = first_difference(*recorded_, replayed);
  recorded_ = next_record();
  if (!difference.empty() && ++differing_ == 1) {
    first_ = fmt::format("{} at {} ns: {}", frames, time_of(replayed), difference);
  }
}

void MomentCheck::finish(const BothCounts&, std::ostream& people) {
  for (; recorded_; recorded_ = next_record()) ++unpaired_;
  if (differing_ == 0) {
    people << fmt::format("replay      {} moment{}, each equal to the recording bit for bit\n", compared_,
                          compared_ == 1 ? "" : "s");
  } else {
    people << fmt::format("replay      {} of {} moments differ; the first: {}\n", differing_, compared_, first_);
  }
  if (unpaired_ > 0) {
    people << fmt::format(
        "            {} are of other frames than any there: a frame that came too late for its partner finds it now, "
        "and one that was dropped does not\n",
        unpaired_);
  }
}

}  // namespace berth::cli
