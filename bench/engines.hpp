#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "berth/image.hpp"

namespace berth::bench {

/// A marker as an engine reports it: corners in the paper's order, px, pixel centres at integer coordinates.
struct Found {
  int id = 0;
  std::array<std::array<double, 2>, 4> corners = {};
};

/// A marker detector for tag36h11 on gray images, one thread.
class Engine {
 public:
  virtual ~Engine() = default;
  virtual const std::string& name() const = 0;
  /// Detection alone; what it takes is what is timed.
  virtual void run(View2D<const u8> image) = 0;
  /// What the last run found.
  virtual std::vector<Found> found() const = 0;
};

/// Berth on a backend, with the given number of threads.
std::unique_ptr<Engine> make_berth(const std::string& backend, int threads);
/// libapriltag, one thread. min_white_black_diff is 5 by default; 20 keeps noise out and makes it several times faster.
std::unique_ptr<Engine> make_apriltag(float decimate, int min_white_black_diff);
/// OpenCV's ArUco detector with its AprilTag 36h11 dictionary and subpixel corners.
std::unique_ptr<Engine> make_opencv_aruco();

/// By name: simd, cpu, opencl, reference; apriltag-d1, apriltag-d1-tuned, apriltag-d2, apriltag-d2-tuned; aruco.
/// Throws Error on any other.
std::unique_ptr<Engine> make_engine(const std::string& name, int threads);

}  // namespace berth::bench
