#include "berth/lockstep.hpp"

#include <cstdio>

#include "frame/result_digest.hpp"
#include "frame/stages.hpp"

namespace berth {
namespace {

std::string hex(const std::optional<u32>& word) {
  if (!word) return "nothing";
  char text[16];
  std::snprintf(text, sizeof text, "0x%08x", *word);
  return text;
}

/// As of a stage of one digest.
std::optional<StageDifference> result_difference(u64 first, u64 second) {
  if (first == second) return std::nullopt;
  const bool in_low = static_cast<u32>(first) != static_cast<u32>(second);
  const int shift = in_low ? 0 : 32;
  StageDifference difference;
  difference.stage = "result";
  difference.word = in_low ? 0 : 1;
  difference.first = static_cast<u32>(first >> shift);
  difference.second = static_cast<u32>(second >> shift);
  return difference;
}

}  // namespace

std::string to_string(const StageDifference& difference) {
  return "stage " + difference.stage + ", word " + std::to_string(difference.word) + ": " + hex(difference.first) +
         " and " + hex(difference.second);
}

struct Lockstep::Impl {
  Impl(Backend& first_backend, Backend& second_backend, int width, int height, const DetectorConfig& config)
      : first(first_backend, width, height, config, true), second(second_backend, width, height, config, true) {}

  Detector first;
  Detector second;
  std::optional<StageDifference> difference;
  bool lost = false;
};

Lockstep::Lockstep(Backend& first, Backend& second, int width, int height, const DetectorConfig& config)
    : impl_(std::make_unique<Impl>(first, second, width, height, config)) {}
Lockstep::~Lockstep() = default;
Lockstep::Lockstep(Lockstep&&) noexcept = default;
Lockstep& Lockstep::operator=(Lockstep&&) noexcept = default;

const FrameResult& Lockstep::detect(View2D<const u8> image, const FrameStamp& stamp,
                                    const std::vector<SearchWindow>& windows) {
  impl_->first.submit(image, stamp, windows);
  impl_->second.submit(image, stamp, windows);
  const FrameResult& first = impl_->first.collect();
  const FrameResult& second = impl_->second.collect();
  impl_->difference.reset();
  const bool first_lost = first.status == FrameStatus::device_lost;
  if (first_lost || second.status == FrameStatus::device_lost) {
    impl_->lost = true;
  } else {
    impl_->difference = first_difference(impl_->first, impl_->second);
    // The host's part has tables of its own; and it reads the image, which is no stage.
    if (!impl_->difference) impl_->difference = result_difference(digest_of(first), digest_of(second));
  }
  return first_lost ? second : first;
}

const std::optional<StageDifference>& Lockstep::difference() const { return impl_->difference; }
bool Lockstep::device_lost() const { return impl_->lost; }
const Detector& Lockstep::first() const { return impl_->first; }

}  // namespace berth
