// The photometric fit's corners against the simulator's truth: at the noise's limit where the model holds, honest about
// their covariance, near the truth where it does not hold, and left alone where they would lie.

#include "target/photometric_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <memory>

#include "berth/detector.hpp"
#include "sim/close_up.hpp"
#include "sim/render.hpp"
#include "support/counted_allocations.hpp"
#include "support/instruction_sets.hpp"
#include "target/edge_profile.hpp"
#include "target/marker_pose.hpp"

namespace berth {
namespace {

TEST(EdgeProfile, IsTheNormalDistribution) {
  const EdgeProfile profile;
  for (int t_q7 = -511; t_q7 <= 511; ++t_q7) {
    const double t = t_q7 / 128.0;
    const double density = std::exp(-t * t / 2) / std::sqrt(2 * std::acos(-1.0));
    const EdgePoint& point = profile.at(t_q7);
    EXPECT_LE(std::fabs(point.level - 16384 * 0.5 * std::erfc(-t / std::sqrt(2.0))), 0.5 + 1e-6) << t;
    EXPECT_LE(std::fabs(point.slope - 16384 * density), 0.5 + 1e-6) << t;
    EXPECT_LE(std::fabs(point.spread - 16384 * t * density), 0.5 + 1e-6) << t;
  }
  EXPECT_EQ(profile.at(-512).level, 0);
  EXPECT_EQ(profile.at(512).level, 16384);
}

/// Errors of a fit's and of the edges' corners over frames of one kind.
struct Errors {
  int found = 0, fitted = 0;
  double fit_squares = 0, edge_squares = 0, mahalanobis = 0;
  double rms_px() const { return std::sqrt(fit_squares / (4 * found)); }
  double edge_rms_px() const { return std::sqrt(edge_squares / (4 * found)); }
  /// Mean square error in units of the covariance, per coordinate: 1 where that is honest.
  double nees() const { return mahalanobis / (8 * fitted); }
};

double squares(const Corners& corners, const Corners& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < 2; ++k) sum += (corners[i][k] - truth[i][k]) * (corners[i][k] - truth[i][k]);
  }
  return sum;
}

double mahalanobis(const Corners& corners, const Corners& truth, const CornerCovariance& covariance) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::array<double, 3> c = block_of(covariance, i);
    const double x = corners[i][0] - truth[i][0], y = corners[i][1] - truth[i][1];
    sum += (c[2] * x * x - 2 * c[1] * x * y + c[0] * y * y) / (c[0] * c[2] - c[1] * c[1]);
  }
  return sum;
}

std::unique_ptr<Backend> simd() { return open_backend("simd"); }

Errors measure(const sim::CloseUp& what, int frames, const std::function<void(sim::Scene&)>& change = {}) {
  const std::unique_ptr<Backend> backend = simd();
  Errors errors;
  for (int i = 0; i < frames; ++i) {
    sim::Scene scene = sim::close_up_scene(paper_camera(), what, i);
    if (change) change(scene);
    const GrayImage image = sim::Renderer(scene.camera, 4).render(scene);
    const TruthMarker truth = sim::truth(scene).at(0);
    Detector detector(*backend, scene.camera.width, scene.camera.height, {});
    for (const Detection& found : detector.detect(image.view()).detections) {
      if (found.id != truth.id) continue;
      ++errors.found;
      Corners corners = found.corners;
      CornerCovariance known;
      CornerFit fit;
      PhotometricFit photometric(scene.camera, scene.camera.width, scene.camera.height);
      if (photometric.refine(image.view(), *found.family, found.id, corners, known, fit)) {
        ++errors.fitted;
        errors.mahalanobis += mahalanobis(corners, truth.corners, known);
      }
      errors.fit_squares += squares(corners, truth.corners);
      errors.edge_squares += squares(found.corners, truth.corners);
    }
  }
  EXPECT_EQ(errors.found, frames);
  return errors;
}

struct Bound {
  double side_px, noise, rms_px;
  int frames;
};

// The numbers to reach, 2-D RMS: blur sigma 0.6 px, tilt up to 35 degrees, the paper's lens.
TEST(PhotometricFit, IsAtTheNoiseBound) {
  // Of eight coordinates a frame the RMS is known to one part in 4 sqrt(frames): more frames where the bound is near.
  const Bound bounds[] = {
      {20, 2, 0.018, 12}, {40, 2, 0.0095, 16}, {80, 2, 0.0065, 12}, {80, 8, 0.025, 24}, {160, 2, 0.0045, 8}};
  for (const Bound& bound : bounds) {
    const Errors errors = measure({bound.side_px, bound.noise}, bound.frames);
    EXPECT_EQ(errors.fitted, errors.found) << bound.side_px;
    EXPECT_LT(errors.rms_px(), bound.rms_px) << bound.side_px << " px, noise " << bound.noise;
  }
}

// 24 frames of eight coordinates: the mean of chi-squares over their degrees of freedom, which correlations between
// corners widen.
TEST(PhotometricFit, ItsCovarianceIsThatOfItsErrors) {
  const Errors errors = measure({60, 3}, 24);
  EXPECT_GT(errors.nees(), 0.7);
  EXPECT_LT(errors.nees(), 1.4);
}

TEST(PhotometricFit, FollowsTheLensAtTheBorder) {
  sim::CloseUp what{80, 2};
  what.at_border = true;
  EXPECT_LT(measure(what, 16).rms_px(), 0.0065);
}

TEST(PhotometricFit, HoldsForBlursThatItDoesNotModel) {
  const Errors disc = measure({80, 2}, 12, [](sim::Scene& s) { s.sensor.defocus_px = 2; });
  EXPECT_LT(disc.rms_px(), 0.012);
  const Errors motion = measure({80, 2}, 12, [](sim::Scene& s) {
    s.motion.shift = {3 * s.markers[0].pose.t[2] / s.camera.fx, 0, 0};  // 3 px
  });
  EXPECT_LT(motion.rms_px(), 0.012);
}

TEST(PhotometricFit, HoldsForBentTonesAndSaturation) {
  for (const double gamma : {0.45, 1.7}) {
    const Errors errors = measure({80, 2}, 8, [&](sim::Scene& s) { s.sensor.gamma = gamma; });
    EXPECT_LT(errors.rms_px(), 0.02) << gamma;
    EXPECT_GT(errors.edge_rms_px(), 0.2) << gamma;  // what edges alone make of it
  }
  const Errors white = measure({80, 2}, 8, [](sim::Scene& s) { s.sensor.white_level = 330; });
  EXPECT_LT(white.rms_px(), 0.02);
}

TEST(PhotometricFit, TakesLevelsAsLocalAcrossAShadow) {
  sim::Scene scene = sim::close_up_scene(paper_camera(), {120, 2}, 1);
  const Vec3& at = scene.markers[0].pose.t;
  sim::Shadow shadow;
  shadow.offset = at[0] / at[2];
  shadow.softness = 0.01;
  scene.lighting.shadows.push_back(shadow);
  const GrayImage image = sim::Renderer(scene.camera, 4).render(scene);
  const TruthMarker truth = sim::truth(scene).at(0);
  PhotometricFit photometric(scene.camera, scene.camera.width, scene.camera.height);
  Corners corners = truth.corners;
  corners[0][0] += 0.1;
  CornerCovariance known;
  CornerFit fit;
  ASSERT_TRUE(photometric.refine(image.view(), family("tag36h11"), truth.id, corners, known, fit));
  EXPECT_TRUE(fit.local_levels);
  EXPECT_LT(std::sqrt(squares(corners, truth.corners) / 4), 0.05);
}

TEST(PhotometricFit, LeavesCornersAloneWhereItDoesNotHold) {
  const sim::Scene scene = sim::close_up_scene(paper_camera(), {60, 2}, 3);
  const int size = scene.camera.width;
  const GrayImage image = sim::Renderer(scene.camera).render(scene);
  const TruthMarker truth = sim::truth(scene).at(0);
  PhotometricFit photometric(scene.camera, size, size);
  const auto refused = [&](const GrayImage& picture, int id, const Corners& start) {
    Corners corners = start;
    CornerCovariance known;
    CornerFit fit;
    const bool done = photometric.refine(picture.view(), family("tag36h11"), id, corners, known, fit);
    if (!done) {
      EXPECT_EQ(corners, start);
    }
    return !done;
  };
  EXPECT_FALSE(refused(image, truth.id, truth.corners));
  GrayImage grey(size, size);
  EXPECT_TRUE(refused(grey, truth.id, truth.corners)) << "all black";
  for (int y = 0; y < size; ++y) std::fill_n(grey.view().row(y), size, u8{100});
  EXPECT_TRUE(refused(grey, truth.id, truth.corners)) << "flat";
  Corners far = truth.corners;
  for (auto& corner : far) corner[0] += 15;
  EXPECT_TRUE(refused(image, truth.id, far)) << "two modules off";
  Corners bow_tie = truth.corners;
  std::swap(bow_tie[0], bow_tie[1]);
  EXPECT_TRUE(refused(image, truth.id, bow_tie));
  Corners nowhere;
  for (auto& corner : nowhere) corner = {std::nan(""), 5};
  CornerCovariance known;
  CornerFit fit;
  EXPECT_FALSE(photometric.refine(image.view(), family("tag36h11"), truth.id, nowhere, known, fit));
}

u64 digest_of(const Corners& corners) {
  u64 digest = 0;
  for (const auto& corner : corners) {
    for (const double value : corner) {
      u64 bits = 0;
      std::memcpy(&bits, &value, sizeof bits);
      digest = digest * 31 + bits;
    }
  }
  return digest;
}

// The same bits under every compiler and instruction set: when they change, the commit says why.
TEST(PhotometricFit, HasTheBitsItHad) {
  const sim::Scene scene = sim::close_up_scene(paper_camera(), {70, 2}, 7);
  const GrayImage image = sim::Renderer(scene.camera).render(scene);
  const TruthMarker truth = sim::truth(scene).at(0);
  PhotometricFit photometric(scene.camera, scene.camera.width, scene.camera.height);
  test::for_each_instruction_set([&](const char* name) {
    Corners corners = truth.corners;
    CornerCovariance known;
    CornerFit fit;
    const std::size_t before = test::allocations();
    EXPECT_TRUE(photometric.refine(image.view(), family("tag36h11"), truth.id, corners, known, fit));
    EXPECT_EQ(test::allocations(), before) << "refine allocates";
    const u64 digest = digest_of(corners);
    EXPECT_EQ(digest, 0xbd9bb478a5b88659u) << std::hex << "0x" << digest << " on " << name;
  });
}

TEST(PhotometricFit, IsTheDetectorsWhenAskedFor) {
  const sim::Scene scene = sim::close_up_scene(paper_camera(), {60, 2}, 5);
  const GrayImage image = sim::Renderer(scene.camera, 4).render(scene);
  const TruthMarker truth = sim::truth(scene).at(0);
  const std::unique_ptr<Backend> backend = simd();
  DetectorConfig config;
  config.camera = scene.camera;
  config.marker_size_m = truth.size_m;
  Detector edges(*backend, scene.camera.width, scene.camera.height, config);
  const Detection plain = edges.detect(image.view()).detections.at(0);
  EXPECT_FALSE(plain.corner_fit);
  config.corner_method = CornerMethod::photometric;
  Detector photometric(*backend, scene.camera.width, scene.camera.height, config);
  const Detection fine = photometric.detect(image.view()).detections.at(0);
  ASSERT_TRUE(fine.corner_fit);
  EXPECT_LT(squares(fine.corners, truth.corners), squares(plain.corners, truth.corners));
  ASSERT_TRUE(fine.pose_uncertainty && plain.pose_uncertainty);
  // A pose as sure as its corners.
  EXPECT_LT(fine.pose_uncertainty->covariance[14], 0.3 * plain.pose_uncertainty->covariance[14]);
}

}  // namespace
}  // namespace berth
