#pragma once

#include "berth/image.hpp"

namespace berth::test {

/// 64-bit FNV-1a over an image's pixels in raster order.
inline u64 image_digest(const GrayImage& image) {
  u64 hash = 0xcbf29ce484222325u;
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) hash = (hash ^ image.view().at(x, y)) * 0x100000001b3u;
  }
  return hash;
}

}  // namespace berth::test
