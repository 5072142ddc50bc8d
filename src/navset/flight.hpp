#pragma once

#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "navset/backdrop.hpp"
#include "navset/develop.hpp"
#include "navset/render.hpp"
#include "navset/target.hpp"
#include "sim/sensor.hpp"

namespace berth::navset {

/// What a flight's camera sees at one instant, and how it truly is.
struct FlightFrame {
  GrayImage image;
  /// Target frame and frame of its docking marker to the camera's, m.
  Pose target, marker;
  /// Image of the target's centre and d = focal length · kTargetDiameter_m / depth, px.
  double x = 0, y = 0, d_px = 0;
  /// From the camera to the marker, m.
  double marker_range_m = 0;
};

/// A camera's flight to the target, 6 m to 0.15 m before its docking marker, in `frames` frames that close in by the
/// same share each: livery, background, light, exposure, way and attitude are functions of the seed. The target drifts
/// through the image and rolls; its ring faces the camera within 25 degrees.
class Flight {
 public:
  static constexpr double kFrom_m = 6, kTo_m = 0.15;

  /// Without its target a flight shows how often something else is taken for it.
  Flight(u64 seed, int frames, bool with_target = true);

  /// 640 x 480, the docking camera's focal length, no distortion.
  static CameraModel camera();
  int frames() const { return frames_; }
  /// "white, lab, lamps"
  std::string title() const;
  /// A function of the seed, `index` and frames().
  FlightFrame frame(int index) const;

 private:
  /// A slow swing: amplitude · sin(2 pi (turns u + phase)).
  struct Swing {
    double turns, phase;
    double at(double u) const;
  };
  void place(double u, FlightFrame& frame) const;
  std::vector<double> background(double u) const;

  u64 seed_;
  int frames_;
  bool with_target_;
  const Livery* livery_;
  Model model_;
  BackdropKind kind_;
  GrayImage backdrop_;
  const char* mood_ = "";
  Light light_;
  double mirror_gain_;
  Exposure exposure_;
  double brightness_;
  Swing swing_x_, swing_y_, tilt_x_, tilt_y_, pan_;
  double roll_from_, roll_by_;
  sim::SensorModel sensor_;
};

}  // namespace berth::navset
