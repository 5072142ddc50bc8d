#pragma once

#include <ostream>

#include "live_view.hpp"
#include "moment_counts.hpp"
#include "moment_observer.hpp"

namespace berth::cli {

/// What the moments come to, for people: a line now and then, and a sum.
class MomentLines final : public MomentObserver {
 public:
  explicit MomentLines(std::ostream& people);

  void observe(const ObservedMoment& observed) override;
  void finish(const BothCounts& counts, std::ostream& people) override;

 private:
  LiveView view_;
  MomentCounts sum_;
};

}  // namespace berth::cli
