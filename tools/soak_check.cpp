#include "soak_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "bundle_show.hpp"
#include "exact_math.hpp"
#include "frame/result_digest.hpp"
#include "marker_filters.hpp"
#include "truth_score.hpp"
#include "verify/chaos_scenes.hpp"

namespace berth::cli {
namespace {

/// A marker's other planar pose counts as said where it is less than so much worse, in squares of standard deviations:
/// as the pose filter has it, e^-12.5 as likely.
constexpr double kSaidExcess = 25;

double range_m(const Pose& pose) { return distance_m(pose, Pose()); }

/// A turn may be off by so many of the deviations that its covariance states.
constexpr double kMostDeviations = 5;

/// A torn frame's corners are of two instants: how the marker is tilted is then anybody's guess, where it is not.
/// `covariance`: of the pose, or null.
bool is_off(const Pose& pose, const Pose& truth, const double* covariance, bool is_torn) {
  if (!(distance_m(pose, truth) <= kWrongShare * range_m(truth))) return true;
  if (is_torn) return false;
  double most_deg = kWrongDegrees;
  if (covariance != nullptr) {
    const double turn = std::sqrt(covariance[21] + covariance[28] + covariance[35]);
    most_deg = std::max(most_deg, kMostDeviations * turn * 180 / kPi);
  }
  return !(angle_deg(pose, truth) <= most_deg);
}

bool is_finite(const Pose& pose) {
  return std::all_of(pose.R.begin(), pose.R.end(), [](double x) { return std::isfinite(x); }) &&
         std::all_of(pose.t.begin(), pose.t.end(), [](double x) { return std::isfinite(x); }) && pose.t[2] > 0;
}

/// Positive definite, by Cholesky's decomposition, each coordinate in its own deviations: millimetres stand beside
/// turns.
bool can_be(const std::array<double, 36>& covariance) {
  std::array<double, 36> a = covariance;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      const double scale = std::sqrt(covariance[i * 7] * covariance[j * 7]);
      a[i * 6 + j] = covariance[i * 6 + j] / scale;
      if (!(scale > 0) || !std::isfinite(a[i * 6 + j]) || std::abs(a[i * 6 + j]) > 1 + 1e-9) return false;
    }
  }
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = a[i * 6 + j];
      for (std::size_t k = 0; k < j; ++k) sum -= a[i * 6 + k] * a[j * 6 + k];
      if (i == j && !(sum > 0)) return false;
      a[i * 6 + j] = i == j ? std::sqrt(sum) : sum / a[j * 7];
    }
  }
  return true;
}

u64 digest_of_one(const Detection& detection) {
  FrameResult one;
  one.detections.push_back(detection);
  return digest_of(one);
}

std::string named(const Detection& d) { return fmt::format("{} {}", d.family->name, d.id); }

}  // namespace

SoakCheck::SoakCheck(const SoakScenario& scenario, SoakSource& source, const FaultyFilm& film,
                     const std::vector<std::vector<TruthMarker>>& truths, Backend& second,
                     std::vector<SoakViolation>& violations)
    : scenario_(scenario),
      source_(source),
      film_(film),
      truths_(truths),
      second_backend_(second),
      violations_(violations) {}

SoakCheck::~SoakCheck() = default;

void SoakCheck::begin(const ObservedStream& stream) {
  config_ = stream.config;
  second_ = std::make_unique<Detector>(second_backend_, stream.width, stream.height, config_);
  drawn_ = GrayImage(stream.width, stream.height);
}

void SoakCheck::complain(const FilmedFrame& filmed, const std::string& what) {
  const bool is_plain = filmed.fault == CameraFault::none;
  violations_.push_back(
      {scenario_.number, filmed.number, is_plain ? what : fmt::format("{} (a {} frame)", what, name_of(filmed.fault))});
}

void SoakCheck::observe(const ObservedFrame& frame) {
  ++frames_;
  const std::optional<FilmedFrame> filmed = source_.handed_on(frame.result.stamp.sequence);
  if (!filmed) {
    FilmedFrame unknown;
    unknown.number = frame.result.stamp.sequence;
    complain(unknown, "a result of a frame that the camera did not hand on, or a second one");
    return;
  }
  failed_over_ = failed_over_ || frame.engine.mode == HealthMode::fallback;
  returns_ = std::max(returns_, frame.engine.returns);
  check_place(frame, *filmed);
  check_status(frame, *filmed);
  check_poses(frame, *filmed);
  if (frame.filters != nullptr) check_filters(frame, *filmed);
  compare(frame, *filmed);
  last_ = frame.result.stamp;
  last_clock_ = filmed->clock;
}

void SoakCheck::check_place(const ObservedFrame& frame, const FilmedFrame& filmed) {
  const FrameStamp& stamp = frame.result.stamp;
  if (stamp.mid_exposure_ns != filmed.time_ns) complain(filmed, "its time is another frame's");
  if (last_ && stamp.sequence <= last_->sequence) complain(filmed, "it came out of order");
  if (last_ && stamp.arrival_ns < last_->arrival_ns) complain(filmed, "it arrived before the last one");
  if (last_ && filmed.clock == last_clock_ && stamp.mid_exposure_ns <= last_->mid_exposure_ns) {
    complain(filmed, "its time does not go on from the last one's");
  }
  const View2D<const u8> image = frame.image;
  if (drawn_.width() != image.width || drawn_.height() != image.height) drawn_ = GrayImage(image.width, image.height);
  film_.draw(filmed, drawn_.view());
  for (int y = 0; y < image.height; ++y) {
    if (std::equal(image.row(y), image.row(y) + image.width, drawn_.view().row(y))) continue;
    complain(filmed, fmt::format("its pixels in row {} are not the camera's", y));
    break;
  }
}

void SoakCheck::check_status(const ObservedFrame& frame, const FilmedFrame& filmed) {
  const FrameResult& result = frame.result;
  const bool any = !result.detections.empty();
  const bool fits = result.status == FrameStatus::ok          ? any
                    : result.status == FrameStatus::no_target ? !any
                                                              : result.status == FrameStatus::overflow;
  if (!fits) {
    complain(filmed, fmt::format("its status is {} with {} markers", name_of(result.status), result.detections.size()));
  }
  const bool is_flat = filmed.fault == CameraFault::black || filmed.fault == CameraFault::white;
  if (is_flat && any) complain(filmed, "a marker in a frame of one grey level");
  // A device that is lost or hangs while it is asked gives a wrong one.
  if (frame.engine.wrong_answers > 0 && !scenario_.loses_backend() && !said_unwell_) {
    complain(filmed, "a wrong known answer");
    said_unwell_ = true;
  }
  if (frame.engine.alterations > 0 && !said_unwell_) {
    complain(filmed, "altered memory");
    said_unwell_ = true;
  }
  if (frame.paced == nullptr) return;
  for (const std::int64_t lap : frame.paced->laps_ns) {
    if (lap < 0) complain(filmed, "a part of its way took less than no time");
  }
}

bool SoakCheck::is_near(const Detection& detection, const FilmedFrame& filmed) const {
  const bool is_torn = filmed.fault == CameraFault::torn;
  for (const std::size_t picture : {filmed.picture, filmed.below}) {
    const TruthMarker* const truth = truth_of(detection, truths_[picture]);
    if (truth == nullptr) continue;
    const std::optional<PoseUncertainty>& said = detection.pose_uncertainty;
    const double* const covariance = said ? said->covariance.data() : nullptr;
    if (!detection.has_pose || !is_off(detection.pose, truth->pose, covariance, is_torn)) return true;
    if (said && said->has_other && said->other_excess < kSaidExcess &&
        !is_off(said->other, truth->pose, said->other_covariance.data(), is_torn))
      return true;
  }
  return false;
}

void SoakCheck::check_poses(const ObservedFrame& frame, const FilmedFrame& filmed) {
  // Another size has another camera, which nobody gave.
  const bool is_resized = filmed.fault == CameraFault::resized;
  // The closed form takes corners of two instants for one marker's: off by a tenth of the range where least squares are
  // off by a hundredth.
  const bool is_torn = filmed.fault == CameraFault::torn;
  const bool is_judged = !is_torn || scenario_.pose != "paper";
  for (const Detection& d : frame.result.detections) {
    poses_ += d.has_pose ? 1 : 0;
    if (is_resized && d.has_pose) complain(filmed, named(d) + " has a pose by another size's camera");
    if (d.has_pose && !is_finite(d.pose)) complain(filmed, named(d) + " has a pose that cannot be");
    if (is_judged && !is_near(d, filmed)) {
      const TruthMarker* const truth = truth_of(d, truths_[filmed.picture]);
      complain(filmed, named(d) + (truth == nullptr
                                       ? std::string(" is not in the frame")
                                       : fmt::format(" has a wrong pose: {:.1f} % of the range off, {:.1f} degrees",
                                                     100 * distance_m(d.pose, truth->pose) / range_m(truth->pose),
                                                     angle_deg(d.pose, truth->pose))));
    }
    if (d.has_pose && d.pose_uncertainty && !can_be(d.pose_uncertainty->covariance)) {
      complain(filmed, named(d) + " has a covariance that cannot be");
    }
  }
  for (std::size_t i = 0; i < frame.result.bundles.size(); ++i) {
    const BundlePose& bundle = frame.result.bundles[i];
    if (!bundle.has_pose) continue;
    ++poses_;
    bool near = false;
    for (const std::size_t picture : {filmed.picture, filmed.below}) {
      Pose truth;
      near = near || (truth_of(config_.bundles[i], truths_[picture], truth) &&
                      !is_off(bundle.pose, truth, bundle.uncertainty.covariance.data(), is_torn));
    }
    if (is_judged && !near) complain(filmed, "the bundle has a wrong pose");
  }
}

void SoakCheck::check_filters(const ObservedFrame& frame, const FilmedFrame& filmed) {
  for (const SoakMarker& marker : scenario_.markers) {
    const FilteredPose* const pose = frame.filters->find(scenario_.family, marker.id);
    if (pose == nullptr) continue;
    const std::string name = fmt::format("the filtered pose of {} {}", scenario_.family, marker.id);
    if (pose->time_ns != frame.result.stamp.mid_exposure_ns) complain(filmed, name + " is of another time");
    if (!(pose->age_s >= 0) || pose->age_s > PoseFilterConfig().lost_s) complain(filmed, name + " is stale");
    if (!is_finite(pose->pose) || !can_be(pose->covariance) || !can_be(pose->velocity_covariance)) {
      complain(filmed, name + " or its covariance cannot be");
    }
  }
}

void SoakCheck::compare(const ObservedFrame& frame, const FilmedFrame& filmed) {
  if (filmed.fault == CameraFault::resized) return;
  ++compared_;
  const FrameResult& plain = second_->detect(frame.image, frame.result.stamp);
  if (frame.tracked == nullptr || frame.tracked->whole) {
    if (frame.digest != digest_of(plain)) {
      complain(filmed, fmt::format("a plain run on {} comes to another result", second_backend_.name()));
    }
    return;
  }
  // In windows the markers held are found, with the bits of the whole frame.
  for (const Detection& d : frame.result.detections) {
    const auto is_it = [&](const Detection& other) {
      return other.id == d.id && other.family == d.family && digest_of_one(other) == digest_of_one(d);
    };
    if (std::none_of(plain.detections.begin(), plain.detections.end(), is_it)) {
      complain(filmed,
               fmt::format("{} in a window is not what a plain run on {} finds", named(d), second_backend_.name()));
    }
  }
}

}  // namespace berth::cli
