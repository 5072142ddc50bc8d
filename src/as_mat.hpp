#pragma once

#include <opencv2/core.hpp>

#include "berth/image.hpp"

namespace berth {

/// The pixels where they are, for OpenCV to read: CV_8U, height x width. They must outlive it.
inline cv::Mat as_mat(View2D<const u8> image) {
  return {image.height, image.width, CV_8U, const_cast<u8*>(image.data), static_cast<std::size_t>(image.stride)};
}

}  // namespace berth
