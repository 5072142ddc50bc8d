#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "frame_json.hpp"
#include "frame_observer.hpp"
#include "recording/mcap_reader.hpp"

namespace berth::cli {

/// Compares every frame of a replay with what the recording says it came to. Reads the recording a second time, beside
/// the source that reads its pictures.
class ReplayCheck final : public FrameObserver {
 public:
  /// `depends`: what a frame comes to depends on those before it (`--track`, `--filter`).
  ReplayCheck(const std::string& path, bool depends);

  void begin(const ObservedStream& stream) override;
  void observe(const ObservedFrame& frame) override;
  /// The verdict, for people.
  void finish(std::ostream& people) override;

  std::uint64_t compared() const { return compared_; }
  std::uint64_t differing() const { return differing_; }
  /// Frames without a picture, and frames behind a gap that they depend on.
  std::uint64_t not_compared() const { return without_picture_ + behind_gap_; }

 private:
  std::optional<Json> next_record();
  void pass_over();

  mcap::Reader reader_;
  bool depends_;
  DetectorConfig config_;
  bool has_picture_ = false;  // the record read last
  bool gap_ = false;
  std::uint64_t compared_ = 0, differing_ = 0, without_picture_ = 0, behind_gap_ = 0, missed_ = 0;
  std::string first_;
};

}  // namespace berth::cli
