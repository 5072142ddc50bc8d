#pragma once

#include <array>
#include <string>
#include <vector>

#include "berth/marker.hpp"
#include "frame_observer.hpp"

namespace berth::cli {

/// A pose as people read it: x, y, z in metres, then degrees about the camera's x, y and z axes, turned in that order
/// (R = Rz · Ry · Rx); and one standard deviation of each, NaN where it is not known.
struct SixAxes {
  std::array<double, 6> value = {}, deviation = {};
};

/// `covariance` as PoseUncertainty's, or null.
SixAxes six_axes(const Pose& pose, const std::array<double, 36>* covariance);

/// What a page shows of one object in one frame.
struct WebSample {
  /// Since the page's clock began: when the frame was done.
  double time_s = 0;
  /// Its place in WebSampler::objects.
  int object = 0;
  SixAxes axes;
  double range_m = 0, range_deviation_m = 0;
  /// How fast the range shrinks; NaN while it is not known.
  double closing_m_s = 0, closing_deviation_m_s = 0;
  double error_px = 0, ambiguity = 0;
};

/// A marker, a bundle or a target of discs that has had a pose.
struct WebObject {
  std::string name;
  /// "marker", "bundle" or "target".
  const char* kind = "";
  /// Of its square, where it has one; else about its size.
  double size_m = 0;
};

/// Poses of frames as samples. Closing speed is the filter's where one runs, else the slope of the ranges over the last
/// half second by the camera's clock, which takes five frames.
class WebSampler {
 public:
  /// Objects beyond so many are counted, not shown.
  static constexpr std::size_t kMost = 24;

  WebSampler();
  void begin(const ObservedStream& stream);
  /// One for each pose of the frame, bundles and targets before markers. Valid until the next call.
  const std::vector<WebSample>& take(const ObservedFrame& frame, double time_s);
  /// In order of their first appearance.
  const std::vector<WebObject>& objects() const { return objects_; }
  u64 beyond() const { return beyond_; }

 private:
  /// Ranges of the last half second.
  class Slope {
   public:
    void add(double time_s, double range_m);
    /// m/s and its deviation; false while there are too few.
    bool closing(double& speed, double& deviation) const;

   private:
    static constexpr std::size_t kMost = 64;
    std::array<std::array<double, 2>, kMost> points_ = {};
    std::size_t first_ = 0, count_ = 0;
  };
  int object(const char* kind, const std::string& name, double size_m);
  void add(const ObservedFrame& frame, double time_s, int object, const Pose& pose, const PoseUncertainty* uncertainty,
           const FilteredPose* filtered);

  std::vector<Bundle> bundles_;
  std::vector<DiscTarget> targets_;
  double marker_size_m_ = 0;
  std::vector<WebObject> objects_;
  std::vector<Slope> slopes_;
  std::vector<WebSample> samples_;
  std::string name_;
  u64 beyond_ = 0;
};

}  // namespace berth::cli
