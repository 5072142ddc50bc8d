// The only file that includes Ceres: its headers take seconds to compile.
#include "survey/adjust.hpp"

#include <ceres/ceres.h>

#include <cmath>
#include <memory>
#include <utility>

namespace berth {
namespace {

using Step = std::array<double, 6>;  // of a pose from where it was: berth::moved

template <class T>
std::array<T, 3> cross_of(const std::array<T, 3>& a, const std::array<T, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The point through the pose after its step: moved(pose, step), for Ceres's numbers. Turns are Cayley's, all rational.
template <class T>
std::array<T, 3> through(const Pose& pose, const T* step, const std::array<T, 3>& point) {
  std::array<T, 3> v;
  for (std::size_t i = 0; i < 3; ++i) {
    v[i] = pose.R[3 * i] * point[0] + pose.R[3 * i + 1] * point[1] + pose.R[3 * i + 2] * point[2];
  }
  const std::array<T, 3> h = {step[3] / 2.0, step[4] / 2.0, step[5] / 2.0};
  const T k = 2.0 / (1.0 + h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
  const std::array<T, 3> once = cross_of(h, v), twice = cross_of(h, once);
  return {v[0] + k * (once[0] + twice[0]) + pose.t[0] + step[0], v[1] + k * (once[1] + twice[1]) + pose.t[1] + step[1],
          v[2] + k * (once[2] + twice[2]) + pose.t[2] + step[2]};
}

std::array<double, 2> lens(const CameraModel& camera, double x, double y) { return camera.project(x, y); }

// Ceres's derivatives go through the lens by the camera's own.
template <class T, int N>
std::array<ceres::Jet<T, N>, 2> lens(const CameraModel& camera, const ceres::Jet<T, N>& x, const ceres::Jet<T, N>& y) {
  std::array<double, 4> slope{};
  const std::array<double, 2> image = camera.project(x.a, y.a, slope);
  std::array<ceres::Jet<T, N>, 2> result;
  for (std::size_t k = 0; k < 2; ++k) {
    result[k].a = image[k];
    result[k].v = slope[2 * k] * x.v + slope[2 * k + 1] * y.v;
  }
  return result;
}

// One corner's residual in standard deviations. Unknown: the steps of camera and marker, the marker's size (m).
class CornerError {
 public:
  CornerError(const CameraModel& camera, const Pose& station, const Pose& marker, std::size_t corner, const Vec2& seen,
              const std::array<double, 3>& covariance_px2)
      : camera_(camera), station_(station), marker_(marker), place_(corner_places(1)[corner]), seen_(seen) {
    // The inverse of the covariance's factor, as in refine_pose.
    const double a = std::sqrt(covariance_px2[0]), b = covariance_px2[1] / a;
    const double c = std::sqrt(covariance_px2[2] - b * b);
    white_ = {1 / a, -b / (a * c), 1 / c};
  }

  template <class T>
  bool operator()(const T* camera_step, const T* marker_step, const T* size_m, T* error) const {
    const std::array<T, 3> place = {place_[0] * *size_m, place_[1] * *size_m, place_[2] * *size_m};
    const std::array<T, 3> at = through(station_, camera_step, through(marker_, marker_step, place));
    if (!(at[2] > 1e-6)) return false;
    const std::array<T, 2> image = lens(camera_, T(at[0] / at[2]), T(at[1] / at[2]));
    const T x = seen_[0] - image[0], y = seen_[1] - image[1];
    error[0] = white_[0] * x;
    error[1] = white_[1] * x + white_[2] * y;
    return true;
  }

 private:
  const CameraModel& camera_;
  const Pose& station_;
  const Pose& marker_;
  Vec3 place_;
  Vec2 seen_;
  std::array<double, 3> white_ = {};
};

// A net as Ceres sees it: every pose as the step from where it is. The net outlives it, and stands still meanwhile.
class Unknowns {
 public:
  Unknowns(const SurveyNet& net, bool free_sizes, double robust)
      : cameras_(net.stations.size()), markers_(net.markers.size()) {
    for (const BundleMarker& marker : net.markers) sizes_m_.push_back(marker.size_m);
    for (std::size_t s = 0; s < net.stations.size(); ++s) {
      const SurveyStation& station = net.stations[s];
      if (!station.is_used()) continue;
      for (const Sight& sight : station.sights) {
        if (sight.is_kept()) add(net, station, sight, cameras_[s].data(), robust);
      }
    }
    for (std::size_t m = 0; m < markers_.size(); ++m) {
      if (!has(m)) continue;
      if (m == net.origin) problem_.SetParameterBlockConstant(markers_[m].data());
      if (m == net.origin || !free_sizes) problem_.SetParameterBlockConstant(&sizes_m_[m]);
    }
  }

  bool has(std::size_t marker) const { return problem_.HasParameterBlock(markers_[marker].data()); }

  bool solve() {
    if (problem_.NumResidualBlocks() == 0) return false;
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    // Cameras go first, each on its own: what is left to solve is as large as the markers.
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (Step& camera : cameras_) {
      if (problem_.HasParameterBlock(camera.data()))
        options.linear_solver_ordering->AddElementToGroup(camera.data(), 0);
    }
    for (std::size_t m = 0; m < markers_.size(); ++m) {
      if (!has(m)) continue;
      options.linear_solver_ordering->AddElementToGroup(markers_[m].data(), 1);
      options.linear_solver_ordering->AddElementToGroup(&sizes_m_[m], 1);
    }
    options.max_num_iterations = 100;
    options.function_tolerance = 1e-12;
    options.parameter_tolerance = 1e-12;
    options.gradient_tolerance = 1e-14;
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem_, &summary);
    return summary.IsSolutionUsable();
  }

  void apply_to(SurveyNet& net) const {
    for (std::size_t s = 0; s < cameras_.size(); ++s) {
      net.stations[s].camera = moved(net.stations[s].camera, cameras_[s]);
    }
    for (std::size_t m = 0; m < markers_.size(); ++m) {
      net.markers[m].pose = moved(net.markers[m].pose, markers_[m]);
      net.markers[m].size_m = sizes_m_[m];
    }
  }

  bool covariance(std::size_t origin, bool free_sizes, NetCovariance& result) {
    std::vector<std::pair<const double*, const double*>> wanted;
    for (std::size_t m = 0; m < markers_.size(); ++m) {
      if (!has(m)) return false;
      if (m == origin) continue;
      wanted.emplace_back(markers_[m].data(), markers_[m].data());
      if (free_sizes) wanted.emplace_back(&sizes_m_[m], &sizes_m_[m]);
    }
    ceres::Covariance covariance({});
    if (wanted.empty() || !covariance.Compute(wanted, &problem_)) return false;
    result.markers.assign(markers_.size(), {});
    result.sizes_m2.assign(markers_.size(), 0);
    for (std::size_t m = 0; m < markers_.size(); ++m) {
      if (m == origin) continue;
      covariance.GetCovarianceBlock(markers_[m].data(), markers_[m].data(), result.markers[m].data());
      if (free_sizes) covariance.GetCovarianceBlock(&sizes_m_[m], &sizes_m_[m], &result.sizes_m2[m]);
    }
    return true;
  }

 private:
  void add(const SurveyNet& net, const SurveyStation& station, const Sight& sight, double* camera, double robust) {
    using Cost = ceres::AutoDiffCostFunction<CornerError, 2, 6, 6, 1>;
    const std::size_t m = sight.marker;
    for (std::size_t k = 0; k < 4; ++k) {
      if (!sight.kept[k]) continue;
      auto error = std::make_unique<CornerError>(net.camera, station.camera, net.markers[m].pose, k, sight.seen_px[k],
                                                 sight.covariances_px2[k]);
      // The problem owns both.
      ceres::LossFunction* loss = robust > 0 ? new ceres::CauchyLoss(robust) : nullptr;
      problem_.AddResidualBlock(new Cost(error.release()), loss, camera, markers_[m].data(), &sizes_m_[m]);
    }
  }

  ceres::Problem problem_;
  std::vector<Step> cameras_, markers_;
  std::vector<double> sizes_m_;
};

}  // namespace

bool adjust(SurveyNet& net, bool free_sizes, double robust) {
  Unknowns unknowns(net, free_sizes, robust);
  if (!unknowns.solve()) return false;
  unknowns.apply_to(net);
  return true;
}

bool net_covariance(const SurveyNet& net, bool free_sizes, NetCovariance& covariance) {
  return Unknowns(net, free_sizes, 0).covariance(net.origin, free_sizes, covariance);
}

}  // namespace berth
