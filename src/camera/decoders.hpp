#pragma once

#include <string>
#include <vector>

#include "berth/image.hpp"
#include "berth/types.hpp"

namespace berth {

/// Luma of 8-bit or 16-bit channels with ITU-R BT.601's weights as libjpeg rounds them (they sum to 65536).
inline u32 luma(u32 red, u32 green, u32 blue) {
  return static_cast<u32>((u64{19595} * red + u64{38470} * green + u64{7471} * blue + 32768) >> 16);
}

/// Decoders of whole files held in memory; `name` is for the message. Each throws Error as read_gray_image says.
GrayImage decode_png(const std::vector<u8>& bytes, const std::string& name);
GrayImage decode_jpeg(const std::vector<u8>& bytes, const std::string& name);
GrayImage decode_pnm(const std::vector<u8>& bytes, const std::string& name);

/// Throws Error unless 1 ≤ width, height ≤ kMaxImageSide.
void check_image_size(u64 width, u64 height, const std::string& name);

}  // namespace berth
