#include "replay_check.hpp"

#include <fmt/format.h>

#include <string_view>

#include "berth/error.hpp"
#include "camera/recorded_frame.hpp"
#include "frame_record.hpp"
#include "marker_filters.hpp"
#include "recording/cdr_reader.hpp"

namespace berth::cli {

ReplayCheck::ReplayCheck(const std::string& path, bool depends) : reader_(path), depends_(depends) {}

void ReplayCheck::begin(const ObservedStream& stream) { config_ = stream.config; }

/// The next frame's record that can be read at all.
std::optional<Json> ReplayCheck::next_record() {
  has_picture_ = false;
  while (const mcap::Message* message = reader_.next()) {
    const auto channel = reader_.channels().find(message->channel);
    if (channel == reader_.channels().end()) continue;
    if (channel->second.topic.rfind(kImageTopic, 0) == 0) has_picture_ = true;
    if (channel->second.topic != kRecordTopic) continue;
    CdrReader fields(message->data, message->size);
    Json record = Json::parse(fields.string(), nullptr, false);
    if (record.is_object() && record.contains("frame")) return record;
  }
  return std::nullopt;
}

void ReplayCheck::observe(const ObservedFrame& frame) {
  std::optional<Json> record = next_record();
  // Records without a picture have no frame here.
  while (record && (*record)["frame"] != frame.result.stamp.sequence) {
    pass_over();
    record = next_record();
  }
  if (!record) throw Error(frame.label + ": the recording has no record of this frame; it is damaged");
  if (record->contains("missed")) {
    missed_ += (*record)["missed"].is_number_unsigned() ? (*record)["missed"].get<std::uint64_t>() : 1;
    gap_ = true;
  }
  if (gap_ && depends_) {
    ++behind_gap_;
    return;
  }
  ++compared_;
  const Json filtered = frame.filters != nullptr ? frame.filters->to_json() : Json();
  // As it was written: what JSON cannot say is gone from both.
  const Json replayed = Json::parse(to_line(frame_record(frame, config_, filtered)));
  const std::string difference = first_difference(*record, replayed);
  if (difference.empty()) return;
  if (++differing_ == 1)
    first_ = fmt::format("frame {} ({}): {}", frame.result.stamp.sequence, frame.label, difference);
}

void ReplayCheck::pass_over() {
  gap_ = true;
  without_picture_ += has_picture_ ? 0 : 1;
}

void ReplayCheck::finish(std::ostream& people) {
  while (next_record()) pass_over();
  if (differing_ == 0) {
    people << fmt::format("replay      {} frame{}, each equal to the recording bit for bit\n", compared_,
                          compared_ == 1 ? "" : "s");
  } else {
    people << fmt::format("replay      {} of {} frames differ; the first: {}\n", differing_, compared_, first_);
  }
  if (without_picture_ > 0) people << fmt::format("            {} more have no picture to replay\n", without_picture_);
  if (missed_ > 0) people << fmt::format("            {} were dropped while recording\n", missed_);
  if (behind_gap_ > 0) {
    people << fmt::format(
        "            {} follow a gap and were not compared: with --track or --filter a frame depends on those before "
        "it\n",
        behind_gap_);
  }
}

}  // namespace berth::cli
