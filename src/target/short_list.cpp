#include "target/short_list.hpp"

#include <algorithm>

namespace berth {
namespace {

// Words that are looked through one by one: some ten microseconds' worth.
constexpr std::size_t kMaxScan = 20000;
constexpr std::size_t kWeakCells = 8;

// Sums the levels with the signs of a word's bits, eight bits at a look-up.
class Agreement {
 public:
  Agreement(const std::array<double, kMaxCells>& levels, std::size_t n, double full_level) : bytes_((n + 7) / 8) {
    for (std::size_t byte = 0; byte < bytes_; ++byte) {
      std::array<s32, 256>& table = table_[byte];
      s32 level[8];
      table[0] = 0;
      for (std::size_t k = 0; k < 8; ++k) {
        const std::size_t i = 8 * byte + k;
        // One glaring cell must not outvote the others.
        const double limited = i < n ? std::min(1.5, std::max(-1.5, levels[i] / full_level)) : 0.0;
        level[k] = static_cast<s32>(limited * 4096);
        table[0] -= level[k];
      }
      for (std::size_t k = 0; k < 8; ++k) {
        const std::size_t half = std::size_t{1} << k;
        for (std::size_t v = 0; v < half; ++v) table[half + v] = table[v] + 2 * level[k];
      }
    }
  }

  s32 with(u64 word) const {
    s32 sum = 0;
    for (std::size_t byte = 0; byte < bytes_; ++byte) sum += table_[byte][(word >> (8 * byte)) & 255];
    return sum;
  }

 private:
  std::size_t bytes_;
  std::array<std::array<s32, 256>, kMaxCells / 8> table_;
};

// Keeps the best by agreement, then by place in the book.
class Keeper {
 public:
  explicit Keeper(ShortList& list) : list_(list) {}

  s32 least() const { return list_.size == ShortList::kSize ? score_[ShortList::kSize - 1] : INT32_MIN; }

  void offer(int entry, s32 score) {
    for (int i = 0; i < list_.size; ++i) {
      if (list_.entry[i] == entry) return;
    }
    const auto before = [&](int i) { return score_[i] > score || (score_[i] == score && list_.entry[i] < entry); };
    if (list_.size == ShortList::kSize && before(ShortList::kSize - 1)) return;
    int at = list_.size < ShortList::kSize ? list_.size++ : ShortList::kSize - 1;
    for (; at > 0 && !before(at - 1); --at) {
      score_[at] = score_[at - 1];
      list_.entry[at] = list_.entry[at - 1];
    }
    score_[at] = score;
    list_.entry[at] = entry;
  }

 private:
  ShortList& list_;
  std::array<s32, ShortList::kSize> score_;
};

}  // namespace

ShortList likely_words(const CodeBook& book, const std::array<double, kMaxCells>& levels, double full_level) {
  const std::size_t n = static_cast<std::size_t>(book.bits());
  const Agreement agreement(levels, n, full_level);
  const std::vector<u64>& words = book.words();
  ShortList list;
  Keeper keeper(list);
  if (words.size() <= kMaxScan) {
    for (std::size_t e = 0; e < words.size(); ++e) {
      const s32 score = agreement.with(words[e]);
      if (score > keeper.least()) keeper.offer(static_cast<int>(e), score);
    }
    return list;
  }

  std::array<std::size_t, kMaxCells> order;
  for (std::size_t i = 0; i < n; ++i) order[i] = i;
  const auto strength = [&](std::size_t i) { return levels[i] < 0 ? -levels[i] : levels[i]; };
  std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(n), [&](std::size_t a, std::size_t b) {
    return strength(a) != strength(b) ? strength(a) < strength(b) : a < b;
  });
  u64 word = 0;
  for (std::size_t i = 0; i < n; ++i) word |= static_cast<u64>(levels[i] > 0) << i;
  for (unsigned k = 0; k < (1u << kWeakCells); ++k) {
    // Gray code: every step turns over one cell.
    if (k > 0) {
      std::size_t cell = 0;
      while (((k >> cell) & 1) == 0) ++cell;
      word ^= u64{1} << order[cell];
    }
    const CodeBook::Match match = book.find(word);
    if (match.entry >= 0) keeper.offer(match.entry, agreement.with(words[static_cast<std::size_t>(match.entry)]));
  }
  return list;
}

}  // namespace berth
