#include "target/disc_choice.hpp"

namespace berth {
namespace {

// Squares of standard deviations by which the better of two ways must be better.
constexpr double kDoubt = 30;

bool contradict(const DiscAssignment& a, const DiscAssignment& b) {
  for (std::size_t k = 0; k < a.size(); ++k) {
    for (std::size_t l = 0; l < b.size(); ++l) {
      if (k != l && a[k] != kNoDisc && a[k] == b[l]) return true;
    }
  }
  return false;
}

}  // namespace

bool DiscChoice::offer(const DiscAssignment& assignment, int used, double chi_square) {
  if (count_ == kMost) return false;
  const Way& best = ways_[best_];
  const bool better = count_ == 0 || used > best.used || (used == best.used && chi_square < best.chi_square);
  ways_[count_] = {assignment, used, chi_square};
  if (better) best_ = count_;
  ++count_;
  return better;
}

bool DiscChoice::is_doubtful() const {
  const Way& best = ways_[best_];
  for (std::size_t i = 0; i < count_; ++i) {
    const Way& way = ways_[i];
    if (i != best_ && way.used == best.used && way.chi_square - best.chi_square < kDoubt &&
        contradict(way.assignment, best.assignment)) {
      return true;
    }
  }
  return false;
}

}  // namespace berth
