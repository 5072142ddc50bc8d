#pragma once

#include <array>
#include <optional>

#include "berth/source.hpp"
#include "sim/scene.hpp"
#include "table/pose_error.hpp"

namespace berth::table {

/// What an image can tell of a marker's four corners: Fisher's information of their coordinates, x and y of each in the
/// paper's order, px⁻².
using CornerInformation = std::array<double, 64>;

/// Of the scene's first marker, wholly in view and covered by nothing. An estimator knows the pattern and the lens, and
/// has to find levels of dark and light (planes in the marker) and the blur besides; it sees all pixels of the pattern
/// and its light ring. Gaussian blur, straight tone curve, even light; shot and read noise, and the rounding to
/// integers. Written apart from the engine: doubles and libm's erfc.
CornerInformation corner_information(const sim::Scene& scene);

/// Cramér-Rao bound: the smallest RMS distance of a corner from its true place, px, of any unbiased estimator; none
/// where the image does not tell the corners.
std::optional<double> corner_bound_px(const CornerInformation& information);

/// The bound of each axis of the marker's pose from that image alone, as standard deviations (m, rad; as pose_error
/// has them): the information carried through the derivative of the corners by the pose.
std::optional<SixAxes> pose_bound(const CameraModel& camera, const TruthMarker& marker,
                                  const CornerInformation& information);

}  // namespace berth::table
