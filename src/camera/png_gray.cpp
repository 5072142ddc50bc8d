#include <cstring>
#include <opencv2/imgcodecs.hpp>

#include "camera/bad_input.hpp"
#include "camera/decoders.hpp"
#include "camera/mat_gray.hpp"

namespace berth {
namespace {

u32 big_endian(const u8* p) { return u32{p[0]} << 24 | u32{p[1]} << 16 | u32{p[2]} << 8 | u32{p[3]}; }

/// Walks the chunks up to IEND; their checksums are libpng's task. A decoder alone would accept a file cut after its
/// last row.
void check_chunks(const std::vector<u8>& bytes, const std::string& name) {
  constexpr std::size_t kSignature = 8, kAround = 12;  // a chunk's length, type and checksum
  if (bytes.size() < kSignature || std::memcmp(bytes.data(), "\x89PNG\r\n\x1a\n", kSignature) != 0) {
    throw bad_field(name, "signature", "damaged", "the file is no whole PNG, copy it again");
  }
  std::size_t at = kSignature;
  bool first = true;
  while (bytes.size() - at >= kAround) {
    const u32 length = big_endian(&bytes[at]);
    const char* type = reinterpret_cast<const char*>(&bytes[at + 4]);
    if (length > bytes.size() - at - kAround) break;
    if (first) {
      if (std::memcmp(type, "IHDR", 4) != 0 || length != 13) {
        throw bad_field(name, "IHDR", "damaged", "the PNG's header cannot be read, copy it again");
      }
      check_image_size(big_endian(&bytes[at + 8]), big_endian(&bytes[at + 12]), name);
      first = false;
    }
    if (std::memcmp(type, "IEND", 4) == 0) return;
    at += kAround + length;
  }
  throw bad_field(name, "IEND", "missing",
                  "the PNG is cut short (" + std::to_string(bytes.size()) + " bytes), copy it again");
}

}  // namespace

GrayImage decode_png(const std::vector<u8>& bytes, const std::string& name) {
  check_chunks(bytes, name);
  cv::Mat picture;
  try {
    picture = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& e) {
    throw Error(name + ": the PNG cannot be decoded (" + e.err + "); copy it again");
  }
  if (picture.empty()) throw bad_field(name, "IDAT", "damaged", "libpng cannot decode the pixels, copy the file again");
  if (picture.depth() == CV_8U) return to_gray<u8>(picture);
  if (picture.depth() == CV_16U) return to_gray<std::uint16_t>(picture);
  throw bad_field(name, "bit depth", "unexpected", "convert the image to 8 bit");
}

}  // namespace berth
