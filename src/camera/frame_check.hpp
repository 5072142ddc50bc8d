#pragma once

#include <cstdint>

#include "berth/image.hpp"

namespace berth {

/// What a camera's time of a frame says.
enum class TimeVerdict {
  fine,
  again,  ///< The last frame's: that frame handed over twice.
  back,   ///< Before the last frame's.
  ahead,  ///< Later than it can be.
};

/// Whether a camera's times can be: they go on from frame to frame and are not ahead of their arrival. On a clock other
/// than the arrivals' "ahead" is more than 0.25 s beyond what any frame so far had to its arrival. A time of 0 is none,
/// and says nothing.
class TimeCheck {
 public:
  /// Frames in a row that run on beside the last good time are a clock that was set: the last of them is fine again. A
  /// time ahead of its arrival on the very same clock never is.
  static constexpr int kSetAfter = 3;

  TimeVerdict look(std::int64_t time_ns, std::int64_t arrival_ns, bool same_clock);
  /// The camera was opened again: its clock may have begun anew.
  void begin_anew() { *this = TimeCheck(); }

 private:
  TimeVerdict judge(std::int64_t time_ns, std::int64_t offset_ns, bool same_clock) const;

  bool has_last_ = false;
  std::int64_t last_ns_ = 0;
  std::int64_t least_offset_ns_ = 0;  // from a frame's time to its arrival
  int doubted_ = 0;                   // in a row, each later than the one before
  std::int64_t doubted_ns_ = 0;
};

/// Whether a camera hands over the same picture again. No sensor sees the same noise twice: to the last bit the same is
/// one that hangs, whatever its times say. A picture of one grey level (no light, too much of it) tells nothing.
class RepeatCheck {
 public:
  /// Whether it is the last picture looked at, by a 64-bit hash of all pixels.
  bool is_repeat(View2D<const u8> image);

 private:
  bool has_last_ = false;
  u64 last_ = 0;
};

}  // namespace berth
