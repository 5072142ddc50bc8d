#pragma once

#include <cstddef>
#include <optional>
#include <ostream>
#include <vector>

#include "berth/detector.hpp"
#include "berth/source.hpp"
#include "live_view.hpp"
#include "systematic_show.hpp"

namespace berth::cli {

/// What a stream finds, frame by frame, for a person at a terminal.
class StreamShow {
 public:
  /// `total` frames where known.
  StreamShow(std::ostream& people, bool terminal, std::optional<std::size_t> total) : view_(people, terminal, total) {}

  /// The last of `done` frames, its poses in metres; `rate` in frames per second. `config` names bundles and targets.
  void show(std::size_t done, double rate, const FrameResult& result, const std::vector<TruthMarker>& truth,
            const SystematicCovariances& systematic, const DetectorConfig& config);
  void finish() { view_.finish(); }

 private:
  LiveView view_;
};

}  // namespace berth::cli
