#pragma once

#include <array>
#include <vector>

#include "survey/net.hpp"

namespace berth {

/// What a net's unknowns are known to, where the corners' covariances hold.
struct NetCovariance {
  /// Of each marker, as PoseUncertainty's: translation (m), then the turn about the marker's origin, about axes
  /// parallel to the net's (rad). 0 for the origin.
  std::vector<std::array<double, 36>> markers;
  /// Of each marker's size, m^2; 0 where it was not free.
  std::vector<double> sizes_m2;
};

/// Moves cameras and markers, and with `free_sizes` the sizes of all markers but the origin's, to where the squares of
/// the kept corners' residuals, in standard deviations, sum to least (Ceres). Above 0, `robust` is the distance in
/// standard deviations beyond which a corner counts less and less (Cauchy's loss). Sights that are not kept, and
/// stations that are not used, are left alone. Returns false where Ceres finds nothing usable; the net is unchanged
/// then.
bool adjust(SurveyNet& net, bool free_sizes, double robust);

/// From the normal equations at the net as it is. Returns false where they do not determine every marker.
bool net_covariance(const SurveyNet& net, bool free_sizes, NetCovariance& covariance);

}  // namespace berth
