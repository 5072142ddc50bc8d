#include "camera_play.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <future>
#include <utility>

#include "berth/error.hpp"
#include "pipeline/thread_setup.hpp"
#include "pipeline_show.hpp"

namespace berth::cli {
namespace {

/// A reader that waited for frames alone would not hear of a camera that is lost, nor of Ctrl-C.
constexpr std::chrono::microseconds kPause{500};
constexpr int kPauses = 100;

}  // namespace

CameraPlay::CameraPlay(CameraSource& camera, const PaceOptions& options, const std::vector<Backend*>& backends,
                       const PipelineConfig& config, std::uint64_t most)
    : camera_(camera), options_(options), most_(most), pipeline_(backends, camera.width(), camera.height(), config) {}

CameraPlay::~CameraPlay() {
  ended_ = true;
  pipeline_.close();
  if (thread_.joinable()) thread_.join();
  if (options_.realtime > 0) make_ordinary();
}

void CameraPlay::start() {
  pipeline_.start();
  std::promise<void> ready;
  std::future<void> set = ready.get_future();
  began_ = std::chrono::steady_clock::now();
  thread_ = std::thread([this, ready = std::move(ready)]() mutable {
    try {
      name_thread("berth-camera");
      if (options_.realtime > 0) make_realtime(options_.realtime);
      ready.set_value();
    } catch (...) {
      ready.set_exception(std::current_exception());
      return;
    }
    film();
    pipeline_.close();
    is_over_ = true;
  });
  set.get();
  // Or a busy machine keeps results from being read, and slots from getting free.
  if (options_.realtime > 0) make_realtime(std::max(1, options_.realtime - 1));
}

void CameraPlay::film() {
  for (std::uint64_t taken = 0; !ended_ && (most_ == 0 || taken < most_);) {
    try {
      // The frame first, then a slot: it may take the place of the one that waits.
      const FrameStamp stamp = camera_.await();
      const FrameSlot slot = pipeline_.begin();
      if (slot.image.data == nullptr) return;
      if (!camera_.fetch(slot.image)) continue;  // begun again, the slot is the same
      if (!pipeline_.commit(stamp)) return;
      ++taken;
      const std::lock_guard<std::mutex> lock(mutex_);
      health_ = camera_.health();
    } catch (const Error& error) {
      const std::lock_guard<std::mutex> lock(mutex_);
      complaints_.emplace_back(error.what());
      health_ = camera_.health();
    }
  }
}

const PipelineFrame* CameraPlay::next() {
  for (int i = 0; !is_over_; ++i) {
    if (const PipelineFrame* frame = pipeline_.poll()) return frame;
    if (i == kPauses || has_complaint()) return nullptr;
    std::this_thread::sleep_for(kPause);
  }
  const PipelineFrame* const frame = pipeline_.next();
  is_drained_ = frame == nullptr;
  return frame;
}

SourceHealth CameraPlay::health() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return health_;
}

bool CameraPlay::has_complaint() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return !complaints_.empty();
}

std::vector<std::string> CameraPlay::take_complaints() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(complaints_, {});
}

bool CameraPlay::has_ended() {
  if (!is_drained_) return false;
  if (thread_.joinable()) thread_.join();
  pipeline_.stop();
  return true;
}

double CameraPlay::frames_per_second() const {
  const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - began_;
  return static_cast<double>(pipeline_.counts().delivered) / std::max(1e-9, passed.count());
}

void CameraPlay::describe(std::ostream& out) const {
  out << fmt::format("camera      {}x{}, each frame straight into a slot\n", camera_.width(), camera_.height());
  print_set_up(out, pipeline_.memory(), options_.cores, options_.realtime);
}

void CameraPlay::sum_up(std::ostream& out) const {
  const PipelineCounts counts = pipeline_.counts();
  print_counts(out, counts);
  out << '\n';
  print_laps(out, pipeline_);
  print_late(out, options_.deadlines_ms, counts.late, counts.delivered);
}

Json CameraPlay::summary() const {
  Json json = to_json(pipeline_, options_.deadlines_ms);
  const SourceHealth health = camera_.health();
  json["camera"] = {{"skipped", health.skipped},   {"lost", health.lost},         {"incomplete", health.incomplete},
                    {"repeated", health.repeated}, {"misdated", health.misdated}, {"reopened", health.reopened}};
  return {{"summary", json}};
}

}  // namespace berth::cli
