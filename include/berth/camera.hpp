#pragma once

#include <array>
#include <string>

namespace berth {

/// How a lens departs from a pinhole.
enum class LensModel {
  /// Brown's: ROS `plumb_bob`, and with the last three coefficients `rational_polynomial`.
  radial_tangential,
  /// Kannala and Brandt's for fisheyes: ROS `equidistant`, OpenCV's fisheye.
  equidistant,
};

/// Pinhole camera with a lens, in pixels of a width × height image whose pixel centres lie at integer coordinates.
/// Camera frame: x right, y down, z forward.
struct CameraModel {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  /// radial_tangential: k1, k2, p1, p2, k3, k4, k5, k6; equidistant: k1, k2, k3, k4, of the angle's odd powers from 3.
  std::array<double, 8> distortion = {};
  LensModel lens = LensModel::radial_tangential;

  /// Image point (px) of the point (x, y, 1) in the camera frame. Only + − × ÷ √: the same bits on every machine.
  std::array<double, 2> project(double x, double y) const;
  /// The same, and its derivative: du/dx, du/dy, dv/dx, dv/dy.
  std::array<double, 2> project(double x, double y, std::array<double, 4>& derivative) const;
  /// The inverse of project, by a fixed number of Newton steps; accurate to 1e-9 px where the lens is one-to-one and
  /// less than 89° off the axis. No point (x, y, 1) is further than 90° off it: rays there come out at about 89.95°.
  std::array<double, 2> undistort(double u_px, double v_px) const;
};

/// Table 2 of the paper (a 1280 × 960 image), scaled with the pixel centre convention kept. Throws Error unless width
/// to height is 4 to 3.
CameraModel paper_camera(int width = 640, int height = 480);

/// The camera when its whole image is resized. Throws Error unless the sides' ratio stays, to a pixel.
CameraModel resized_camera(const CameraModel& camera, int width, int height);
/// The camera when the middle of its image is cut out. Throws Error where that is larger, or not in the very middle.
CameraModel cropped_camera(const CameraModel& camera, int width, int height);

/// Reads a camera file: ROS camera_info YAML, Kalibr camchain YAML or a PhotonVision calibration in JSON, told apart by
/// what is in it. Of a camchain with several cameras, "FILE#cam1" names one. Throws Error naming the file, the field,
/// the value and the remedy.
CameraModel read_camera(const std::string& path);

/// Reads a ROS camera_info YAML file. Throws Error naming the file, the field, the value and the remedy.
CameraModel read_camera_info(const std::string& path);

/// Writes a ROS camera_info YAML file. Throws Error when the file cannot be written.
void write_camera_info(const std::string& path, const CameraModel& camera, const std::string& name = "camera");

}  // namespace berth
