#pragma once

#include <chrono>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace berth::cli {

/// What a stream is doing, for a person: a block redrawn in place on a terminal, else a plain line now and then.
class LiveView {
 public:
  /// `total` frames where known, for the time left.
  LiveView(std::ostream& out, bool terminal, std::optional<std::size_t> total);

  /// Shows the state after `done` frames: the progress and `line`, with `table` below on a terminal, at most some ten
  /// times a second. Elsewhere one line that ends in `brief`, twenty times in all or every five seconds.
  void show(std::size_t done, const std::string& line, const std::vector<std::string>& table, const std::string& brief);
  /// Leaves the block standing; what is written to the stream next starts on a line of its own.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  std::string progress(std::size_t done) const;

  std::ostream& out_;
  bool terminal_;
  std::optional<std::size_t> total_;
  std::size_t plain_every_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point shown_ = {};
  std::size_t lines_ = 0;
};

}  // namespace berth::cli
