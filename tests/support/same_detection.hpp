#pragma once

#include <tuple>

#include "berth/marker.hpp"

namespace berth::test {

/// Every bit of two detections: code, corners, what is known of them, pose.
inline bool same_bits(const Detection& a, const Detection& b) {
  const auto code = [](const Detection& d) { return std::make_tuple(d.family, d.id, d.hamming, d.margin, d.search); };
  if (code(a) != code(b) || a.corners != b.corners || a.center != b.center ||
      a.corner_covariance_px2 != b.corner_covariance_px2) {
    return false;
  }
  if (a.corner_fit.has_value() != b.corner_fit.has_value() || a.has_pose != b.has_pose) return false;
  if (a.corner_fit) {
    const CornerFit &p = *a.corner_fit, &q = *b.corner_fit;
    if (p.noise != q.noise || p.blur_px2 != q.blur_px2 || p.local_levels != q.local_levels) return false;
  }
  if (a.has_pose && (a.pose.R != b.pose.R || a.pose.t != b.pose.t)) return false;
  if (a.pose_uncertainty.has_value() != b.pose_uncertainty.has_value()) return false;
  if (!a.pose_uncertainty) return true;
  const PoseUncertainty &p = *a.pose_uncertainty, &q = *b.pose_uncertainty;
  return p.covariance == q.covariance && p.error_px == q.error_px && p.chi_square == q.chi_square &&
         p.has_other == q.has_other && p.other.R == q.other.R && p.other.t == q.other.t &&
         p.other_covariance == q.other_covariance && p.other_excess == q.other_excess;
}

}  // namespace berth::test
