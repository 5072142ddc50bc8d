#include "berth/disc_target.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "berth/error.hpp"
#include "exact_math.hpp"
#include "pose_algebra.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

// Of a ring's outer diameter: a smaller hole fills up with blur, a larger one leaves too thin a wall to tell its edges
// apart.
constexpr double kLeastHole = 0.35, kMostHole = 0.6;
// Light that must be left between two things, as a share of the smaller disc's diameter: a blurred image of it must
// still reach the plate's light.
constexpr double kGap = 0.25;
// Share of the layout's reach: what lies nearer to a line has no place across it, and what comes so near to itself when
// it is turned looks the same.
constexpr double kThin = 0.1, kSame = 0.05;
// Of two sizes that an image tells apart.
constexpr double kSameSize = 0.2;

Vec2 place(const TargetDisc& disc) { return {disc.x_m, disc.y_m}; }
Vec2 less(const Vec2& a, const Vec2& b) { return {a[0] - b[0], a[1] - b[1]}; }
double norm(const Vec2& a) { return std::sqrt(a[0] * a[0] + a[1] * a[1]); }

std::string to_a_micrometre(double length_m) {
  return shortest_decimal(static_cast<double>(floor_int(length_m * 1e6 + 0.5)) / 1e6);
}

Vec2 middle_of(const std::vector<TargetDisc>& discs) {
  Vec2 sum = {0, 0};
  for (const TargetDisc& disc : discs) sum = {sum[0] + disc.x_m, sum[1] + disc.y_m};
  return {sum[0] / static_cast<double>(discs.size()), sum[1] / static_cast<double>(discs.size())};
}

double reach_of(const std::vector<TargetDisc>& discs, const Vec2& middle) {
  double reach = 0;
  for (const TargetDisc& disc : discs) reach = std::max(reach, norm(less(place(disc), middle)));
  return reach;
}

/// Distance of a point from the segment that is a bar's middle line.
double distance_to(const TargetBar& bar, const Vec2& point) {
  const Vec2 along = less(bar.to_m, bar.from_m), off = less(point, bar.from_m);
  const double square = along[0] * along[0] + along[1] * along[1];
  const double s = std::min(1.0, std::max(0.0, (along[0] * off[0] + along[1] * off[1]) / square));
  return norm({off[0] - s * along[0], off[1] - s * along[1]});
}

/// The layout turned about its middle by the rotation (c, s).
struct Turn {
  Vec2 middle;
  double c, s;

  Vec2 at(const Vec2& point) const {
    const Vec2 off = less(point, middle);
    return {middle[0] + c * off[0] - s * off[1], middle[1] + s * off[0] + c * off[1]};
  }
};

bool alike(const TargetDisc& a, const TargetDisc& b) {
  return (a.hole_m > 0) == (b.hole_m > 0) && std::fabs(a.diameter_m - b.diameter_m) < kSameSize * a.diameter_m;
}

bool maps_to_itself(const DiscTarget& target, const Turn& turn, double tolerance_m) {
  const auto disc_there = [&](const TargetDisc& disc) {
    const Vec2 at = turn.at(place(disc));
    return std::any_of(target.discs.begin(), target.discs.end(), [&](const TargetDisc& other) {
      return alike(disc, other) && norm(less(place(other), at)) < tolerance_m;
    });
  };
  const auto bar_there = [&](const TargetBar& bar) {
    const Vec2 from = turn.at(bar.from_m), to = turn.at(bar.to_m);
    return std::any_of(target.bars.begin(), target.bars.end(), [&](const TargetBar& other) {
      const double limit = tolerance_m + other.width_m / 2;
      return distance_to(other, from) < limit && distance_to(other, to) < limit;
    });
  };
  return std::all_of(target.discs.begin(), target.discs.end(), disc_there) &&
         std::all_of(target.bars.begin(), target.bars.end(), bar_there);
}

void check_disc(const TargetDisc& disc, const std::string& which) {
  if (!finite(disc.x_m) || !finite(disc.y_m)) throw Error(which + " is not at a finite place; give metres");
  if (!(disc.diameter_m > 0 && finite(disc.diameter_m))) {
    throw Error(which + " has the diameter " + shortest_decimal(disc.diameter_m) + " m; give metres above 0");
  }
  const double share = disc.hole_m / disc.diameter_m;
  if (disc.hole_m != 0 && !(share >= kLeastHole && share <= kMostHole)) {
    throw Error(which + " has a hole of " + shortest_decimal(disc.hole_m) + " m in a diameter of " +
                shortest_decimal(disc.diameter_m) + " m; give 0.35 to 0.6 of the diameter, or 0 for a disc");
  }
}

void check_gaps(const DiscTarget& target, const std::string& name) {
  for (std::size_t i = 0; i < target.discs.size(); ++i) {
    const TargetDisc& a = target.discs[i];
    for (std::size_t j = 0; j < i; ++j) {
      const TargetDisc& b = target.discs[j];
      const double gap = norm(less(place(a), place(b))) - (a.diameter_m + b.diameter_m) / 2;
      if (gap >= kGap * std::min(a.diameter_m, b.diameter_m)) continue;
      throw Error(name + ": discs " + std::to_string(j) + " and " + std::to_string(i) + " have " +
                  to_a_micrometre(gap) + " m between them; leave a quarter of the smaller diameter");
    }
    for (const TargetBar& bar : target.bars) {
      const double gap = distance_to(bar, place(a)) - a.diameter_m / 2 - bar.width_m / 2;
      if (gap >= kGap * a.diameter_m) continue;
      throw Error(name + ": a bar comes within " + to_a_micrometre(gap) + " m of disc " + std::to_string(i) +
                  "; leave a quarter of the diameter");
    }
  }
}

void check_spread(const DiscTarget& target, const std::string& name, const Vec2& middle, double reach_m) {
  // The smaller spread of the centres, from their second moments.
  double xx = 0, xy = 0, yy = 0;
  for (const TargetDisc& disc : target.discs) {
    const Vec2 off = less(place(disc), middle);
    xx += off[0] * off[0];
    xy += off[0] * off[1];
    yy += off[1] * off[1];
  }
  const double half = (xx + yy) / 2;
  const double least = half - std::sqrt(std::max(0.0, (xx - yy) * (xx - yy) / 4 + xy * xy));
  if (!(least > kThin * kThin * reach_m * reach_m * static_cast<double>(target.discs.size()))) {
    throw Error(name + ": the discs stand nearly on one line, which tells no tilt about it; spread them");
  }
}

void check_turns(const DiscTarget& target, const std::string& name, const Vec2& middle, double reach_m) {
  // A turn that maps the layout to itself takes the outermost disc to one like it.
  std::size_t outermost = 0;
  for (std::size_t i = 1; i < target.discs.size(); ++i) {
    if (norm(less(place(target.discs[i]), middle)) > norm(less(place(target.discs[outermost]), middle))) outermost = i;
  }
  const Vec2 from = less(place(target.discs[outermost]), middle);
  for (std::size_t i = 0; i < target.discs.size(); ++i) {
    const Vec2 to = less(place(target.discs[i]), middle);
    if (i == outermost || !(norm(to) > (1 - kSame) * norm(from))) continue;
    const double scale = norm(from) * norm(to);
    const Turn turn{middle, (from[0] * to[0] + from[1] * to[1]) / scale, (from[0] * to[1] - from[1] * to[0]) / scale};
    if (maps_to_itself(target, turn, kSame * reach_m)) {
      throw Error(name + " looks the same when it is turned so that disc " + std::to_string(outermost) +
                  " comes to disc " + std::to_string(i) + "; make one disc a ring, or leave out an arm of its cross");
    }
  }
}

}  // namespace

void DiscTarget::check() const {
  const std::string which = "target \"" + name + "\"";
  if (discs.size() < kFewestDiscs || discs.size() > kMostDiscs) {
    throw Error(which + " has " + std::to_string(discs.size()) + " discs; give " + std::to_string(kFewestDiscs) +
                " to " + std::to_string(kMostDiscs));
  }
  if (!(deviation_m >= 0 && finite(deviation_m))) {
    throw Error(which + " has the deviation " + shortest_decimal(deviation_m) + " m; give metres, 0 or above");
  }
  for (std::size_t i = 0; i < discs.size(); ++i) check_disc(discs[i], which + ": disc " + std::to_string(i));
  for (const TargetBar& bar : bars) {
    const double length_m = norm(less(bar.to_m, bar.from_m));
    if (!(bar.width_m > 0 && finite(bar.width_m) && finite(length_m) && length_m > bar.width_m)) {
      throw Error(which + " has a bar " + shortest_decimal(bar.width_m) + " m wide and " + shortest_decimal(length_m) +
                  " m long; give a width above 0 and a greater length");
    }
  }
  const Vec2 middle = middle_of(discs);
  const double reach_m = reach_of(discs, middle);
  check_spread(*this, which, middle, reach_m);
  check_gaps(*this, which);
  check_turns(*this, which, middle, reach_m);
}

}  // namespace berth
