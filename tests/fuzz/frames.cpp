// Pixels as a camera may give them, whole or not, and frames of any size and content through the whole detector.
#include <algorithm>
#include <cmath>
#include <memory>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "camera/pixel_format.hpp"
#include "fuzz/targets.hpp"

namespace berth::fuzz {
namespace {

/// Takes numbers off the front; 0 where nothing is left.
class Bytes {
 public:
  Bytes(const u8* bytes, std::size_t count) : next_(bytes), left_(count) {}

  int number(int below) {
    if (left_ == 0) return 0;
    --left_;
    return *next_++ % below;
  }
  const u8* rest() const { return next_; }
  std::size_t left() const { return left_; }

 private:
  const u8* next_;
  std::size_t left_;
};

bool is_finite(const Pose& pose) {
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(pose.R.begin(), pose.R.end(), finite) && std::all_of(pose.t.begin(), pose.t.end(), finite);
}

/// Some lens at that size.
CameraModel camera_of(int width, int height, int kind) {
  CameraModel camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 0.8 * width;
  camera.cx = 0.5 * width;
  camera.cy = 0.5 * height;
  if (kind == 1) camera.distortion = {-0.2, 0.05, 0.001, -0.001, 0, 0, 0, 0};
  if (kind == 2) camera.lens = LensModel::equidistant;
  return camera;
}

void check(const Detection& detection, int width, int height) {
  require(detection.id >= 0 && detection.id < static_cast<int>(detection.family->codes.size()), "ids are the family's");
  for (const auto& corner : detection.corners) {
    require(std::isfinite(corner[0]) && std::isfinite(corner[1]), "corners are finite");
    require(corner[0] > -width && corner[0] < 2 * width && corner[1] > -height && corner[1] < 2 * height,
            "corners are near the image");
  }
  if (!detection.has_pose) return;
  require(is_finite(detection.pose), "poses are finite");
  if (!detection.pose_uncertainty) return;
  for (const double v : detection.pose_uncertainty->covariance) require(std::isfinite(v), "covariances are finite");
}

}  // namespace

void camera_pixels(const u8* bytes, std::size_t count) {
  Bytes input(bytes, count);
  const auto format = static_cast<PixelFormat>(input.number(static_cast<int>(PixelFormat::rgb8) + 1));
  const int width = 1 + input.number(64);
  const int height = 1 + input.number(64);
  const std::size_t stride = row_bytes(format, width) + static_cast<std::size_t>(input.number(8));
  GrayImage gray(width, height);
  // A buffer of its own size, so that a byte read beyond it is noticed.
  const std::unique_ptr<u8[]> pixels(new u8[input.left()]);
  std::copy_n(input.rest(), input.left(), pixels.get());
  to_gray(pixels.get(), input.left(), stride, format, gray.view());
}

void marker_frame(const u8* bytes, std::size_t count) {
  Bytes input(bytes, count);
  const int width = 1 + input.number(255);
  const int height = 1 + input.number(255);
  const int lens = input.number(4);
  const int repeat = 1 + input.number(8);
  DetectorConfig config;
  static const std::vector<std::vector<std::string>> kFamilies = {
      {"tag36h11"}, {"tag16h5", "aruco4x4_50"}, {"tagStandard41h12"}, {"tagCircle21h7", "aruco5x5_100"}};
  config.families = kFamilies[static_cast<std::size_t>(input.number(4))];
  config.corner_method = input.number(2) == 1 ? CornerMethod::photometric : CornerMethod::edges;
  config.pose_method = input.number(2) == 1 ? PoseMethod::paper : PoseMethod::least_squares;
  const int few = input.number(4);
  if (few > 0) config.capacities = {few * 16, few * 4, few * 32};
  if (lens < 3) {
    config.camera = camera_of(width, height, lens);
    config.marker_size_m = 0.1;
  }
  // Each byte is a block of pixels; what is missing is dark.
  GrayImage image(width, height);
  const int across = (width + repeat - 1) / repeat;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const std::size_t at = static_cast<std::size_t>(y / repeat) * static_cast<std::size_t>(across) +
                             static_cast<std::size_t>(x / repeat);
      image.view().row(y)[x] = at < input.left() ? input.rest()[at] : u8{0};
    }
  }
  static const std::unique_ptr<Backend> backend = open_backend("simd");
  Detector detector(*backend, width, height, config);
  const FrameResult& result = detector.detect(image.view());
  for (const Detection& detection : result.detections) check(detection, width, height);
  const std::size_t found = result.detections.size();
  require(detector.detect(image.view()).detections.size() == found, "the same frame has the same markers");
}

}  // namespace berth::fuzz
