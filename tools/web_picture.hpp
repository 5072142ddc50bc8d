#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace berth::cli {

/// Pictures as they are sent: JPEG, smaller where they are wider than a screen needs. Keeps its memory.
class PictureEncoder {
 public:
  /// Of 8-bit gray.
  std::string jpeg(const cv::Mat& pixels);

 private:
  cv::Mat smaller_;
  std::vector<unsigned char> jpeg_;
};

}  // namespace berth::cli
