#pragma once

#include "camera/pixel_format.hpp"

namespace berth {

struct AravisFormat {
  /// GenICam's (PFNC's, or what cameras say that are older than it).
  const char* name;
  PixelFormat layout;
};

// Best first: more grey levels do not help eight-bit kernels, so the fewest bytes that carry them; colour patterns cost
// sharpness.
constexpr AravisFormat kAravisFormats[] = {
    {"Mono8", PixelFormat::mono8},
    {"Mono10p", PixelFormat::mono10_packed},
    {"Mono12p", PixelFormat::mono12_packed},
    {"Mono10", PixelFormat::mono10},
    {"Mono12", PixelFormat::mono12},
    {"Mono16", PixelFormat::mono16},
    {"YUV422_8", PixelFormat::yuyv},
    {"YUV422_8_UYVY", PixelFormat::uyvy},
    {"YUV422Packed", PixelFormat::uyvy},
    {"BayerRG8", PixelFormat::bayer8},
    {"BayerGR8", PixelFormat::bayer8},
    {"BayerGB8", PixelFormat::bayer8},
    {"BayerBG8", PixelFormat::bayer8},
    {"BGR8", PixelFormat::bgr8},
    {"RGB8", PixelFormat::rgb8},
    {"BGR8Packed", PixelFormat::bgr8},
    {"RGB8Packed", PixelFormat::rgb8},
};

}  // namespace berth
