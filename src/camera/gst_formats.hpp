#pragma once

#include "camera/pixel_format.hpp"

namespace berth {

struct GstFormat {
  /// GStreamer's.
  const char* name;
  PixelFormat layout;
};

// Best first, as GStreamer tries them in this order. I420 differs from NV12 in what is not looked at.
constexpr GstFormat kGstFormats[] = {
    {"GRAY8", PixelFormat::mono8}, {"NV12", PixelFormat::nv12}, {"I420", PixelFormat::nv12},
    {"YUY2", PixelFormat::yuyv},   {"UYVY", PixelFormat::uyvy}, {"GRAY16_LE", PixelFormat::mono16},
    {"BGR", PixelFormat::bgr8},    {"RGB", PixelFormat::rgb8},
};

}  // namespace berth
