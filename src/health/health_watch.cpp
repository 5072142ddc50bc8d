#include "health/health_watch.hpp"

#include <algorithm>
#include <utility>

#include "berth/error.hpp"

namespace berth {

const HealthConfig& checked_health(const HealthConfig& config) {
  if (config.known_answer_every_ns < 0) {
    throw Error("a known answer every " + std::to_string(config.known_answer_every_ns) +
                " ns; give more than 0, or 0 for the start alone");
  }
  return config;
}

HealthWatch::HealthWatch(const std::optional<HealthConfig>& config, int width, int height,
                         const DetectorConfig& detector, std::size_t backends)
    : scrubs_(backends + 1), good_(backends, 1) {
  if (!config) return;
  config_ = checked_health(*config);
  known_ = std::make_unique<KnownAnswer>(width, height, detector);
  if (config_.scrub_bytes > 0) watch(program_memory(), MemoryScrub::kShared);
}

bool HealthWatch::is_due(std::int64_t now_ns) const {
  return is_on() && config_.known_answer_every_ns > 0 && now_ns - answered_ns_ >= config_.known_answer_every_ns;
}

std::size_t HealthWatch::next_windows() {
  return windows_ = windows_ + 1 < known_->parts() ? windows_ + 1 : std::min<std::size_t>(1, known_->parts() - 1);
}

void HealthWatch::answer(std::size_t backend, bool is_right, bool is_lost, std::int64_t now_ns) {
  answered_ns_ = now_ns;
  ++answers_;
  if (is_right) return;
  ++wrong_;
  leave(backend, is_lost ? "its device was lost" : "a wrong known answer");
}

void HealthWatch::watch(const std::vector<ConstantMemory>& memory, int owner) {
  scrub_of(owner).add(memory, owner);
  count_watched();
}

void HealthWatch::count_watched() {
  std::size_t bytes = 0;
  for (const MemoryScrub& scrub : scrubs_) bytes += scrub.bytes();
  watched_ = bytes;
}

void HealthWatch::scrub() {
  if (!is_on()) return;
  std::size_t done = 0;
  // Once around at most.
  for (std::size_t looked = 0; looked <= scrubs_.size() && done < config_.scrub_bytes; ++looked) {
    MemoryScrub& scrub = scrubs_[scrubbed_];
    // What was left is nobody's concern, and may be on its way out.
    if (scrubbed_ == 0 || good_[scrubbed_ - 1]) {
      const std::optional<MemoryScrub::Altered> found = scrub.check_on(config_.scrub_bytes, done);
      if (found) {
        ++altered_;
        for (std::size_t i = 0; i < good_.size(); ++i) {
          if (scrubbed_ == 0 || i + 1 == scrubbed_) leave(i, found->what);
        }
        break;
      }
      if (!scrub.is_at_start()) break;
    }
    scrubbed_ = (scrubbed_ + 1) % scrubs_.size();
  }
  checked_ += done;
}

void HealthWatch::recover_by(Recovery::Make make) {
  if (!is_on() || !config_.recovery) return;
  recovery_ = std::make_unique<Recovery>(*config_.recovery, good_.size(), std::move(make));
  for (std::size_t i = 0; i < good_.size(); ++i) {
    if (!good_[i]) recovery_->wish(i);  // at start, already
  }
}

void HealthWatch::stop_recovery() {
  if (recovery_) recovery_->stop();
}

void HealthWatch::take_back(Returned& returned) {
  std::swap(scrubs_[returned.number + 1], returned.scrub);
  count_watched();
  good_[returned.number] = 1;
  find_active();
  recovery_->taken();
}

void HealthWatch::leave(std::size_t backend, const char* reason) {
  if (!is_good(backend)) return;
  good_[backend] = 0;
  reason_ = reason;
  find_active();
  if (recovery_) recovery_->wish(backend);
}

void HealthWatch::find_active() {
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
  report.watched_bytes = watched_;
  report.checked_bytes = checked_;
  report.alterations = altered_;
  if (recovery_) {
    report.tries = recovery_->tries();
    report.returns = recovery_->returns();
    report.recovery = recovery_->state();
  }
  return report;
}

}  // namespace berth
