#include "navigation/network_watch.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>

#include "berth/backend.hpp"
#include "crc32.hpp"
#include "health/health_watch.hpp"
#include "health/known_answer.hpp"
#include "monotonic.hpp"

namespace berth {
namespace {

/// Checksums of what the plans make of the picture; none where the device was lost.
std::optional<NetworkWatch::Answer> answer_of(NavigatorPlans& plans, const std::vector<u8>& picture) {
  // Pixel for pixel, enlarged to their bounds and between, within the frame and beyond it.
  const std::array<std::array<s32, 4>, kCloseLooks> windows = {
      {{0, 0, kMinStep, 0}, {-4000, 3000, 700, 0}, {plans.width * 64, plans.height * 64, kMaxStep, 0}}};
  plans.stream->upload(*plans.frame, picture.data(), picture.size());
  plans.stream->upload(plans.close.windows(), windows.data(), sizeof windows);
  plans.stream->upload(plans.follow.windows(), windows[1].data(), sizeof windows[1]);
  NetworkWatch::Answer answer = {};
  const std::array<NetworkPlan*, 3> all = {&plans.search, &plans.close, &plans.follow};
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::vector<s32>& sums = i == 0 ? plans.search_sums : plans.close_sums;
    if (!plans.run(*all[i], sums)) return std::nullopt;
    answer[i] = crc32(reinterpret_cast<const unsigned char*>(sums.data()), all[i]->sums().bytes());
  }
  return answer;
}

}  // namespace

NetworkWatch::NetworkWatch(const HealthConfig& config, NavigatorPlans& plans)
    : config_(checked_health(config)), picture_(plans.padded.size()) {
  const GrayImage image = known_picture(plans.width, plans.height, {"tag36h11"});
  for (int y = 0; y < plans.height; ++y) {
    std::copy_n(image.view().row(y), plans.width,
                picture_.data() + static_cast<std::ptrdiff_t>(y) * plans.padded_width);
  }
  {
    // The kernels' text: tests hold it to the reference's bits, which would take some times as long.
    BackendOptions all_cores;
    all_cores.threads = 0;
    const std::unique_ptr<Backend> text = open_backend("cpu", all_cores);
    NavigatorPlans definition(*text, plans.network, plans.width, plans.height);
    expected_ = *answer_of(definition, picture_);
  }
  if (config_.scrub_bytes > 0) {
    std::vector<ConstantMemory> memory;
    plans.list_constants(memory);
    scrub_.add(memory, 0);
  }
  ask(plans);
}

void NetworkWatch::ask(NavigatorPlans& plans) {
  const std::optional<Answer> answer = answer_of(plans, picture_);
  answered_ns_ = monotonic_ns();
  ++answers_;
  if (answer == expected_) return;
  ++wrong_;
  reason_ = answer ? "a wrong known answer" : "its device was lost";
}

bool NetworkWatch::is_believed(NavigatorPlans& plans) {
  if (*reason_.load() != '\0') return false;
  if (config_.scrub_bytes > 0) {
    const std::optional<MemoryScrub::Altered> found = scrub_.check(config_.scrub_bytes);
    checked_ = scrub_.checked();
    if (found) {
      ++altered_;
      reason_ = found->what;
      return false;
    }
  }
  const std::int64_t every_ns = config_.known_answer_every_ns;
  if (every_ns > 0 && monotonic_ns() - answered_ns_ >= every_ns) ask(plans);
  return *reason_.load() == '\0';
}

HealthReport NetworkWatch::report() const {
  HealthReport report;
  report.reason = reason_;
  report.mode = *report.reason == '\0' ? HealthMode::nominal : HealthMode::failed;
  report.known_answers = answers_;
  report.wrong_answers = wrong_;
  report.watched_bytes = scrub_.bytes();
  report.checked_bytes = checked_;
  report.alterations = altered_;
  return report;
}

}  // namespace berth
