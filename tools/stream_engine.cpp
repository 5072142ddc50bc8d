#include "stream_engine.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "truth_score.hpp"

namespace berth::cli {

std::optional<TrackerConfig> tracking_of(const StreamOptions& options) {
  if (!options.track) return std::nullopt;
  TrackerConfig tracking;
  if (options.full_every > 0) tracking.full_every = options.full_every;
  if (options.behind > 0) tracking.behind = options.behind;
  return tracking;
}

StreamEngine::StreamEngine(const StreamOptions& options, const Source& source, const SourceFrame& like,
                           Console& console)
    : options_(options) {
  EngineOptions engine_options = options.engine;
  if (engine_options.families.empty()) {
    std::set<std::string> families;
    for (const TruthMarker& marker : like.truth) families.insert(marker.family);
    engine_options.families.assign(families.begin(), families.end());
  }
  DetectorConfig config = make_config(engine_options);
  if (!config.camera) config.camera = source.camera();
  size_given_ = config.marker_size_m > 0;
  // With sizes known by marker, poses are computed for one metre and scaled: t is proportional to the size.
  if (!size_given_ && !like.truth.empty()) config.marker_size_m = 1;
  const bool has_sizes = size_given_ || !config.bundles.empty() || !config.disc_targets.empty();
  if (!config.camera && has_sizes) console.note("no poses: --camera is missing");
  if (config.camera && !has_sizes && !(config.marker_size_m > 0)) console.note("no poses: --size is missing");
  config.digests = options.digests;
  EngineBackends opened = options.open_backends(engine_options);
  reopen_ = opened.reopen;
  engine_.emplace(std::move(opened), std::move(config), engine_options.camera_fit, tracking_of(options), health());
}

std::optional<HealthConfig> StreamEngine::health() const {
  if (options_.known_answer_s == 0) return std::nullopt;
  HealthConfig health;
  health.known_answer_every_ns = std::llround(options_.known_answer_s * 1e9);
  if (options_.fail_back_s > 0) {
    RecoveryConfig recovery;
    recovery.open = reopen_;
    recovery.first_wait_ns = std::llround(options_.fail_back_s * 1e9);
    recovery.longest_wait_ns = std::max(recovery.longest_wait_ns, recovery.first_wait_ns);
    health.recovery = recovery;
  }
  return health;
}

PipelineConfig StreamEngine::pipeline_config(int width, int height) const {
  PipelineConfig config =
      make_pipeline_config(options_.pace, engine_->config_for(width, height), tracking_of(options_));
  config.health = health();
  config.hang_ns = std::llround(options_.hang_ms * 1e6);
  return config;
}

/// Whether its pose goes by the size that its bundle gives it.
bool StreamEngine::in_bundle(const Detection& detection) const {
  const std::vector<Bundle>& bundles = engine_->config().bundles;
  return std::any_of(bundles.begin(), bundles.end(),
                     [&](const Bundle& bundle) { return bundle.find(*detection.family, detection.id) != nullptr; });
}

double StreamEngine::size_of(const Detection& detection, const std::vector<TruthMarker>& truth) const {
  const TruthMarker* marker = in_bundle(detection) ? nullptr : truth_of(detection, truth);
  return marker != nullptr ? marker->size_m : marker_size_m(engine_->config(), *detection.family, detection.id);
}

void StreamEngine::scale_poses(std::vector<Detection>& detections, const std::vector<TruthMarker>& truth) const {
  for (Detection& detection : detections) {
    if (!detection.has_pose) continue;
    if (in_bundle(detection)) continue;
    const TruthMarker* marker = truth_of(detection, truth);
    if (marker != nullptr) {
      scale_pose(marker->size_m / engine_->config().marker_size_m, detection);
    } else if (!size_given_) {
      detection.has_pose = false;
    }
  }
}

}  // namespace berth::cli
