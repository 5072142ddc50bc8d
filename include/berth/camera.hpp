#pragma once

#include <array>
#include <string>

namespace berth {

/// Pinhole camera with radial and tangential distortion (Brown; ROS `plumb_bob`), in pixels of a width × height image
/// whose pixel centres lie at integer coordinates. Camera frame: x right, y down, z forward.
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  /// k1, k2, p1, p2, k3
  std::array<double, 5> distortion = {0, 0, 0, 0, 0};

  /// Image point (px) of the point (x, y, 1) in the camera frame. Only + − × ÷: the same bits on every machine.
  std::array<double, 2> project(double x, double y) const;
  /// The same, and its derivative: du/dx, du/dy, dv/dx, dv/dy.
  std::array<double, 2> project(double x, double y, std::array<double, 4>& derivative) const;
  /// The inverse of project, by a fixed number of Newton steps; accurate to 1e-9 px where the lens is one-to-one.
  std::array<double, 2> undistort(double u_px, double v_px) const;
};

/// Table 2 of the paper (a 1280 × 960 image), halved for 640 × 480 with the pixel centre convention kept.
CameraModel paper_camera(int width = 640, int height = 480);

/// Reads a ROS camera_info YAML file. Throws Error naming the file, the field, the value and the remedy.
CameraModel read_camera_info(const std::string& path);

/// Writes a ROS camera_info YAML file. Throws Error when the file cannot be written.
void write_camera_info(const std::string& path, const CameraModel& camera, const std::string& name = "camera");

}  // namespace berth
