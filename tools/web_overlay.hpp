#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "frame_json.hpp"
#include "frame_observer.hpp"

namespace berth::cli {

/// What is drawn on a picture of the video, in pixels of the camera's image (centres at integers).
struct Overlay {
  using Point = std::array<double, 2>;
  struct Object {
    std::string name;
    /// The paper's order; none of a bundle or a target.
    std::optional<std::array<Point, 4>> corners;
    /// Where the pose puts the origin and the ends of the x, y and z axis, half a side long; none behind the camera.
    std::array<std::optional<Point>, 4> axes;
    bool has_axes = false;
    /// Centres of discs that were seen.
    std::vector<Point> points;
  };
  u64 sequence = 0;
  int width = 0, height = 0;
  /// By the page's clock.
  double captured_s = 0;
  std::vector<Object> objects;
  /// Where markers were searched: x, y of the upper left corner, side.
  std::vector<std::array<int, 3>> windows;
};

/// Makes overlays of frames.
class OverlayMaker {
 public:
  /// Objects beyond so many are left out.
  static constexpr std::size_t kMost = 32;
  void begin(const ObservedStream& stream);
  Overlay of(const ObservedFrame& frame) const;

 private:
  std::vector<Bundle> bundles_;
  std::vector<DiscTarget> targets_;
};

Json to_json(const Overlay& overlay);

}  // namespace berth::cli
