#include "web_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "marker_filters.hpp"
#include "truth_score.hpp"

namespace berth::cli {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 57.295779513082323;
/// Of the slope of ranges: how far back it looks, how close two of its points may lie and how many it takes.
constexpr double kSlopeS = 0.5, kSlopeStepS = 0.01;
constexpr std::size_t kSlopeFewest = 5;

using Vector = std::array<double, 3>;

double dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Of `v` transposed times the 3 × 3 block of a row-major 6 × 6 that starts at (`at`, `at`) times `v`.
double variance(const std::array<double, 36>& covariance, int at, const Vector& v) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) sum += v[i] * covariance[6 * (at + i) + at + k] * v[k];
  }
  return sum;
}

double deviation(double variance) { return variance >= 0 ? std::sqrt(variance) : kUnknown; }

}  // namespace

SixAxes six_axes(const Pose& pose, const std::array<double, 36>* covariance) {
  SixAxes axes;
  const std::array<double, 9>& R = pose.R;
  const double cosine = std::hypot(R[0], R[3]);
  const double a = std::atan2(R[7], R[8]), b = std::atan2(-R[6], cosine), c = std::atan2(R[3], R[0]);
  axes.value = {pose.t[0], pose.t[1], pose.t[2], a * kDegrees, b * kDegrees, c * kDegrees};
  axes.deviation.fill(kUnknown);
  if (covariance == nullptr) return axes;
  for (int i = 0; i < 3; ++i) axes.deviation[i] = deviation((*covariance)[7 * i]);
  // A small turn w about the camera's axes is da about Rz Ry x, db about Rz y and dc about z: the rows of the inverse
  // of that matrix take w to them. At b = ±90° the first and the last are one axis.
  if (cosine < 1e-3) return axes;
  const Vector about_a = {R[0], R[3], R[6]}, about_b = {-std::sin(c), std::cos(c), 0}, about_c = {0, 0, 1};
  const std::array<Vector, 3> rows = {cross(about_b, about_c), cross(about_c, about_a), cross(about_a, about_b)};
  const double determinant = dot(about_a, rows[0]);
  for (int i = 0; i < 3; ++i) {
    axes.deviation[3 + i] = deviation(variance(*covariance, 3, rows[i])) / std::abs(determinant) * kDegrees;
  }
  return axes;
}

void WebSampler::Slope::add(double time_s, double range_m) {
  const auto at = [&](std::size_t i) -> std::array<double, 2>& { return points_[(first_ + i) % kMost]; };
  if (count_ > 0 && time_s < at(count_ - 1)[0]) count_ = 0;  // played round, or begun anew
  while (count_ > 0 && time_s - at(0)[0] > kSlopeS) {
    first_ = (first_ + 1) % kMost;
    --count_;
  }
  if (count_ == kMost || (count_ > 0 && time_s - at(count_ - 1)[0] < kSlopeStepS)) return;
  at(count_++) = {time_s, range_m};
}

bool WebSampler::Slope::closing(double& speed, double& deviation_of_it) const {
  if (count_ < kSlopeFewest) return false;
  const auto at = [&](std::size_t i) { return points_[(first_ + i) % kMost]; };
  const double n = static_cast<double>(count_);
  double mean_t = 0, mean_r = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    mean_t += (at(i)[0] - at(0)[0]) / n;
    mean_r += at(i)[1] / n;
  }
  double tt = 0, tr = 0, rr = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const double t = at(i)[0] - at(0)[0] - mean_t, r = at(i)[1] - mean_r;
    tt += t * t;
    tr += t * r;
    rr += r * r;
  }
  if (!(tt > 0)) return false;
  speed = -tr / tt;
  deviation_of_it = std::sqrt(std::max(0.0, rr - tr * tr / tt) / (n - 2) / tt);
  return true;
}

WebSampler::WebSampler() {
  objects_.reserve(kMost);
  slopes_.reserve(kMost);
  samples_.reserve(kMost);
}

void WebSampler::begin(const ObservedStream& stream) {
  bundles_ = stream.config.bundles;
  targets_ = stream.config.disc_targets;
  marker_size_m_ = stream.config.marker_size_m;
}

int WebSampler::object(const char* kind, const std::string& name, double size_m) {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    if (objects_[i].kind == kind && objects_[i].name == name) return static_cast<int>(i);
  }
  if (objects_.size() == kMost) {
    ++beyond_;
    return -1;
  }
  objects_.push_back({name, kind, size_m});
  slopes_.emplace_back();
  return static_cast<int>(objects_.size()) - 1;
}

void WebSampler::add(const ObservedFrame& frame, double time_s, int object, const Pose& pose,
                     const PoseUncertainty* uncertainty, const FilteredPose* filtered) {
  if (object < 0) return;
  WebSample sample;
  sample.time_s = time_s;
  sample.object = object;
  sample.axes = six_axes(pose, uncertainty != nullptr ? &uncertainty->covariance : nullptr);
  sample.range_m = std::sqrt(dot(pose.t, pose.t));
  Vector towards = {0, 0, 1};
  if (sample.range_m > 0)
    towards = {pose.t[0] / sample.range_m, pose.t[1] / sample.range_m, pose.t[2] / sample.range_m};
  sample.range_deviation_m =
      uncertainty != nullptr ? deviation(variance(uncertainty->covariance, 0, towards)) : kUnknown;
  sample.closing_m_s = sample.closing_deviation_m_s = kUnknown;
  if (filtered != nullptr) {
    sample.closing_m_s = -dot(towards, {filtered->velocity[0], filtered->velocity[1], filtered->velocity[2]});
    sample.closing_deviation_m_s = deviation(variance(filtered->velocity_covariance, 0, towards));
  } else if (std::string_view(frame.result.stamp.clock) != "none") {
    Slope& slope = slopes_[static_cast<std::size_t>(object)];
    slope.add(static_cast<double>(frame.result.stamp.mid_exposure_ns) / 1e9, sample.range_m);
    slope.closing(sample.closing_m_s, sample.closing_deviation_m_s);
  }
  sample.error_px = uncertainty != nullptr ? uncertainty->error_px : kUnknown;
  sample.ambiguity = uncertainty != nullptr ? uncertainty->ambiguity() : 0;
  samples_.push_back(sample);
}

const std::vector<WebSample>& WebSampler::take(const ObservedFrame& frame, double time_s) {
  samples_.clear();
  const FrameResult& result = frame.result;
  for (std::size_t i = 0; i < result.bundles.size(); ++i) {
    const BundlePose& pose = result.bundles[i];
    if (!pose.has_pose || samples_.size() == kMost) continue;
    const double size_m = bundles_[i].markers.front().size_m;
    add(frame, time_s, object("bundle", bundles_[i].name, size_m), pose.pose, &pose.uncertainty, nullptr);
  }
  for (std::size_t i = 0; i < result.disc_targets.size(); ++i) {
    const DiscPose& pose = result.disc_targets[i];
    if (!pose.has_pose || samples_.size() == kMost) continue;
    double reach_m = 0;
    for (const TargetDisc& disc : targets_[i].discs)
      reach_m = std::max({reach_m, std::abs(disc.x_m), std::abs(disc.y_m)});
    add(frame, time_s, object("target", targets_[i].name, 2 * reach_m), pose.pose, &pose.uncertainty, nullptr);
  }
  for (const Detection& detection : result.detections) {
    if (!detection.has_pose || samples_.size() == kMost) continue;
    const TruthMarker* truth = truth_of(detection, frame.truth);
    name_ = detection.family->name;
    name_ += ' ';
    name_ += std::to_string(detection.id);
    const FilteredPose* filtered =
        frame.filters != nullptr ? frame.filters->find(detection.family->name, detection.id) : nullptr;
    add(frame, time_s, object("marker", name_, truth != nullptr ? truth->size_m : marker_size_m_), detection.pose,
        detection.pose_uncertainty ? &*detection.pose_uncertainty : nullptr, filtered);
  }
  return samples_;
}

}  // namespace berth::cli
