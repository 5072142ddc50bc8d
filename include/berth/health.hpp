#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "berth/types.hpp"

namespace berth {

class Backend;

/// What a stream's results are worth, best first.
enum class HealthMode {
  nominal,
  /// A list was full; what is reported holds, more may have been there.
  overflow,
  /// A backend failed, and the next one carries on.
  fallback,
  /// No result for longer than the time-out: what was said last must not be acted on.
  stale,
  /// No backend is left that gives right answers: no frame has a result.
  failed,
};
const char* name_of(HealthMode mode);
/// A sentence for people: "a backend failed; another carries on, with the same bits".
const char* text_of(HealthMode mode);

/// How a backend that was left is got back: on a thread of its own it is opened anew and asked, and between two frames
/// it takes over again.
struct RecoveryConfig {
  /// Opens the backend of that number in the chain anew; throws Error where it cannot be had.
  std::function<std::unique_ptr<Backend>(std::size_t)> open;
  /// From the loss to the first try; each wait of a backend is twice the one before it, up to the longest.
  std::int64_t first_wait_ns = 1'000'000'000, longest_wait_ns = 60'000'000'000;
  /// Before it is believed, all that frames run on gives so many right answers in a row.
  int right_answers = 5;
  /// One that took over again so often, and was left again, is given up.
  int most_returns = 3;
};

/// How a detector or a pipeline looks after itself.
struct HealthConfig {
  /// A picture with a known answer is run at start on every backend, then between frames as often as this; 0: only at
  /// start.
  std::int64_t known_answer_every_ns = 10'000'000'000;
  /// Of the memory that nobody writes, so much is checked before each frame, in 4 KiB at least; 0 for none.
  std::size_t scrub_bytes = 8192;
  /// None: what was left once stays so.
  std::optional<RecoveryConfig> recovery;
};

/// What came of it so far.
struct HealthReport {
  /// nominal, fallback or failed.
  HealthMode mode = HealthMode::nominal;
  /// Why a backend was left last: "its device was lost", "its device hangs", "a wrong known answer", or the memory that
  /// was altered, such as "code book"; empty where none was.
  const char* reason = "";
  u64 known_answers = 0, wrong_answers = 0;
  /// Memory under watch, bytes checked since the start, and alterations found.
  std::size_t watched_bytes = 0;
  u64 checked_bytes = 0, alterations = 0;
  /// How often a backend that was left was opened anew, or could not be, and how often one took over again.
  u64 tries = 0, returns = 0;
  /// "trying" while a backend that was left is waited for, "given up" once one was left too often; else empty.
  const char* recovery = "";
};

}  // namespace berth
