#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "berth/detector.hpp"

namespace berth {

/// The first word that two backends wrote differently for one frame.
struct StageDifference {
  /// "result" where all stages agree, and what the host made of them does not: a digest of it.
  std::string stage;
  /// Where in the stage's output; the length of the shorter one where that is all they differ in.
  std::size_t word = 0;
  /// What the first and the second backend wrote there; empty where its output ends before.
  std::optional<u32> first, second;
};

/// "stage threshold, word 12: 0x00000001 and 0x00000003"
std::string to_string(const StageDifference& difference);

/// Two backends on every frame, bit against bit: a flipped bit, a broken driver or a failing memory shows on the frame
/// that it hits. Every stage's output is fetched from both, which costs more than the detection.
class Lockstep {
 public:
  /// The backends may be one and the same, and outlive this object. Throws Error as Detector does.
  Lockstep(Backend& first, Backend& second, int width, int height, const DetectorConfig& config);
  ~Lockstep();
  Lockstep(Lockstep&&) noexcept;
  Lockstep& operator=(Lockstep&&) noexcept;

  /// The first backend's result; where it lost its device, the second's.
  const FrameResult& detect(View2D<const u8> image, const FrameStamp& stamp = {},
                            const std::vector<SearchWindow>& windows = {});
  /// Of the frame detected last; none where every bit agrees or a device was lost.
  const std::optional<StageDifference>& difference() const;
  /// Whether either backend has lost its device: from then on nothing is compared.
  bool device_lost() const;
  /// The first backend's detector.
  const Detector& first() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
