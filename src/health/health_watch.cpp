#include "health/health_watch.hpp"

#include <algorithm>

#include "berth/error.hpp"

namespace berth {
namespace {

HealthConfig checked(const HealthConfig& config) {
  if (config.known_answer_every_ns < 0) {
    throw Error("a known answer every " + std::to_string(config.known_answer_every_ns) +
                " ns; give more than 0, or 0 for the start alone");
  }
  return config;
}

}  // namespace

HealthWatch::HealthWatch(const std::optional<HealthConfig>& config, int width, int height,
                         const DetectorConfig& detector, std::size_t backends)
    : good_(backends, 1) {
  if (!config) return;
  config_ = checked(*config);
  known_ = std::make_unique<KnownAnswer>(width, height, detector);
  if (config_.scrub_bytes > 0) scrub_.add(program_memory(), MemoryScrub::kShared);
}

bool HealthWatch::is_due(std::int64_t now_ns) const {
  return is_on() && config_.known_answer_every_ns > 0 && now_ns - answered_ns_ >= config_.known_answer_every_ns;
}

bool HealthWatch::answer(std::size_t backend, const FrameResult& result, std::int64_t now_ns) {
  answered_ns_ = now_ns;
  ++answers_;
  if (known_->fits(result)) return true;
  ++wrong_;
  leave(backend, result.status == FrameStatus::device_lost ? "its device was lost" : "a wrong known answer");
  return false;
}

void HealthWatch::scrub() {
  if (!is_on() || config_.scrub_bytes == 0) return;
  const std::optional<MemoryScrub::Altered> found = scrub_.check(config_.scrub_bytes);
  checked_ = scrub_.checked();
  if (!found) return;
  ++altered_;
  for (std::size_t i = 0; i < good_.size(); ++i) {
    if (found->owner == MemoryScrub::kShared || static_cast<std::size_t>(found->owner) == i) leave(i, found->what);
  }
}

void HealthWatch::leave(std::size_t backend, const char* reason) {
  if (!is_good(backend)) return;
  good_[backend] = 0;
  reason_ = reason;
  const auto first = std::find(good_.begin(), good_.end(), char{1});
  active_.store(static_cast<std::size_t>(first - good_.begin()), std::memory_order_release);
}

HealthReport HealthWatch::report() const {
  HealthReport report;
  const std::size_t now = active();
  report.mode = now == good_.size() ? HealthMode::failed : now > 0 ? HealthMode::fallback : HealthMode::nominal;
  report.reason = reason_;
  report.known_answers = answers_;
  report.wrong_answers = wrong_;
  report.watched_bytes = scrub_.bytes();
  report.checked_bytes = checked_;
  report.alterations = altered_;
  return report;
}

}  // namespace berth
