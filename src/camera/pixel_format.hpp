#pragma once

#include <cstddef>
#include <string>

#include "berth/image.hpp"

namespace berth {

/// How a camera lays out its pixels. Words of more than 8 bits are little-endian.
enum class PixelFormat {
  mono8,
  /// One 16-bit word a pixel, its value in the lower 10, 12 or all bits.
  mono10,
  mono12,
  mono16,
  /// Packed without gaps, least significant bits first (GenICam's Mono10p, Mono12p): 4 pixels in 5 bytes, 2 in 3.
  mono10_packed,
  mono12_packed,
  /// One colour a pixel in a 2 × 2 pattern that has green twice on one diagonal, whichever comes first.
  bayer8,
  /// Luma and chroma in turns; luma first (YUYV) or second (UYVY) of each 16 bits.
  yuyv,
  uyvy,
  /// A plane of luma, then one of chroma, which is not looked at.
  nv12,
  bgr8,
  rgb8,
};

const char* name_of(PixelFormat format);

/// Bytes of a row of `width` pixels without padding (of its luma for nv12).
std::size_t row_bytes(PixelFormat format, int width);

/// Rows of `stride` bytes as 8-bit gray. Values of 10, 12 and 16 bits are scaled to 255 and rounded to nearest, colours
/// go by read_gray_image's weights. Of a Bayer pattern the gray is (R + 2 G + B) / 4 of its bilinear interpolation, in
/// one step: the weights 1 2 1, 2 4 2, 1 2 1 over 16 do just that on every phase of the pattern; rows and columns
/// beyond the border are those two further in, which keeps the phase.
/// Returns false, and writes nothing, where `bytes` are too few for the image: the frame is incomplete.
bool to_gray(const u8* data, std::size_t bytes, std::size_t stride, PixelFormat format, View2D<u8> gray);

}  // namespace berth
