#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "berth/detector.hpp"
#include "berth/error.hpp"

int main(int argc, char** argv) try {
  const cv::Mat image = cv::imread(argc > 1 ? argv[1] : "dock.png", cv::IMREAD_GRAYSCALE);
  if (image.empty()) return std::fprintf(stderr, "no image that can be read\n"), 2;
  berth::DetectorConfig config;                                 // looks for tag36h11 unless told otherwise
  config.camera = berth::paper_camera(image.cols, image.rows);  // 4:3 alone; yours: berth::read_camera("camera.yaml")
  config.marker_size_m = 0.1;
  const auto backend = berth::open_backend("simd");
  berth::Detector detector(*backend, image.cols, image.rows, config);
  for (const auto& marker : detector.detect({image.data, image.cols, image.rows, image.cols}).detections) {
    const auto& t = marker.pose.t;  // metres: x right, y down, z away from the camera
    std::printf("%s %d at %.4f %.4f %.4f m\n", marker.family->name.c_str(), marker.id, t[0], t[1], t[2]);
  }
} catch (const berth::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 2;
}
