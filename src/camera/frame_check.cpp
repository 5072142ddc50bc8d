#include "camera/frame_check.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace berth {
namespace {

constexpr std::int64_t kSameClockSlackNs = 1'000'000, kOtherClockSlackNs = 250'000'000;

/// Four lanes of FNV's multiplication over words of eight bytes: a picture of 640 x 480 in some 20 us.
u64 hash_of(View2D<const u8> image) {
  constexpr u64 kPrime = 0x100000001b3u, kStart = 0xcbf29ce484222325u;
  std::array<u64, 4> lanes = {kStart, kStart + 1, kStart + 2, kStart + 3};
  for (int y = 0; y < image.height; ++y) {
    const u8* const row = image.row(y);
    const auto width = static_cast<std::size_t>(image.width);
    std::size_t x = 0;
    for (; x + 32 <= width; x += 32) {
      for (std::size_t i = 0; i < 4; ++i) {
        u64 word = 0;
        std::memcpy(&word, row + x + 8 * i, 8);
        lanes[i] = (lanes[i] ^ word) * kPrime;
        // A product's high bits depend on all below them, its low ones on none above: they change places.
        lanes[i] = lanes[i] << 29 | lanes[i] >> 35;
      }
    }
    for (; x < width; ++x) lanes[0] = (lanes[0] ^ row[x]) * kPrime;
  }
  u64 all = kStart;
  for (const u64 lane : lanes) {
    all = (all ^ lane) * kPrime;
    all ^= all >> 32;
  }
  return all;
}

bool is_flat(View2D<const u8> image) {
  const u8 first = image.at(0, 0);
  for (int y = 0; y < image.height; ++y) {
    const u8* const row = image.row(y);
    if (!std::all_of(row, row + image.width, [&](u8 pixel) { return pixel == first; })) return false;
  }
  return true;
}

}  // namespace

TimeVerdict TimeCheck::judge(std::int64_t time_ns, std::int64_t offset_ns, bool same_clock) const {
  if (same_clock && offset_ns < -kSameClockSlackNs) return TimeVerdict::ahead;
  if (!has_last_) return TimeVerdict::fine;
  if (time_ns == last_ns_) return TimeVerdict::again;
  if (time_ns < last_ns_) return TimeVerdict::back;
  if (!same_clock && offset_ns < least_offset_ns_ - kOtherClockSlackNs) return TimeVerdict::ahead;
  return TimeVerdict::fine;
}

TimeVerdict TimeCheck::look(std::int64_t time_ns, std::int64_t arrival_ns, bool same_clock) {
  if (time_ns == 0) return TimeVerdict::fine;
  const std::int64_t offset_ns = arrival_ns - time_ns;
  const TimeVerdict verdict = judge(time_ns, offset_ns, same_clock);
  const bool impossible = verdict == TimeVerdict::ahead && same_clock;
  if (verdict == TimeVerdict::again || impossible) return verdict;
  bool was_set = false;
  if (verdict != TimeVerdict::fine) {
    doubted_ = doubted_ > 0 && time_ns > doubted_ns_ ? doubted_ + 1 : 1;
    doubted_ns_ = time_ns;
    was_set = doubted_ == kSetAfter;
    if (!was_set) return verdict;
  }
  doubted_ = 0;
  least_offset_ns_ = has_last_ && !was_set ? std::min(least_offset_ns_, offset_ns) : offset_ns;
  last_ns_ = time_ns;
  has_last_ = true;
  return TimeVerdict::fine;
}

bool RepeatCheck::is_repeat(View2D<const u8> image) {
  const u64 hash = hash_of(image);
  const bool is_same = has_last_ && hash == last_;
  last_ = hash;
  has_last_ = true;
  return is_same && !is_flat(image);
}

}  // namespace berth
