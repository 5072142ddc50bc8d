#include "navigation/track.hpp"

#include <algorithm>

namespace berth {

void Track::begin(const Reading& reading) {
  alive_ = true;
  believed_ = false;
  place_ = reading.place;
  step_x_q16_ = step_y_q16_ = 0;
  missed_ = 0;
  evidence_q8_ = 0;
  add(reading.logit_q8);
}

void Track::believe(const Place& place) {
  alive_ = believed_ = true;
  place_ = place;
  step_x_q16_ = step_y_q16_ = 0;
  missed_ = 0;
  evidence_q8_ = rules_.believed_q8;
}

void Track::see(const Reading& reading) {
  // Half of what was, half of what is: the network's centre is off by some hundredths of d.
  step_x_q16_ = (step_x_q16_ + (reading.place.x_q16 - place_.x_q16) / (missed_ + 1)) / 2;
  step_y_q16_ = (step_y_q16_ + (reading.place.y_q16 - place_.y_q16) / (missed_ + 1)) / 2;
  place_ = reading.place;
  missed_ = 0;
  add(reading.logit_q8);
}

void Track::miss() {
  ++missed_;
  if (!believed_ || missed_ >= rules_.memory_frames) alive_ = false;
}

void Track::add(int logit_q8) {
  evidence_q8_ = std::min(evidence_q8_ + std::min(logit_q8 - rules_.doubt_q8, rules_.most_q8), rules_.believed_q8);
  if (evidence_q8_ >= rules_.believed_q8) believed_ = true;
  if (evidence_q8_ < 0 && !believed_) alive_ = false;
}

Place Track::expected() const {
  return {place_.x_q16 + step_x_q16_ * (missed_ + 1), place_.y_q16 + step_y_q16_ * (missed_ + 1), place_.d_q16};
}

bool Track::fits(const Place& place, bool sure) const {
  // Within its radius, and no more than half as large again; further off for each frame that it was not seen in.
  const std::int64_t reach = ((place_.d_q16 / 2 + place_.d_q16 * missed_ / 4) >> 8) * (sure ? 3 : 1);
  const Place there = expected();
  const std::int64_t dx = (place.x_q16 - there.x_q16) >> 8;  // squares stay within 64 bits
  const std::int64_t dy = (place.y_q16 - there.y_q16) >> 8;
  return dx * dx + dy * dy < reach * reach && 2 * place.d_q16 < 3 * place_.d_q16 && 3 * place.d_q16 > 2 * place_.d_q16;
}

bool agreed(const Track& track, const std::vector<Reading>& readings, int misfit_q8, Reading& reading) {
  const int all = static_cast<int>(readings.size());
  int fits = 0;
  int logits = 0;
  Place sum;
  for (const Reading& one : readings) {
    if (!track.fits(one.place)) {
      logits += std::min(one.logit_q8, misfit_q8);
      continue;
    }
    ++fits;
    logits += one.logit_q8;
    sum.x_q16 += one.place.x_q16;
    sum.y_q16 += one.place.y_q16;
    sum.d_q16 += one.place.d_q16;
  }
  if (2 * fits < all) return false;
  reading = {logits / all, {sum.x_q16 / fits, sum.y_q16 / fits, sum.d_q16 / fits}};
  return true;
}

}  // namespace berth
