#pragma once

#include <cstddef>
#include <cstdint>

#include "berth/types.hpp"

namespace berth {

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

/// How a detector or a pipeline looks after itself.
struct HealthConfig {
  /// A picture with a known answer is run at start on every backend, then between frames as often as this; 0: only at
  /// start.
  std::int64_t known_answer_every_ns = 10'000'000'000;
  /// Of the memory that nobody writes, so much is checked before each frame, in 4 KiB at least; 0 for none.
  std::size_t scrub_bytes = 8192;
};

/// What came of it so far.
struct HealthReport {
  /// nominal, fallback or failed.
  HealthMode mode = HealthMode::nominal;
  /// Why a backend was left last: "its device was lost", "a wrong known answer", or the memory that was altered, such
  /// as "code book"; empty where none was.
  const char* reason = "";
  u64 known_answers = 0, wrong_answers = 0;
  /// Memory under watch, bytes checked since the start, and alterations found.
  std::size_t watched_bytes = 0;
  u64 checked_bytes = 0, alterations = 0;
};

}  // namespace berth
