#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "berth/bundle.hpp"
#include "berth/camera.hpp"
#include "pose_algebra.hpp"
#include "target/marker_pose.hpp"

/// A surveyor's net: stations (frames) that sight points (markers). What start.cpp sets up and adjust.cpp adjusts.
namespace berth {

/// A marker as one frame shows it.
struct Sight {
  /// Which of SurveyNet::markers.
  std::size_t marker = 0;
  /// Where the corners were found, paper's order, px.
  std::array<Vec2, 4> seen_px = {};
  /// Of each corner: of x, of x with y, of y.
  std::array<std::array<double, 3>, 4> covariances_px2 = {};
  /// The corners come of lines along the sides, not of a fit of the pattern.
  bool by_lines = false;
  /// Corners that take part.
  std::array<bool, 4> kept = {true, true, true, true};

  /// A sight that has lost two corners says too little to be trusted with the others.
  bool is_kept() const { return kept[0] + kept[1] + kept[2] + kept[3] >= 3; }
};

/// A frame.
struct SurveyStation {
  /// The net's frame to camera frame.
  Pose camera;
  std::vector<Sight> sights;
  /// It ties markers together only with two or more.
  bool is_used() const;
};

/// Markers and frames, in the frame of the marker `origin`.
struct SurveyNet {
  CameraModel camera;
  std::vector<BundleMarker> markers;
  std::size_t origin = 0;
  std::vector<SurveyStation> stations;
};

/// Of those with `true`: "tag36h11 5, tag36h11 6".
std::string names_of(const SurveyNet& net, const std::vector<bool>& chosen);

/// Seen minus predicted of one corner, px. False where it is predicted behind the camera.
bool residual(const SurveyNet& net, const SurveyStation& station, const Sight& sight, std::size_t corner, Vec2& off_px);

/// Unknowns of the used stations' and of all markers' poses (and sizes) but the origin's.
int unknowns_of(const SurveyNet& net, bool free_sizes);

/// Calls visit(station, sight, corner, off_px, square) for every corner, kept or not: its residual and whitened_square,
/// infinite where it is predicted behind the camera.
template <class Net, class Visit>
void each_corner(Net& net, const Visit& visit) {
  for (auto& station : net.stations) {
    for (auto& sight : station.sights) {
      for (std::size_t k = 0; k < 4; ++k) {
        Vec2 off{};
        const bool there = residual(net, station, sight, k, off);
        visit(station, sight, k, off,
              there ? whitened_square(off, sight.covariances_px2[k]) : std::numeric_limits<double>::infinity());
      }
    }
  }
}

/// In how many used stations each pair of markers is sighted together, row-major [markers, markers].
std::vector<int> sighted_together(const SurveyNet& net);
/// Markers that no chain of pairs, each seen together in kLeastTogether frames or more, ties to the origin.
std::vector<bool> unconnected(const SurveyNet& net);

/// One frame might be a wrong reading.
constexpr int kLeastTogether = 2;

}  // namespace berth
