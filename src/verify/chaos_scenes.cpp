#include "verify/chaos_scenes.hpp"

#include <cmath>
#include <memory>

#include "sim/corpus.hpp"
#include "sim/render.hpp"

namespace berth {
namespace {

/// cos of kWrongDegrees and of half of it: a rotation by w has the trace 1 + 2 cos w.
constexpr double kCosWrong = 0.984807753012208, kCosHalf = 0.996194698091746;

/// What is easy, what is small, near and far, dark, blurred, and full of edges.
const std::vector<std::string>& corpora() {
  static const std::vector<std::string> names = {"easy", "dock", "cluttered", "dark", "motion"};
  return names;
}

bool is_near(const TruthMarker& truth, const Pose& pose, double share) {
  double off = 0, range = 0, trace = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double d = pose.t[i] * truth.size_m - truth.pose.t[i];
    off += d * d;
    range += truth.pose.t[i] * truth.pose.t[i];
  }
  for (std::size_t i = 0; i < 9; ++i) trace += pose.R[i] * truth.pose.R[i];
  const double bound = share * kWrongShare;
  return off <= bound * bound * range && trace >= 1 + 2 * (share < 1 ? kCosHalf : kCosWrong);
}

}  // namespace

DetectorConfig chaos_config() {
  DetectorConfig config;
  config.camera = paper_camera(kChaosWidth, kChaosHeight);
  config.marker_size_m = 1;
  return config;
}

bool has_wrong_pose(const ChaosScene& scene, const FrameResult& result, double share) {
  for (const Detection& d : result.detections) {
    if (!d.has_pose) continue;
    bool is_right = false;
    for (const TruthMarker& truth : scene.truth) {
      is_right = is_right || (truth.id == d.id && truth.family == d.family->name && is_near(truth, d.pose, share));
    }
    if (!is_right) return true;
  }
  return false;
}

std::vector<ChaosScene> chaos_scenes(std::size_t count) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector detector(*backend, kChaosWidth, kChaosHeight, chaos_config());
  const sim::Renderer renderer(*chaos_config().camera);
  std::vector<ChaosScene> scenes;
  for (int i = 0; scenes.size() < count; ++i) {
    const std::string& corpus = corpora()[static_cast<std::size_t>(i) % corpora().size()];
    const int index = i * 17 % sim::kCorpusFrames;
    const sim::Scene scene = sim::corpus_scene(corpus, index, kChaosWidth, kChaosHeight);
    ChaosScene made{corpus + " " + std::to_string(index), renderer.render(scene), sim::truth(scene)};
    const FrameResult& result = detector.detect(made.image.view());
    bool has_pose = false;
    for (const Detection& d : result.detections) has_pose = has_pose || d.has_pose;
    if (has_pose && !has_wrong_pose(made, result, 0.5)) scenes.push_back(std::move(made));
  }
  return scenes;
}

}  // namespace berth
