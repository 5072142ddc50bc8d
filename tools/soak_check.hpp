#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/detector.hpp"
#include "frame_observer.hpp"
#include "soak_scenario.hpp"
#include "soak_source.hpp"

namespace berth::cli {

/// What must not be, and was.
struct SoakViolation {
  u64 scenario = 0;
  /// By the camera's number; none for what is of the whole scenario.
  std::optional<u64> frame;
  std::string what;
};

/// Holds every frame of a scenario to what must be so, whatever goes wrong with cameras, backends, disks and threads:
/// it is one that the camera handed on, in order, with its pixels and its time; its status says what it holds; every
/// pose is near that of a marker that the frame shows, with a covariance that can be; a plain detector on another
/// backend finds the same, bit for bit; filtered poses are of this frame's time.
class SoakCheck final : public FrameObserver {
 public:
  /// `truths`: of each of the film's pictures. All outlive it.
  SoakCheck(const SoakScenario& scenario, SoakSource& source, const FaultyFilm& film,
            const std::vector<std::vector<TruthMarker>>& truths, Backend& second,
            std::vector<SoakViolation>& violations);
  ~SoakCheck() override;

  void begin(const ObservedStream& stream) override;
  void observe(const ObservedFrame& frame) override;

  u64 frames() const { return frames_; }
  u64 poses() const { return poses_; }
  /// Frames that were compared with a plain detector's.
  u64 compared() const { return compared_; }
  bool failed_over() const { return failed_over_; }
  /// How often a backend that was left has taken over again.
  u64 returns() const { return returns_; }

 private:
  void complain(const FilmedFrame& filmed, const std::string& what);
  void check_place(const ObservedFrame& frame, const FilmedFrame& filmed);
  void check_status(const ObservedFrame& frame, const FilmedFrame& filmed);
  void check_poses(const ObservedFrame& frame, const FilmedFrame& filmed);
  void check_filters(const ObservedFrame& frame, const FilmedFrame& filmed);
  void compare(const ObservedFrame& frame, const FilmedFrame& filmed);
  /// Whether it is near one of the truths that the frame may show.
  bool is_near(const Detection& detection, const FilmedFrame& filmed) const;

  const SoakScenario& scenario_;
  SoakSource& source_;
  const FaultyFilm& film_;
  const std::vector<std::vector<TruthMarker>>& truths_;
  Backend& second_backend_;
  std::vector<SoakViolation>& violations_;
  DetectorConfig config_;
  std::unique_ptr<Detector> second_;
  GrayImage drawn_;
  std::optional<FrameStamp> last_;
  int last_clock_ = 0;
  u64 frames_ = 0, poses_ = 0, compared_ = 0, returns_ = 0;
  bool failed_over_ = false, said_unwell_ = false;
};

}  // namespace berth::cli
