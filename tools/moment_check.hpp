#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "frame_json.hpp"
#include "moment_observer.hpp"
#include "recording/mcap_reader.hpp"

namespace berth::cli {

/// Compares every moment of two stations with what a recording says it came to.
class MomentCheck final : public MomentObserver {
 public:
  /// Of `berth stations`. Throws Error.
  explicit MomentCheck(const std::string& path);

  void observe(const ObservedMoment& observed) override;
  /// The verdict, for people.
  void finish(const BothCounts& counts, std::ostream& people) override;

  /// Whether every moment was there, and equal bit for bit.
  bool is_equal() const { return compared_ > 0 && differing_ == 0 && unpaired_ == 0; }

 private:
  std::optional<Json> next_record();

  mcap::Reader reader_;
  std::optional<Json> recorded_;  // that was not passed yet
  std::uint64_t compared_ = 0, differing_ = 0;
  /// Moments of other frames than any of the recording, and the other way round.
  std::uint64_t unpaired_ = 0;
  std::string first_;
};

}  // namespace berth::cli
