#include "camera/ros_image.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include "berth/error.hpp"
#include "camera/decoders.hpp"
#include "recording/cdr_reader.hpp"

namespace berth {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

/// How a ROS image's pixels lie: bytes of one pixel, and where its red, green and blue are, or its gray.
struct Encoding {
  const char* name;
  std::size_t bytes, red, green, blue;
  bool gray() const { return red == green; }
};
constexpr std::array<Encoding, 7> kEncodings = {{{"mono8", 1, 0, 0, 0},
                                                 {"8UC1", 1, 0, 0, 0},
                                                 {"mono16", 2, 0, 0, 0},
                                                 {"rgb8", 3, 0, 1, 2},
                                                 {"bgr8", 3, 2, 1, 0},
                                                 {"rgba8", 4, 0, 1, 2},
                                                 {"bgra8", 4, 2, 1, 0}}};

void gray_row(const u8* from, const Encoding& encoding, bool big_endian, u8* to, u32 width) {
  for (u32 x = 0; x < width; ++x, from += encoding.bytes) {
    if (encoding.bytes == 2) {
      const u32 value = big_endian ? u32{from[0]} << 8 | from[1] : u32{from[1]} << 8 | from[0];
      to[x] = static_cast<u8>((value + 128) / 257);
    } else {
      to[x] = encoding.gray() ? from[0]
                              : static_cast<u8>(luma(from[encoding.red], from[encoding.green], from[encoding.blue]));
    }
  }
}

GrayImage read_file(CdrReader& fields, const std::string& name) {
  fields.string();  // format: the file says it itself
  std::size_t size = 0;
  const u8* const file = fields.bytes(size);
  if (!fields.ok()) throw Error(name + ": an image is damaged");
  const std::vector<u8> bytes(file, file + size);
  const bool png = size > 0 && bytes[0] == 0x89;
  return png ? decode_png(bytes, name) : decode_jpeg(bytes, name);
}

GrayImage read_pixels(CdrReader& fields, const std::string& name) {
  const u32 height = fields.uint32(), width = fields.uint32();
  const std::string encoding = fields.string();
  const bool big_endian = fields.uint8() != 0;
  const u32 step = fields.uint32();
  std::size_t size = 0;
  const u8* const pixels = fields.bytes(size);
  if (!fields.ok()) throw Error(name + ": an image is damaged");
  check_image_size(width, height, name);
  const auto known =
      std::find_if(kEncodings.begin(), kEncodings.end(), [&](const Encoding& one) { return encoding == one.name; });
  if (known == kEncodings.end()) {
    throw Error(name + ": its encoding '" + encoding + "' is not supported; record mono8, mono16, rgb8 or bgr8");
  }
  if (step < u64{width} * known->bytes || size < u64{step} * height) {
    throw Error(name + ": an image is smaller than it says");
  }
  GrayImage image(static_cast<int>(width), static_cast<int>(height));
  for (u32 y = 0; y < height; ++y) {
    gray_row(pixels + std::size_t{y} * step, *known, big_endian, image.view().row(static_cast<int>(y)), width);
  }
  return image;
}

}  // namespace

RosImage read_ros_image(const u8* data, std::size_t size, bool compressed, const std::string& name) {
  CdrReader fields(data, size);
  RosImage read;
  read.stamp_ns = std::int64_t{static_cast<s32>(fields.uint32())} * kSecond;
  read.stamp_ns += fields.uint32();
  fields.string();  // frame_id
  read.image = compressed ? read_file(fields, name) : read_pixels(fields, name);
  return read;
}

}  // namespace berth
