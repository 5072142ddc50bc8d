#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "berth/image.hpp"
#include "berth/types.hpp"

namespace berth {

/// A ROS 2 image message as gray pixels.
struct RosImage {
  GrayImage image;
  /// Of its header, ns since 1970.
  std::int64_t stamp_ns = 0;
};

/// Reads sensor_msgs/Image (mono8, mono16, rgb8, bgr8, with or without alpha) or, `compressed`, CompressedImage (PNG,
/// JPEG) from CDR bytes that may be anything. Throws Error, which begins with `name`, where it cannot.
RosImage read_ros_image(const u8* data, std::size_t size, bool compressed, const std::string& name);

}  // namespace berth
