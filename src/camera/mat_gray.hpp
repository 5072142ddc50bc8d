#pragma once

#include <opencv2/core/mat.hpp>

#include "berth/image.hpp"
#include "camera/decoders.hpp"

namespace berth {

/// OpenCV's picture as 8-bit gray, by read_gray_image's rules. T is u8 or std::uint16_t, as the picture's depth;
/// channels are gray, gray + alpha, blue green red, or blue green red alpha.
template <class T>
GrayImage to_gray(const cv::Mat& picture) {
  GrayImage gray(picture.cols, picture.rows);
  const int channels = picture.channels();
  for (int y = 0; y < picture.rows; ++y) {
    const T* from = picture.ptr<T>(y);
    u8* to = gray.view().row(y);
    for (int x = 0; x < picture.cols; ++x, from += channels) {
      const u32 value = channels >= 3 ? luma(from[2], from[1], from[0]) : u32{from[0]};
      to[x] = static_cast<u8>(sizeof(T) == 1 ? value : (value + 128) / 257);
    }
  }
  return gray;
}

}  // namespace berth
