#include "camera/pixel_format.hpp"

#include <algorithm>

#include "camera/decoders.hpp"

namespace berth {
namespace {

constexpr u8 scaled(u32 value, u32 most) { return static_cast<u8>((value * 255 + most / 2) / most); }

u32 word(const u8* at) { return at[0] | static_cast<u32>(at[1]) << 8; }

/// `bits` bits that begin at bit `first` of the row.
u32 packed(const u8* row, std::size_t first, u32 bits) {
  const u8* at = row + first / 8;
  return (word(at) >> (first % 8)) & ((1U << bits) - 1);
}

/// Row or column `i` of `count`, or the one of the same phase within.
int mirrored(int i, int count) {
  if (count == 1) return 0;
  if (i < 0) return -i;
  return i < count ? i : 2 * (count - 1) - i;
}

u8 bayer_gray(const u8* data, std::size_t stride, int x, int y, View2D<u8> gray) {
  u32 sum = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    const u8* row = data + static_cast<std::size_t>(mirrored(y + dy, gray.height)) * stride;
    for (int dx = -1; dx <= 1; ++dx) {
      sum += static_cast<u32>((2 - std::abs(dx)) * (2 - std::abs(dy))) * row[mirrored(x + dx, gray.width)];
    }
  }
  return static_cast<u8>((sum + 8) / 16);
}

/// One row, of all formats that need no other.
void row_to_gray(const u8* row, PixelFormat format, u8* gray, int width) {
  const auto each = [&](auto&& pixel) {
    for (int x = 0; x < width; ++x) gray[x] = pixel(static_cast<std::size_t>(x));
  };
  switch (format) {
    case PixelFormat::mono10:
      return each([&](std::size_t x) { return scaled(word(row + 2 * x) & 1023, 1023); });
    case PixelFormat::mono12:
      return each([&](std::size_t x) { return scaled(word(row + 2 * x) & 4095, 4095); });
    case PixelFormat::mono16:
      return each([&](std::size_t x) { return scaled(word(row + 2 * x), 65535); });
    case PixelFormat::mono10_packed:
      return each([&](std::size_t x) { return scaled(packed(row, 10 * x, 10), 1023); });
    case PixelFormat::mono12_packed:
      return each([&](std::size_t x) { return scaled(packed(row, 12 * x, 12), 4095); });
    case PixelFormat::yuyv:
      return each([&](std::size_t x) { return row[2 * x]; });
    case PixelFormat::uyvy:
      return each([&](std::size_t x) { return row[2 * x + 1]; });
    case PixelFormat::bgr8:
      return each([&](std::size_t x) { return static_cast<u8>(luma(row[3 * x + 2], row[3 * x + 1], row[3 * x])); });
    case PixelFormat::rgb8:
      return each([&](std::size_t x) { return static_cast<u8>(luma(row[3 * x], row[3 * x + 1], row[3 * x + 2])); });
    case PixelFormat::mono8:
    case PixelFormat::nv12:
    case PixelFormat::bayer8:
      std::copy_n(row, width, gray);
  }
}

}  // namespace

const char* name_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::mono8:
      return "Mono8";
    case PixelFormat::mono10:
      return "Mono10";
    case PixelFormat::mono12:
      return "Mono12";
    case PixelFormat::mono16:
      return "Mono16";
    case PixelFormat::mono10_packed:
      return "Mono10p";
    case PixelFormat::mono12_packed:
      return "Mono12p";
    case PixelFormat::bayer8:
      return "Bayer8";
    case PixelFormat::yuyv:
      return "YUYV";
    case PixelFormat::uyvy:
      return "UYVY";
    case PixelFormat::nv12:
      return "NV12";
    case PixelFormat::bgr8:
      return "BGR8";
    case PixelFormat::rgb8:
      return "RGB8";
  }
  return "";
}

std::size_t row_bytes(PixelFormat format, int width) {
  const std::size_t pixels = static_cast<std::size_t>(width);
  switch (format) {
    case PixelFormat::mono8:
    case PixelFormat::bayer8:
    case PixelFormat::nv12:
      return pixels;
    case PixelFormat::mono10_packed:
      return (10 * pixels + 7) / 8;
    case PixelFormat::mono12_packed:
      return (12 * pixels + 7) / 8;
    case PixelFormat::bgr8:
    case PixelFormat::rgb8:
      return 3 * pixels;
    case PixelFormat::mono10:
    case PixelFormat::mono12:
    case PixelFormat::mono16:
    case PixelFormat::yuyv:
    case PixelFormat::uyvy:
      return 2 * pixels;
  }
  return pixels;
}

bool to_gray(const u8* data, std::size_t bytes, std::size_t stride, PixelFormat format, View2D<u8> gray) {
  const std::size_t row = row_bytes(format, gray.width);
  if (gray.height < 1 || stride < row || bytes < stride * static_cast<std::size_t>(gray.height - 1) + row) return false;
  for (int y = 0; y < gray.height; ++y) {
    if (format == PixelFormat::bayer8) {
      for (int x = 0; x < gray.width; ++x) gray.at(x, y) = bayer_gray(data, stride, x, y, gray);
    } else {
      row_to_gray(data + static_cast<std::size_t>(y) * stride, format, gray.row(y), gray.width);
    }
  }
  return true;
}

}  // namespace berth
