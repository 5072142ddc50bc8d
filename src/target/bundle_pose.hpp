#pragma once

#include <cstddef>
#include <vector>

#include "berth/bundle.hpp"
#include "target/refine_pose.hpp"

namespace berth {

/// The pose of one bundle, frame by frame, from its markers' corners: least squares over all of them, without those
/// that do not fit (docs/bundles.md). Doubles of + − × ÷ √ in a fixed order: the same bits on every machine. All memory
/// is taken in the constructor.
class BundlePoser {
 public:
  /// Of a marker read more often than this in one frame the first ones count, the others are kept out.
  static constexpr int kMostSightings = 2;
  /// Squares beyond which a corner does not fit: chi-square of two degrees of freedom, one in a million.
  static constexpr double kBound = 27.63;

  /// Throws Error where Bundle::check does.
  explicit BundlePoser(const Bundle& bundle);

  const Bundle& bundle() const { return bundle_; }

  /// `detections` are a frame's; those of the bundle's markers have their own poses, by the sizes that they have here.
  /// `corner_deviation_px` is for corners without covariances. No pose comes of a frame where no marker has one.
  void find(const CameraModel& camera, const std::vector<Detection>& detections, double corner_deviation_px,
            BundlePose& result);

 private:
  struct Sighting {
    const BundleMarker* marker = nullptr;
    const Detection* detection = nullptr;
    /// Of its sides, px^2: the larger a marker is seen, the surer its own pose.
    double sides_px2 = 0;
    /// Of its corners, with what its place adds.
    CornerCovariance covariance_px2 = {};
  };

  int gather(const std::vector<Detection>& detections, double corner_deviation_px);
  void add_sighting(const BundleMarker& marker, const Detection& detection, double corner_deviation_px);
  Pose centred(const Pose& marker_pose, const BundleMarker& marker) const;
  bool best_start(const CameraModel& camera, Pose& start, std::size_t& from);
  double evaluate(const CameraModel& camera, const Pose& pose);
  double limit();
  bool take_within(double bound);
  bool keep_markers_whole();
  bool fit(const CameraModel& camera, const Pose& start, RefinedPose& result, double soft_bound = 0);
  bool solve(const CameraModel& camera, const Pose& start, std::size_t from, RefinedPose& result);
  bool solve_robustly(const CameraModel& camera, const Pose& start, RefinedPose& result);
  bool mirrored(const Pose& pose, Pose& start) const;
  bool other_of(const CameraModel& camera, const RefinedPose& found, RefinedPose& other);
  void report(const RefinedPose& found, const RefinedPose* other, BundlePose& result) const;
  RefinedPose from_origin(const RefinedPose& pose) const;

  Bundle bundle_;
  std::vector<Sighting> sightings_;
  /// Four of each sighting, in the bundle's frame, moved by `centre_`; how far they are off at the pose last evaluated,
  /// squares of standard deviations; and whether they go into the pose.
  std::vector<PoseCorner> corners_;
  std::vector<double> squares_;
  std::vector<unsigned char> in_;
  /// Room for the markers that go into a fit, with the corners that do, and for the squares in order.
  std::vector<SeenCorners> fitted_;
  std::vector<double> sorted_;
  std::vector<std::size_t> largest_;
  /// Middle of the markers seen. Turns about it and shifts do not depend on each other much; about a field's corner,
  /// metres away, they would.
  std::array<double, 3> centre_ = {};
};

}  // namespace berth
