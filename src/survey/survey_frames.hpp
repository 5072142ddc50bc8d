#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "berth/marker.hpp"

namespace berth {

/// What one frame shows.
struct SurveyFrame {
  /// File or frame, for people.
  std::string label;
  std::vector<Detection> markers;
};

/// The frames of a survey as they gather: those that tell something about how markers sit.
class SurveyFrames {
 public:
  enum class Verdict { taken, alone, repeated };

  /// For images so wide, px. With more than `most` frames those most like others go.
  SurveyFrames(int width_px, std::size_t most);

  /// Takes a frame with two markers or more, unless they stand where an earlier frame has them. A marker that is there
  /// twice is nobody's.
  Verdict add(SurveyFrame frame);

  const std::vector<SurveyFrame>& frames() const { return frames_; }
  int alone() const { return alone_; }
  int repeated() const { return repeated_; }

 private:
  bool is_repeated(const SurveyFrame& frame) const;

  std::size_t most_;
  double moved_px_;
  std::vector<SurveyFrame> frames_;
  int alone_ = 0, repeated_ = 0;
};

}  // namespace berth
